"""Scenes and samples for the tests: as text, as objects, and built as a simulation in SI."""

import runpy
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import reference as ref

from dusttaichi import units
from dusttaichi.compute.processor import kernel_folder
from dusttaichi.grains.build import build
from dusttaichi.physics.contact import effect_registry
from dusttaichi.physics.registry import copy_added, restore_added
from dusttaichi.samples import Sample
from dusttaichi.scene import Scene, extensions, from_yaml

ROOT = Path(__file__).parents[1]
CONFIGS, EXAMPLES = ROOT / "configs", ROOT / "docs/examples"
KERNELS = str(kernel_folder())  # for tests that have an XDG_CACHE_HOME of their own
RADIUS = 0.6e-6  # silicate S12 [m]
ICE = dict(r=0.1e-6, rho=1000.0, gamma=0.1, E=7e9, nu=0.25, xi_crit=0.8e-9)  # T19 Table 1
KINDS = (ref.SILICATE, ICE)

# A scene as text, and ways to change one of its blocks.

BASE = """\
name: cake
material: silicate_s12
interaction: {rolling: on}
sample: {kind: rbd, grains: 100}
boundary: {kind: box, wall_speed: 1 cm/s}
stop: {filling_factor: 0.55}
numerics: {time_step: auto}
output: {snapshots: off}
"""
LINE = {text.split(":")[0]: number for number, text in enumerate(BASE.splitlines(), start=1)}


def edit_base(block: str, text: str) -> str:
    """BASE with the line of one block replaced."""
    return "".join(
        f"{text}\n" if line.startswith(f"{block}:") else line
        for line in BASE.splitlines(keepends=True)
    )


def text_of(**blocks: str) -> str:
    """BASE with these blocks in place of its own, and further ones."""
    lines = dict(line.split(": ", 1) for line in BASE.splitlines())
    return "".join(f"{block}: {value}\n" for block, value in (lines | blocks).items())


def scene(**blocks: str) -> Scene:
    return from_yaml(text_of(**blocks))


SPRING_TEXT = """
name: tiny
method: spring
extensions: [spring.py]
boundary: {kind: open}
stop: {steps: 10}
numerics: {time_step: 10 ns, threads: 1}
"""
SPRING_ENDING = """

import time
from dataclasses import replace

from dusttaichi import method


class Slow(Spring):
    def advance(self, steps):
        super().advance(steps)
        time.sleep({seconds} * steps)


method.register(replace(METHOD, build=Slow))
"""
PAIR_TEXT = """
name: pair
material: silicate_s12
interaction: {damping: viscoelastic}
sample: {kind: pair, gap: 1 nm, speed: 0.3 m/s}
boundary: {kind: open}
stop: {time: 40 ns}
output: {series: {steps: 10}}
"""

OPEN = {"boundary": "{kind: open}", "stop": "{steps: 10}"}
POSITIONS = "positions: [[0 m, 0 m, 0 m], [1.2 um, 0 m, 0 m]]"

FULL = {
    "material": "{base: ice_t19, name: my ice, radius: 0.123456789012345678 um}",
    "interaction": "{rolling: off, twisting: {modifier: 0.1}, damping: none, "
    "shear_modulus: printed}",
    "sample": f"{{kind: explicit, {POSITIONS}, velocities: [[1 m/s, 0 m/s, 0 m/s], [0 m/s, 0 m/s, "
    "-1e-17 m/s]]}",
    "boundary": "{kind: box, size: [40 um, 40 um, 3.3333333333333335 um], omit: [bottom]}",
    "stop": "{pressure: 1 kPa, time: 0.1 ms, steps: 1e6}",
    "numerics": "{time_step: 0.3 ns, precision: f64, backend: cuda, threads: 2, skin: 0.1}",
    "output": "{directory: elsewhere, series: {steps: 7}, profiles: {time: 1 us}, snapshots: off, "
    "contacts: false, window: 100, checkpoint: 5 s}",
}

# Scenes and samples as objects.


