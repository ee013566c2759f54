"""Small scenes for the emulated device and the CPU, and the numbers that are compared.

`python cases.py OUT.npz CASE` runs one of them on the device; emulated.py starts it.
"""

import ctypes
import json
import sys

import numpy as np
import stored_states

from dusttaichi import method
from dusttaichi.continuum.kernels.store import COLUMN
from dusttaichi.scene import from_yaml

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
GAS = """
name: gas
method: continuum
dimension: 2
material: dust_g09
sample: {kind: block, size: [0.6 mm, 0.6 mm]}
boundary: {kind: open}
charge: {per_mass: 10 C/kg}
forces:
  - {kind: gas_drag, stopping_time: 20 us, velocity: [0 m/s, 0 m/s, 3 m/s]}
  - {kind: rotating_frame, angular_velocity: [0 rad/s, 1e3 rad/s, 0 rad/s]}
  - {kind: electric_field, field: [2e3 V/m, 0 V/m, 0 V/m], frequency: 1 MHz}
numerics: {spacing: 100 um, threads: 1, viscosity: {grid: 0.02}}
stop: {steps: 100}
"""
# with all that a record has: an elastic body, heat, damage, two dusts, self-gravity
BODIES = """
name: bodies
method: continuum
dimension: 2
material: &dust
  {base: dust_g09, heat_capacity: 800 J/(kg K), temperature: 280 K, damage: {lg_k: 45, m: 9}}
materials: {other: {<<: *dust, compressive: {p_m: 4 kPa}}}
sample:
  kind: several
  bodies:
    - {kind: elastic, diameter: 0.6 mm, density: 1 g/cm^3, bulk_modulus: 1 MPa, shear_ratio: 0.22,
       position: [0 mm, 0 mm], velocity: [3 m/s, 0 m/s], spin: 1e3 rad/s}
    - {kind: sphere, diameter: 0.6 mm, position: [0.65 mm, 0.1 mm]}
    - {kind: sphere, diameter: 0.4 mm, position: [0 mm, 0.6 mm], material: other}
boundary: {kind: open}
gravity: {self_gravity: {constant: 3e5}}
numerics: {spacing: 100 um, threads: 1, contact: separate, viscosity: {grid: 0.02}}
stop: {steps: 100}
"""

# a weight that moves grains by more than rounding does; with it a sphere that touches grains
WEIGHT = {"gravity.acceleration": ["0 m/s^2", "0 m/s^2", "-1e6 m/s^2"]}
NEAR = {"sphere.gap": "1 nm"} | WEIGHT
LAYER = {
    "boundary": {"kind": "periodic", "axes": ["x", "y"], "walls": ["bottom", "top"]},
    "boundary.wall_speed": "3 m/s",
    "sample": {"kind": "rbd", "grains": stored_states.STORED, "seed": 3, "periodic": True},
}
# a tube that closes, slides and turns around them; a shell, a rod that turns and a floor at them
TUBE = {
    "boundary": {
        "kind": "tube",
        "wall_speed": "3 m/s",
        "closing_speed": "3 m/s",
        "axial_speed": "-1 m/s",
        "rotation": "1e6 rad/s",
    }
}
SHELL = {"kind": "sphere", "radius": "6.6 um", "velocity": ["0 m/s", "0 m/s", "-5 m/s"]}
ROD = {
    "kind": "cylinder",
    "grains": "outside",
    "radius": "2 um",
    "centre": ["-5.22 um", "0 um", "0.6 um"],
    "axis": [0, 1, 0],
    "velocity": ["3 m/s", "0 m/s", "0 m/s"],
    "spin": ["0 rad/s", "2e6 rad/s", "0 rad/s"],
}
FLOOR = {
    "kind": "plane",
    "point": ["0 m", "0 m", "-5 nm"],
    "normal": [0, 0, 1],
    "velocity": ["0 m/s", "1 m/s", "3 m/s"],
    "strength": 2.0,
}
SURFACES = {
    "boundary": {"kind": "box", "omit": ["bottom", "top"]},
    "surfaces": [SHELL, ROD, FLOOR],
}
# the same around grains of different size, whose outermost are elsewhere
AROUND = {
    "boundary": {"kind": "box", "wall_speed": "0.1 m/s"},
    "surfaces": [
        SHELL | {"radius": "6.69 um"},
        ROD | {"centre": ["-4.81 um", "0 um", "4.18 um"]},
        FLOOR,
    ],
}
FORCES = {
    "charge": "1e-15 C",
    "forces": [
        {"kind": "gas_drag", "stopping_time": "20 ns", "velocity": ["5 m/s", "0 m/s", "0 m/s"]},
        {"kind": "rotating_frame", "angular_velocity": ["0 rad/s", "1e6 rad/s", "3e6 rad/s"]},
        {
            "kind": "electric_field",
            "field": ["1e8 V/m", "0 V/m", "1e8 V/m"],
            "frequency": "50 MHz",
            "magnetic_field": ["0 T", "1e6 T", "0 T"],
        },
    ],
}
GAS_OF_MOLECULES = {
    "kind": "gas_drag",
    "density": "1e3 kg/m^3",
    "velocity": ["5 m/s"] + ["0 m/s"] * 2,
}
# Scenes of stored_states.py, also in other precisions and with other boundaries.
GRAINS = {
    "box_f64": ("box", {}),
    "box_mixed": ("box", {"numerics.precision": "mixed"}),
    "box_f32": ("box", {"numerics.precision": "f32"}),
    "sheared_mixed": ("sheared cell, mixed", {}),
    "sheared_f64": ("sheared cell, mixed", {"numerics.precision": "f64"}),
    "sphere_f64": ("sphere and gravity", NEAR),
    "sphere_mixed": ("sphere and gravity", NEAR | {"numerics.precision": "mixed"}),
    # a controlled pressure on the top wall, whose speed the host changes every 25 steps
    "pressed_f64": ("box", {"boundary.pressure": "20 kPa"} | WEIGHT),
    # several blocks of threads, and chunks of grains
    "many_mixed": ("box", {"numerics.precision": "mixed", "sample.grains": 600}),
    "many_sheared_f64": (
        "sheared cell, mixed",
        {"numerics.precision": "f64", "sample.grains": 600},
    ),
    # a piece of a deposit: walls below and above, faces across which grains touch beside them
    "layer_mixed": ("box", LAYER | {"numerics.precision": "mixed"}),
    "unequal_f64": ("grains of different size", {}),
    "unequal_mixed": ("grains of different size", {"numerics.precision": "mixed"}),
    "tube_f64": ("box", TUBE),
    "surfaces_f64": ("box", SURFACES),
    "surfaces_unequal_mixed": (
        "grains of different size",
        AROUND | {"numerics.precision": "mixed"},
    ),
    "forces_sphere_mixed": (
        "sphere and gravity",
        NEAR | FORCES | {"numerics.precision": "mixed"},
    ),
    "forces_unequal_f64": (
        "grains of different size",
        FORCES | {"forces": [GAS_OF_MOLECULES, *FORCES["forces"][1:]]},
    ),
}
CONTINUUM = {
    "dust_2d": (DUST, 4),
    "bead_3d": (BEAD, 3),
    "gas_2d": (GAS, 4),
    "bodies_2d": (BODIES, 4),
}
NAMES = [*GRAINS, *CONTINUUM]
STEPS = 60  # of grains

