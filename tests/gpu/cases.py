"""Small scenes that are run on an emulated device and on the CPU, and what is compared of them.

`python cases.py OUT.npz CASE` runs one of them on the device (emulated.py starts it so).
"""

import ctypes
import json
import sys

import numpy as np

from dusttaichi import method
from dusttaichi.grains.compiled import step_numbers
from dusttaichi.scene import from_yaml
from dusttaichi.studies.selftest import scenes

DUST = """
name: dust
method: continuum
dimension: 2
material: dust_g09
sample: {kind: block, size: [0.6 mm, 0.8 mm]}
boundary: {kind: faces, bottom: rigid, top: rigid, periodic: [x], wall_speed: 1 m/s}
numerics: {spacing: 100 um, threads: 1, viscosity: {grid: 0.02}}
stop: {steps: 100}
"""
BEAD = """
name: bead
method: continuum
dimension: 3
material: dust_g09
sample:
  kind: impact
  target: {kind: block, size: [0.8 mm, 0.8 mm, 0.5 mm]}
  projectile: {kind: rigid, shape: sphere, diameter: 0.4 mm, density: 2540 kg/m^3}
  speed: 2 m/s
gravity: 9.81 m/s^2
boundary: {kind: faces, bottom: rigid}
numerics: {spacing: 100 um, threads: 1, contact: separate}
stop: {steps: 100}
"""

# a sphere that touches grains on the way, and a weight that moves those at the walls by more than
# the rounding of mixed precision does
NEAR = {"sphere.gap": "1 nm", "gravity.acceleration": ["0 m/s^2", "0 m/s^2", "-1e6 m/s^2"]}
# Scenes of grains are those of `dust selftest`, with further precisions and boundaries.
GRAINS = {
    "box_f64": ("box", {}),
    "box_mixed": ("box", {"numerics.precision": "mixed"}),
    "box_f32": ("box", {"numerics.precision": "f32"}),
    "sheared_mixed": ("sheared cell, mixed", {}),
    "sheared_f64": ("sheared cell, mixed", {"numerics.precision": "f64"}),
    "sphere_f64": ("sphere and gravity", NEAR),
    "sphere_mixed": ("sphere and gravity", NEAR | {"numerics.precision": "mixed"}),
    "unequal_f64": ("grains of different size", {}),
    "unequal_mixed": ("grains of different size", {"numerics.precision": "mixed"}),
}
CONTINUUM = {"dust_2d": (DUST, 4), "bead_3d": (BEAD, 3)}
NAMES = [*GRAINS, *CONTINUUM]
STEPS = 60  # of grains

# Of the largest number of each kind. Double precision: compilers fuse a multiplication and an
# addition here and not there, and a device divides in another way: rounding, which collisions make
# larger. Mixed: displacements and loads are rounded to 6e-8 in each of 60 steps, and loads nearly
# cancel: 1e-5 of a twisting moment was seen, in a scene that agrees to 1e-9 in double precision.
# Single: positions as well.
TOLERANCE = {"f64": 1e-9, "mixed": 3e-5, "f32": 1e-3}


def scene_of(name, backend):
    """The Scene of a case."""
    if name in GRAINS:
        base, changes = GRAINS[name]
        scene = scenes.scene(base, backend)
        for key, value in changes.items():
            scene = scene.with_value(key, value)
        return scene
    return from_yaml(CONTINUUM[name][0]).with_value("numerics.backend", backend)


def tolerance(name):
    """What numbers of a case may differ by from one backend to the other."""
    precision = getattr(scene_of(name, "cpu").numerics, "precision", "f64")
    return TOLERANCE[precision]


def run(name, backend, steps=None):
    """(Motion of a case after its steps, searches on the way)."""
    scene = scene_of(name, backend)
    usual = STEPS if name in GRAINS else CONTINUUM[name][1]
    motion = method.of(scene).build(scene, method.make_sample(scene))
    before = motion.sim.search.count
    motion.advance(usual if steps is None else steps)
    return motion, motion.sim.search.count - before


def numbers(motion):
    """Name -> array, of all that is compared."""
    sim = motion.sim
    found = {f"state {name}": a for name, a in _state(sim).items()}
    measured = vars(motion.measure())
    found |= {f"measured {name}": np.asarray(a) for name, a in measured.items() if _is_number(a)}
    return {name: a for name, a in found.items() if np.issubdtype(a.dtype, np.number)}


def _is_number(a):
    return isinstance(a, (int, float, np.ndarray, np.number))


def _state(sim):
    if hasattr(sim, "grain_state"):
        x, v, w = sim.grain_state()
        force, torque = sim.forces()
        own = {"x": x, "v": v, "w": w, "force": force, "torque": torque}
        for name, a in sim.measure().items():
            own[f"sum {name}"] = np.asarray(a)
        contacts = sim.contact_state()
        order = np.lexsort((contacts["grain_j"], contacts["grain_i"]))
        own |= {f"contact {name}": a[order] for name, a in contacts.items()}
        if sim.layout.stress:
            own["flux"] = sim.momentum_flux()
        return own
    names = ("x", "v", "density", "pressure", "deviator", "force", "loss", "work")
    own = {name: sim.in_order(sim.of_particles(name)) for name in names}
    return own | {"rigid": sim.rigid(0, 36), "clock": sim.clock[:4]}


def counts():
    """What the driver has counted so far (emulator/driver.c)."""
    out = (ctypes.c_long * 6)()
    ctypes.CDLL("libcuda.so.1").emulator_counts(out)
    names = ("launches", "to_device", "from_device", "bytes_to", "bytes_from", "syncs")
    return dict(zip(names, out, strict=True))


def counted(name):
    """What a stretch of steps takes, of grains one without a search, and what a search of a
    continuum takes: steps, searches, and the driver's counts."""
    scene = scene_of(name, "cuda")
    if name in GRAINS:
        scene = scene.with_value("numerics.skin", 0.4)
    motion = method.of(scene).build(scene, method.make_sample(scene))
    sim = motion.sim
    if name in CONTINUUM:  # how many steps a step of the run takes is known from the one before
        motion.advance(1)
    first, searches, before = _steps(sim), sim.search.count, counts()
    motion.advance(2 * 16 if name in GRAINS else 1)
    taken = _since(before) | {"steps": _steps(sim) - first, "searches": sim.search.count - searches}
    if name in CONTINUUM:
        before = counts()
        sim.search.now()
        taken["search"] = _since(before)
    return taken


def _since(before):
    return {key: n - before[key] for key, n in counts().items()}


def step_arguments(sim):
    """The numbers of a step as its kernels take them."""
    masses = sim.unit_mass, sim.unit_inertia
    return step_numbers(sim.dt, masses, sim.search.wall_due, sim.search.reach2)


def _steps(sim):
    return sim.substeps if hasattr(sim, "substeps") else sim.step


def main(path, name):
    """Runs a case on the device; writes its numbers and what it took."""
    motion, searches = run(name, "cuda")
    out = numbers(motion)
    told = {"searches": searches, "counted": counted(name)}
    np.savez(path, told=np.array(json.dumps(told)), **out)


if __name__ == "__main__":
    main(*sys.argv[1:])