def make_scene(
    *,
    damping="none",
    effects=("rolling", "sliding", "twisting"),
    modifiers=None,
    boundary=None,
    dt="0.1 ns",
    threads=1,
    **blocks,
):
    """A Scene of silicate S12; dt as in the YAML or in seconds; only the given effects are on."""
    modifiers = modifiers or {}
    interaction = {
        name: {"modifier": modifiers.get(name, 1.0)} if name in effects else "off"
        for name in ("rolling", "sliding", "twisting")
    }
    # rounding is that of double precision wherever a test does not say otherwise
    numerics = {"threads": threads, "precision": "f64"} | blocks.pop("numerics", {})
    numerics = {"newton_steps": 2 if numerics["precision"] == "f64" else 1} | numerics
    numerics["time_step"] = f"{dt:.17g} s" if isinstance(dt, float) else dt
    data = {
        "name": "test",
        "material": "silicate_s12",
        "interaction": {**interaction, "damping": damping},
        "sample": {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]]},
        "boundary": boundary or {"kind": "open"},
        "stop": {"steps": 1},
        "numerics": numerics,
        **blocks,
    }
    return Scene.from_dict(data)


def box(*walls, size="fit", wall_speed=0.0, side_walls=1.0):
    """A box boundary with the named walls only; size in m."""
    names = ("x_min", "x_max", "y_min", "y_max", "bottom", "top")
    return {
        "kind": "box",
        "omit": [name for name in names if name not in walls] if walls else [],
        "size": size if isinstance(size, str) else [f"{edge:.17g} m" for edge in size],
        "wall_speed": f"{wall_speed:.17g} m/s",
        "side_walls": side_walls,
    }


# one wall that nothing comes near: the make of scenes in a box
FAR = box("top", size=(1e-2, 1e-2, 1e-2))


def two_materials(**keys):
    """make_scene with a second material, number 1: the ice of T19."""
    return make_scene(materials={"ice": "ice_t19"}, **keys)


def sample_of(x, v=None, w=None):
    x = np.array(x, float)
    zeros = np.zeros_like(x)
    return Sample(
        x,
        zeros if v is None else np.array(v, float) + zeros,
        zeros.copy() if w is None else np.array(w, float) + zeros,
    )


def grain(radius, material):
    return {**KINDS[material], "r": radius}


def masses_of(radii, materials):
    return 4 / 3 * np.pi * np.array(radii) ** 3 * np.array([KINDS[k]["rho"] for k in materials])


def polydisperse(x, radii, materials=None, v=0.0, w=0.0):
    x = np.array(x, float)
    materials = np.zeros(len(x), np.int32) if materials is None else np.array(materials, np.int32)
    v, w = (np.array(a, float) + np.zeros_like(x) for a in (v, w))
    return Sample(x, v, w, radii=np.array(radii, float), materials=materials)


@contextmanager
def law_of_the_docs():
    """The law of docs/examples/rolling_with_speed.py is registered; other tests do not know it.
    Yields the names of that file."""
    with forget_registered():
        yield runpy.run_path(str(EXAMPLES / "rolling_with_speed.py"))


@contextmanager
def forget_registered():
    """What is registered within is forgotten."""
    tables = [(laws, dict(laws.added)) for laws in (effect_registry.LAWS, effect_registry.BLOCKS)]
    try:
        yield
    finally:
        for laws, entries in tables:
            laws.restore(entries)


@contextmanager
def extensions_forgotten():
    """What files of a scene's `extensions` register within, and which they are, is forgotten; what
    they have registered before is unknown within."""
    added_before, tables = copy_added(), copy_added()
    for word, name in extensions._owners:
        tables[word].pop(name, None)
    restore_added(tables)
    try:
        with pytest.MonkeyPatch.context() as patch:
            for name in ("_imported", "_owners"):
                patch.setattr(extensions, name, {})
            yield
    finally:
        restore_added(added_before)


@contextmanager
def import_bundled(name):
    """Module of a bundled extension, such as "reissl2024/spin_up.py", which is forgotten again."""
    with extensions_forgotten():
        yield extensions.import_extension(name)


def write_spring(folder, seconds=0.0):
    """Write the method of running/spring.py, which compiles nothing, as a user's file spring.py.

    seconds: by which each step is slower.
    """
    text = (ROOT / "tests/running/spring.py").read_text()
    (folder / "spring.py").write_text(text + SPRING_ENDING.format(seconds=seconds))


# Built.