# What two runs in double precision may differ by, of the largest number of each kind: compilers
# fuse a multiplication and an addition here and not there, and a device divides in another way.
# That is rounding (1e-16), which collisions make larger.
DOUBLE = 1e-9
SINGLE = 2.0**-24  # rounding of a number in single precision
# A device divides in single precision with an error of at most two units in the last place
# (div.approx.f32 of the PTX ISA), a CPU with one of at most half a unit.
COARSER = 4.0
OVERLAP = "state contact overlap"
ENERGIES = [f"measured {name}" for name in ("kinetic", "potential", "energy", "losses", "work")]


def scene_of(name, backend):
    """The Scene of a case."""
    if name in GRAINS:
        base, changes = GRAINS[name]
        scene = stored_states.scene(base, backend)
        for key, value in changes.items():
            scene = scene.with_value(key, value)
        return scene
    return from_yaml(CONTINUUM[name][0]).with_value("numerics.backend", backend)


def precision(name):
    """Precision of the contacts of a case."""
    return getattr(scene_of(name, "cpu").numerics, "precision", "f64")


def run(name, backend, steps=None, precision=None):
    """(Engine of a case after its steps, number of searches in them); precision: if not its own."""
    scene = scene_of(name, backend)
    if precision is not None:
        scene = scene.with_value("numerics.precision", precision)
    usual = STEPS if name in GRAINS else CONTINUUM[name][1]
    engine = method.find_method(scene).build(scene, method.make_sample(scene))
    searches_before = engine.search.count
    engine.advance(usual if steps is None else steps)
    return engine, engine.search.count - searches_before


def numbers(engine):
    """Name -> array of all numbers that are compared."""
    values = {f"state {name}": a for name, a in _state(engine).items()}
    measured = vars(engine.measure())
    values |= {f"measured {name}": np.asarray(a) for name, a in measured.items() if _is_number(a)}
    if hasattr(engine, "dust_state"):
        record = engine.series(engine.measure(), None) | engine.sums()
        record = {name: a for name, a in record.items() if _is_number(a)}
        values |= {f"record {name}": np.nan_to_num(a) for name, a in record.items()}
    return {name: a for name, a in values.items() if np.issubdtype(a.dtype, np.number)}


