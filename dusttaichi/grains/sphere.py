"""The rigid sphere of a scene: what it is, where it starts, how it moves. Internal units."""

from dataclasses import dataclass

import numpy as np

from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import surface_of
from dusttaichi.grains.contacts import touching_pairs
from dusttaichi.grains.forces import accelerations
from dusttaichi.grains.kernels.store import SPHERE
from dusttaichi.physics.contact import constants
from dusttaichi.physics.geometry import AXES, WALLS


@dataclass(frozen=True, eq=False)
class RigidSphere:
    """A rigid sphere at the start.

    Radius [m], mass [kg], moment of inertia [kg m^2], position [m], velocity [m/s] and spin
    [rad/s]; speed [m/s], (3,), at which it is driven, or None.
    """

    radius: float
    mass: float
    inertia: float
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    speed: np.ndarray | None


def placed_sphere(scene, sample, own, box):
    """RigidSphere of a scene with a sample; None without one.

    own: GrainProperties, or None of equal grains; box: a Box, or None. Raises DustError where the
    sphere overlaps with a grain or a wall, or a cell is too small for it.
    """
    block = scene.sphere
    if block is None:
        return None
    radii = scene.material.radius if own is None else own.radius
    mass = constants.sphere_mass(block.radius, surface_of(scene)[0].density)
    position = _place(block, sample.positions, radii)
    _check_free(block, position, sample.positions, radii)
    _check_cell(scene, sample, np.max(radii))
    _check_inside(block, position, box)
    speed = None if block.speed is None else np.array(block.speed)
    velocity, spin = np.array(block.velocity) if speed is None else speed, np.array(block.spin)
    inertia = 0.4 * mass * block.radius**2
    return RigidSphere(block.radius, mass, inertia, position, velocity, spin, speed)


def _place(block, positions, radii):
    """Its centre at the start [m]: as given, or as low as the gap allows over the middle."""
    if block.position is not None:
        return np.array(block.position)
    middle = 0.5 * (positions.min(axis=0) + positions.max(axis=0))[:2]
    x, y = middle + (block.offset or (0.0, 0.0))
    reach = block.radius + radii + block.gap
    height2 = reach**2 - np.sum((positions[:, :2] - [x, y]) ** 2, axis=1)
    under = height2 > 0.0
    if not under.any():
        raise DustError(
            "sphere.offset: there is no grain below the sphere; allowed: an offset within the "
            "sample, or a position in place of gap"
        )
    return np.array([x, y, float(np.max((positions[:, 2] + np.sqrt(height2 * under))[under]))])


def _check_free(block, position, positions, radii):
    gap = np.linalg.norm(positions - position, axis=1) - block.radius - radii
    n = int(np.argmin(gap))
    if gap[n] < -0.01 * np.min(radii):
        raise DustError(
            f"sphere.position: the sphere overlaps by {-gap[n] * 1e6:.4g} µm with grain {n} of the "
            "sample; move it away, or give a gap in place of a position"
        )


def _check_cell(scene, sample, radius):
    """A grain must not touch the sphere across two faces."""
    axes = [AXES.index(axis) for axis in scene.boundary.periodic_axes]
    size = getattr(scene.boundary, "size", "fit")
    edges = np.ptp(sample.positions, axis=0) + 2.0 * radius
    if not isinstance(size, str):
        edges = [edge if isinstance(e, str) else e for e, edge in zip(size, edges, strict=True)]
    need = 2.2 * (scene.sphere.radius + radius)
    short = [n for n in axes if edges[n] < need]
    if short:
        raise DustError(
            f"sphere.radius: the periodic edge along {AXES[short[0]]} is "
            f"{edges[short[0]] * 1e6:.4g} µm, and a grain would touch the sphere across both "
            f"faces; allowed: edges of {need * 1e6:.4g} µm and more, or a smaller sphere"
        )


def _check_inside(block, position, box):
    """The sphere must not overlap with a wall of a Box, or of None."""
    position, radius = position / units.LENGTH, block.radius / units.LENGTH
    if box is not None and (passed := _passed(box, position, radius, 0.0)):
        raise DustError(
            f"sphere: it reaches through the wall {passed[0]} at the start, and contacts of sphere "
            f"and walls are not computed; leave the wall out (boundary: {{kind: box, omit: "
            f"[{passed[0]}]}}), or give the box a size that holds the sphere"
        )


def _passed(box, position, radius, time):
    """Names of the walls of a Box that a sphere at a place (3,) [um] reaches through."""
    distance = box.normal @ position - box.offsets(time)
    is_inside = (distance < radius) & (box.present == 1)
    return [name for name, past in zip(WALLS, is_inside, strict=True) if past]