def balance(m):
    """(kinetic + potential, all losses, all work) of a measurement of grains [fJ]: the ledger."""
    kinetic = m["kinetic_translation"] + m["kinetic_rotation"]
    kinetic += m["potential"].sum() + m["potential_wall"].sum()
    work = m["wall_work"] + m["face_work"] + m["push_work"]
    return np.array([kinetic, m["loss"].sum() + m["loss_wall"].sum(), work])


def residual(start, end):
    """By how much the ledger is open [fJ] after a change from one measurement to another."""
    stored, lost, work = balance(end) - balance(start)
    return stored + lost - work


class Probe:
    """A simulation seen in SI and in the order of the sample."""

    def __init__(self, scene, sample):
        self.sim, self.radii, self.kinds = build(scene, sample), sample.radii, sample.materials
        self.back = np.argsort(self.sim.grain_state.order)

    def advance(self, steps):
        self.sim.stepper.advance(steps)

    def _grains(self, name):
        return self.sim.fields[name].to_numpy()[: self.sim.bodies.count][self.back]

    @property
    def dt(self):
        return self.sim.dt * units.TIME

    @property
    def x(self):
        return self._grains("x") * units.LENGTH

    def loads(self):
        """Force [N] and torque [N m] on every grain."""
        force, torque = self.sim.motion.sum_loads()
        return force[self.back] * units.FORCE, torque[self.back] * units.TORQUE

    @property
    def v(self):
        """Velocities at the time of the positions [m/s]."""
        return self._extrapolate("v", 0, self.sim.bodies.mass)

    @property
    def w(self):
        """Spins at the time of the positions [rad/s]."""
        return self._extrapolate("w", 1, self.sim.bodies.inertia) * units.SPIN

    def _extrapolate(self, name, load, inertia):
        """Velocities half a step later than those of the field, in internal units."""
        later = 0.5 * self.sim.dt / inertia * self.sim.motion.sum_loads()[load]
        return (self.sim.fields[name].to_numpy()[: self.sim.bodies.count] + later)[self.back]

    def momenta(self):
        """Momentum, angular momentum about the origin, and the scale of each."""
        m, inertia = (
            np.broadcast_to(a, (self.sim.bodies.count, 1))[self.back] * unit
            for a, unit in (
                (self.sim.bodies.mass, units.MASS),
                (self.sim.bodies.inertia, units.INERTIA),
            )
        )
        linear = m * self.v
        turning = np.cross(self.x, linear) + inertia * self.w
        return linear.sum(0), turning.sum(0), np.abs(linear).sum(), np.abs(turning).sum()

    def assert_momenta_stay(self, calls, steps):
        """Advance so often by that many steps: each kick rounds by 1e-16 of itself."""
        linear, turning, linear_scale, turning_scale = self.momenta()
        for _ in range(calls):
            self.advance(steps)
            momenta_now = self.momenta()
            assert np.abs(momenta_now[0] - linear).max() < 1e-13 * linear_scale
            assert np.abs(momenta_now[1] - turning).max() < 1e-12 * turning_scale

    def energy(self):
        """(kinetic + potential, all losses, all work) [J]."""
        return balance(self.sim.ledger.measure_energies()) * units.ENERGY

    def contacts(self):
        """{(i, j): (n1, n2, phi)} with i < j of the sample; j = -1 - wall, n2 = foot [m] there."""
        out, pairs = {}, self.sim.contacts.measure_pairs()
        columns = ("grain_i", "grain_j", "pointer_i", "pointer_j", "twist")
        for a, b, n1, n2, phi in zip(*(pairs[name] for name in columns), strict=True):
            out[(a, b) if a < b else (b, a)] = (n1, n2, phi) if a < b else (n2, n1, phi)
        if self.sim.domain.box is not None:
            walls = self.sim.contacts.measure_walls()
            columns = ("grain", "wall", "pointer", "foot", "twist")
            for a, wall, n1, foot, phi in zip(*(walls[name] for name in columns), strict=True):
                out[a, -1 - wall] = (n1, foot * units.LENGTH, phi)
        return out

    def pair(self, i, j, **keys):
        """Numbers of the contact of two grains that are not alike; keys: of ref.mix_constants."""
        return ref.mix_constants(*(grain(self.radii[n], self.kinds[n]) for n in (i, j)), **keys)

    def wall(self, i, **keys):
        """Numbers of the contact of such a grain with a wall."""
        return ref.mix_constants(grain(self.radii[i], self.kinds[i]), KINDS[0], wall=True, **keys)