def compute_expected(name):
    """(Numbers of a case in double precision on the CPU, the largest deviation from them that is
    allowed, each by name; searches of the case itself on the CPU).

    In lower precision a device may be COARSER times as far from double precision as the CPU is: so
    much larger are the errors of its divisions. (In `unequal_mixed` the forces and torques of the
    emulated device are 0.9 to 2.3 times as far as those of the CPU, depending on the direction of
    these errors; on an H200 the forces are 2.2 times as far.) If the CPU is closer by chance, a
    rounding in each step is allowed, all of one sign. Energies change into each other and cancel in
    sums: the largest deviation of any of them counts for all. An overlap is the difference of two
    positions, whose deviations add up.
    """
    engine, searches = run(name, "cpu")
    own = numbers(engine)
    if precision(name) == "f64":
        return own, {key: DOUBLE * _largest(a) for key, a in own.items()}, searches
    exact = numbers(run(name, "cpu", precision="f64")[0])
    deviation = {key: _largest(own[key] - a) for key, a in exact.items()}
    deviation |= dict.fromkeys(ENERGIES, max(deviation[key] for key in ENERGIES))
    if OVERLAP in deviation:
        deviation[OVERLAP] = max(deviation[OVERLAP], 2.0 * deviation["state x"])
    least = STEPS * SINGLE
    allowed = {key: COARSER * max(deviation[key], least * _largest(a)) for key, a in exact.items()}
    return exact, allowed, searches


def _largest(a):
    return np.abs(a).max(initial=0.0)


def _is_number(a):
    return isinstance(a, (int, float, np.ndarray, np.number))


def _state(engine):
    if hasattr(engine, "grain_state"):
        x, v, w = engine.motion.measure()
        force, torque = engine.forces()
        arrays = {"x": x, "v": v, "w": w, "force": force, "torque": torque}
        for name, a in engine.ledger.measure_energies().items():
            arrays[f"sum {name}"] = np.asarray(a)
        contacts = engine.contacts.measure_pairs()
        order = np.lexsort((contacts["grain_j"], contacts["grain_i"]))
        arrays |= {f"contact {name}": a[order] for name, a in contacts.items()}
        if engine.layout.curved:
            impulses = engine.kernel_sums.read_loads().surface_impulses()
            arrays |= {"surface": engine.kernel_sums.surface_loads(), "impulse": impulses}
        if engine.layout.stress:
            arrays["flux"] = engine.kernel_sums.read_loads().momentum_flux()
        return arrays
    names = ("x", "v", "density", "pressure", "deviator", "force", "loss", "work")
    state = engine.dust_state
    arrays = {name: state.in_order(state.of_particles(name)) for name in names}
    return arrays | {"rigid": state["rigid"][:, : COLUMN.drags], "clock": state.clock[:4]}


def counts():
    """Counts of the driver since the start (emulator/driver.c)."""
    out = (ctypes.c_long * 6)()
    ctypes.CDLL("libcuda.so.1").emulator_counts(out)
    names = ("launches", "to_device", "from_device", "bytes_to", "bytes_from", "syncs")
    return dict(zip(names, out, strict=True))


def count_calls(name):
    """Counts of the driver for some steps (of grains without a search) and, as "search", for a
    search, as "record" for one of a continuum; also the numbers of steps, searches and changes of a
    controlled load."""
    scene = scene_of(name, "cuda")
    if name in GRAINS:
        scene = scene.with_value("numerics.skin", 0.4)
    engine = method.find_method(scene).build(scene, method.make_sample(scene))
    if name in CONTINUUM:  # launches follow the number of steps of the previous output step
        engine.advance(1)
    first, searches, changes, counts_before = (
        _steps(engine),
        engine.search.count,
        _changes(engine),
        counts(),
    )
    engine.advance(2 * 16 if name in GRAINS else 1)
    counts_taken = _since(counts_before) | {
        "steps": _steps(engine) - first,
        "searches": engine.search.count - searches,
        "changes": _changes(engine) - changes,
    }
    counts_before = counts()
    engine.search.update(*([engine.step] if name in GRAINS else []))
    counts_taken["search"] = _since(counts_before)
    if name in CONTINUUM:
        counts_before = counts()
        engine.recorder.make_series(engine.measure().parts, None)
        engine.sums()
        counts_taken["record"] = _since(counts_before)
    return counts_taken


def _changes(engine):
    servo = engine.environment.servo
    return 0 if servo is None else servo.next_change // servo.every


def _since(counts_before):
    return {key: n - counts_before[key] for key, n in counts().items()}


def _steps(engine):
    return engine.dust_state.substeps if hasattr(engine, "dust_state") else engine.step


def main(path, name):
    """Run a case on the device; write its numbers and counts."""
    engine, searches = run(name, "cuda")
    out = numbers(engine)
    report = {"searches": searches, "counted": count_calls(name)}
    np.savez(path, report=np.array(json.dumps(report)), **out)


if __name__ == "__main__":
    main(*sys.argv[1:])
