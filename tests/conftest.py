"""Small scenes for the tests of the physics: real Scene and Sample objects, no YAML files."""

import os
import runpy
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from dusttaichi import units
from dusttaichi.grains.build import build
from dusttaichi.physics.contact import registry
from dusttaichi.samples import Sample
from dusttaichi.scene import Scene

# what runs of tests were measured to take says nothing of the user's machine
os.environ["DUST_CACHE"] = tempfile.mkdtemp(prefix="dusttaichi-tests-")

EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
RADIUS = 0.6e-6  # silicate S12 [m]


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
    numerics = {"threads": threads, "time_step": f"{dt:.17g} s" if isinstance(dt, float) else dt}
    data = {
        "name": "test",
        "material": "silicate_s12",
        "interaction": {**interaction, "damping": damping},
        "sample": {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]]},
        "boundary": boundary or {"kind": "open"},
        "stop": {"steps": 1},
        "numerics": {**numerics, **blocks.pop("numerics", {})},
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


def sample_of(x, v=None, w=None):
    x = np.array(x, float)
    zeros = np.zeros_like(x)
    return Sample(
        x,
        zeros if v is None else np.array(v, float) + zeros,
        zeros.copy() if w is None else np.array(w, float) + zeros,
    )


class Probe:
    """A simulation seen in SI and in the order of the sample."""

    def __init__(self, scene, sample):
        self.sim = build(scene, sample)
        self.back = np.argsort(self.sim.order)

    def advance(self, steps):
        self.sim.advance(steps)

    def _grains(self, name):
        return self.sim.fields[name].to_numpy()[: self.sim.grains][self.back]

    @property
    def dt(self):
        return self.sim.dt * units.TIME

    @property
    def x(self):
        return self._grains("x") * units.LENGTH

    def loads(self):
        """Force [N] and torque [N m] on every grain."""
        force, torque = self.sim.loads()
        return force[self.back] * units.FORCE, torque[self.back] * units.TORQUE

    @property
    def v(self):
        """Velocities at the time of the positions [m/s]."""
        kick = 0.5 * self.sim.dt / self.sim.mass
        return self._grains("v") + kick * self.sim.loads()[0][self.back]

    @property
    def w(self):
        """Spins at the time of the positions [rad/s]."""
        turn = 0.5 * self.sim.dt / self.sim.inertia
        return (self._grains("w") + turn * self.sim.loads()[1][self.back]) * units.SPIN

    def energy(self):
        """(kinetic + potential, all losses, work by the walls) [J]."""
        m = self.sim.measure()
        own = m["kinetic_translation"] + m["kinetic_rotation"]
        own += m["potential"].sum() + m["potential_wall"].sum()
        lost = m["loss"].sum() + m["loss_wall"].sum()
        return np.array([own, lost, m["wall_work"]]) * units.ENERGY

    def contacts(self):
        """{(i, j): (n1, n2, phi)} with i < j of the sample; j = -1 - wall, n2 = foot [m] there."""
        sim, layout = self.sim, self.sim.layout
        state = lanes(sim.fields["state"])
        pairs, blocks = sim.fields["counts"].to_numpy()[:2]
        i = sim.fields["pair_i"].to_numpy().reshape(-1)[:pairs]
        j = sim.fields["pair_j"].to_numpy().reshape(-1)[:pairs]
        out = {}
        for c in range(pairs):
            n1, n2 = state[c, layout.pointer :][:3], state[c, layout.second :][:3]
            if n1 @ n1 > 0.5:
                a, b = sim.order[i[c]], sim.order[j[c]]
                phi = state[c, layout.twist] if layout.twist >= 0 else 0.0
                out[(a, b) if a < b else (b, a)] = (n1, n2, phi) if a < b else (n2, n1, phi)
        if sim.box is None:
            return out
        first = len(state) - sim.fields["wall_grain"].to_numpy().size
        grain = sim.fields["wall_grain"].to_numpy().reshape(-1)
        of = sim.fields["wall_of"].to_numpy()
        for c in range(blocks * layout.width):
            n1 = state[first + c, layout.pointer :][:3]
            if n1 @ n1 > 0.5:
                foot = state[first + c, layout.second :][:3] * units.LENGTH
                phi = state[first + c, layout.twist] if layout.twist >= 0 else 0.0
                out[sim.order[grain[c]], -1 - of[c // layout.width]] = (n1, foot, phi)
        return out


def lanes(field):
    """A field of lane vectors (blocks, components) as (contacts, components)."""
    a = field.to_numpy()
    return a.transpose(0, 2, 1).reshape(-1, a.shape[1])


@contextmanager
def law_of_the_docs():
    """The law of docs/examples/rolling_with_speed.py is registered; other tests do not know it.
    Yields the names of that file."""
    known = [(laws, dict(laws)) for laws in (registry.LAWS, registry.BLOCKS)]
    try:
        yield runpy.run_path(str(EXAMPLES / "rolling_with_speed.py"))
    finally:
        for laws, before in known:
            laws.clear()
            laws.update(before)