class MovingSphere:
    """The sphere of a Simulation `sim`: it moves in the kernels, and is read here.

    own: the RigidSphere. radius, mass, inertia: internal units, as all below. speed: at which it is
    driven now, None where it moves by forces. contact: numbers of the contact that reaches
    farthest.
    """

    def __init__(self, sim, sphere, contact):
        self.sim, self.own, self.contact = sim, sphere, contact
        self.radius, self.mass = sphere.radius / units.LENGTH, sphere.mass / units.MASS
        self.inertia, self.row = sphere.inertia / units.INERTIA, sim.grains + SPHERE
        self.speed = None if sphere.speed is None else sphere.speed / units.SPEED

    # -- start -----------------------------------------------------------------------------------

    def place(self):
        """Into the fields, before the first search."""
        own, state = self.own, self.sim.state
        self._put(x=own.position / units.LENGTH, v=own.velocity / units.SPEED)
        self._put(w=own.spin / units.SPIN)
        free = self.speed is None
        state["sphere_body"] = np.array([1.0 / self.mass, 1.0 / self.inertia]) * free
        if self.sim.polydisperse is not None:
            self._put(radius=self.radius, mass=self.mass)

    def _put(self, **rows):
        for name, values in rows.items():
            self.sim.fields[name].from_numpy(np.asarray(values)[None], self.row)

    def set_back(self):
        """Velocity and spin from step 0 to half a step before it, with the current loads."""
        kick, turn = self._half_kicks(present=True)
        state = self.sim.state
        self._put(v=state.row("v", self.row) - kick, w=state.row("w", self.row) - turn)

    def drive(self, drive):
        """Drive it as a Drive says, if it is driven at all."""
        if self.own.speed is None:
            return
        speed = self.own.speed if drive.sphere_speed is None else np.array(drive.sphere_speed)
        self.speed = speed / units.SPEED
        self._put(v=self.speed)

    # -- looking ---------------------------------------------------------------------------------

    def load(self):
        """Force [nN] and torque [nN um] of the grains on it now, (3,) each."""
        sim = self.sim
        sim.kernels.measure_sphere(sim.step, sim.dt, sim.walls_argument)
        load = sim.sums["sphere_load"].to_numpy()
        return load[:3], load[3:]

    def contacts(self):
        """Grains that touch the sphere now, a dict of arrays.

        grain (C,), by the sample's numbers; overlap [um]; force [nN] and torque [nN um] on the
        grain (C, 3), the parts of these (physics.contact.parts), and loss [fJ] by channel where it
        is followed.
        """
        sim = self.sim
        rows, grain, sphere = sim.state.on_sphere()
        number, second = sim.order[grain], np.full(len(grain), sphere)
        radii = sim.grain_radii[number], np.full(len(grain), self.radius)
        on, _, _, columns = touching_pairs(sim, rows, (grain, second), radii)
        return columns | {"grain": number[on], "torque": columns["torque_i"]}

    def impulses(self):
        """Time integrals of both since the start, (6,)."""
        return self.sim.state["sphere_impulse"]

    def _half_kicks(self, load=None, present=False):
        """Change of velocity and of spin in half a step by the current loads.

        present: velocity and spin in memory are those of the position, not half a step back.
        """
        if self.speed is not None:
            return np.zeros(3), np.zeros(3)
        sim, (force, torque) = self.sim, load or self.load()
        half, kick, turn = 0.5 * sim.dt, force / self.mass, torque / self.inertia
        if sim.outside is not None:
            linear, angular = accelerations(sim, present)
            kick, turn = kick + linear[-1], turn + angular[-1]
        return half * kick, half * turn

    def now(self, load=None):
        """Position [um], velocity [um/us] and spin [rad/us] at the time of the positions.

        load: result of `load` now, where it is requested.
        """
        kick, turn = self._half_kicks(load)
        x, v, w = self._row()
        return x, v + kick, w + turn

    def _row(self):
        """Position, and velocity and spin of half a step before."""
        return (self.sim.state.row(name, self.row) for name in "xvw")

    def energies(self, load):
        """(kinetic energy, the part of it that is `kick`) [fJ] (see method.Measurement).

        0 of a driven sphere, which is no part of the system. load: result of `load` now.
        """
        if self.speed is not None:
            return 0.0, 0.0
        kick, turn = self._half_kicks(load)
        _, v, w = self._row()
        v, w = v + kick, w + turn
        kinetic = self.mass * (v @ v) + self.inertia * (w @ w)
        return 0.5 * kinetic, 0.5 * (self.mass * (kick @ kick) + self.inertia * (turn @ turn))

    def work(self, force, impulse):
        """Work of what drives it since the start [fJ], with current force and impulse."""
        sums = self.sim.ledger_sums
        if self.speed is None:
            return 0.0
        # the force of a step acts half before and half after it
        taken = impulse - sums.sphere_impulse + 0.5 * self.sim.dt * (force - sums.sphere_force)
        return sums.sphere_work - float(self.speed @ taken)

    def walls_passed(self):
        """Names of the walls that it reaches through."""
        sim = self.sim
        if sim.box is None:
            return []
        return _passed(sim.box, sim.state.row("x", self.row), self.radius, sim.time)
