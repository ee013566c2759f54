"""The rigid sphere of a scene: its properties, start and motion. Internal units."""

from dataclasses import dataclass

import numpy as np

from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import surface_of
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


def place_sphere(scene, sample, properties, box):
    """RigidSphere of a scene with a sample; None without one.

    own: GrainProperties, or None of equal grains; box: a Box, or None. Raises DustError where the
    sphere overlaps with a grain or a wall, or a cell is too small for it.
    """
    block = scene.sphere
    if block is None:
        return None
    radii = scene.material.radius if properties is None else properties.radius
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
        edges = [fitted if isinstance(e, str) else e for e, fitted in zip(size, edges, strict=True)]
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
    if box is not None and (passed := _find_crossed_walls(box, position, radius, 0.0)):
        raise DustError(
            f"sphere: it reaches through the wall {passed[0]} at the start, and contacts of sphere "
            f"and walls are not computed; leave the wall out (boundary: {{kind: box, omit: "
            f"[{passed[0]}]}}), or give the box a size that holds the sphere"
        )


def _find_crossed_walls(box, position, radius, time):
    """Names of the walls of a Box that a sphere at a place (3,) [um] reaches through."""
    distance = box.normal @ position - box.offsets(time)
    is_crossed = (distance < radius) & (box.present == 1)
    return [name for name, past in zip(WALLS, is_crossed, strict=True) if past]


class MovingSphere:
    """The sphere of a scene in motion: it moves in the kernels, and is read here.

    sphere: RigidSphere. state: GrainState, in whose fields it has the row behind those of the
    grains. environment: GrainEnvironment. kernel_sums: KernelSums. outside: ActingForces, or None.
    radius, mass, inertia: internal units, as all below. speed: at which it is driven now, None
    where it moves by forces.
    """

    def __init__(self, sphere, state, environment, kernel_sums, outside):
        self.sphere, self._state, self._outside = sphere, state, outside
        self._environment, self._kernel_sums = environment, kernel_sums
        self.radius, self.mass = sphere.radius / units.LENGTH, sphere.mass / units.MASS
        self.inertia, self.row = sphere.inertia / units.INERTIA, state.grains + SPHERE
        self.speed = None if sphere.speed is None else sphere.speed / units.SPEED

    # -- start -----------------------------------------------------------------------------------

    def place(self):
        """Put it into the fields, before the first search."""
        sphere, state = self.sphere, self._state
        self._put(x=sphere.position / units.LENGTH, v=sphere.velocity / units.SPEED)
        self._put(w=sphere.spin / units.SPIN)
        free = self.speed is None
        state["sphere_body"] = np.array([1.0 / self.mass, 1.0 / self.inertia]) * free
        if state.layout.polydisperse:
            self._put(radius=self.radius, mass=self.mass)

    def _put(self, **rows):
        for name, values in rows.items():
            self._state.fields[name].from_numpy(np.asarray(values)[None], self.row)

    def set_back(self):
        """Velocity and spin from step 0 to half a step before it, with the current loads."""
        kick, turn = self._half_kicks(present=True)
        _, v, w = self._read_row()
        self._put(v=v - kick, w=w - turn)

    def drive(self, drive):
        """Drive it as a Drive says, if it is driven at all."""
        if self.sphere.speed is None:
            return
        speed = self.sphere.speed if drive.sphere_speed is None else np.array(drive.sphere_speed)
        self.speed = speed / units.SPEED
        self._put(v=self.speed)

    # -- looking ---------------------------------------------------------------------------------

    def load(self):
        """Force [nN] and torque [nN um] of the grains on it now, (3,) each."""
        return self._kernel_sums.sphere_load()

    def impulses(self):
        """Time integrals of both since the start, (6,)."""
        return self._state["sphere_impulse"]

    def contact_kicks(self, load=None):
        """Changes of velocity and of spin in half a step by its contacts alone; 0 if driven."""
        if self.speed is not None:
            return np.zeros(3), np.zeros(3)
        (force, torque), half = load or self.load(), 0.5 * self._environment.dt
        return half * force / self.mass, half * torque / self.inertia

    def _half_kicks(self, load=None, present=False):
        """Change of velocity and of spin in half a step by the current loads.

        present: velocity and spin in memory are those of the position, not half a step back.
        """
        if self.speed is not None:
            return np.zeros(3), np.zeros(3)
        force, torque = load or self.load()
        half, kick, turn = 0.5 * self._environment.dt, force / self.mass, torque / self.inertia
        if self._outside is not None:
            kicks = self.contact_kicks((force, torque))
            linear, angular = self._outside.accelerations(present, kicks)
            kick, turn = kick + linear[-1], turn + angular[-1]
        return half * kick, half * turn

    def measure_motion(self, load=None):
        """Position [um], velocity [um/us] and spin [rad/us] at the time of the positions.

        load: result of `load` now, where there is one already.
        """
        kick, turn = self._half_kicks(load)
        x, v, w = self._read_row()
        return x, v + kick, w + turn

    def _read_row(self):
        """Position, and velocity and spin of half a step before."""
        return (self._state.row(name, self.row) for name in "xvw")

    def speed_in_memory(self):
        """Magnitude of its velocity half a step before [um/us]."""
        return float(np.linalg.norm(self._state.row("v", self.row)))

    def energies(self, load):
        """(kinetic energy, the part of it that is `kick`) [fJ] (see method.Measurement).

        0 of a driven sphere, which is no part of the system. load: result of `load` now.
        """
        if self.speed is not None:
            return 0.0, 0.0
        kick, turn = self._half_kicks(load)
        _, v, w = self._read_row()
        v, w = v + kick, w + turn
        kinetic = self.mass * (v @ v) + self.inertia * (w @ w)
        return 0.5 * kinetic, 0.5 * (self.mass * (kick @ kick) + self.inertia * (turn @ turn))

    def work(self, force, impulse, sums):
        """Work of the drive since the start [fJ], with current force and impulse.

        sums: LedgerSums.
        """
        if self.speed is None:
            return 0.0
        # the force of a step acts half before and half after it
        ends = 0.5 * self._environment.dt * (force - sums.sphere_force)
        return sums.sphere_work - float(self.speed @ (impulse - sums.sphere_impulse + ends))

    def walls_passed(self):
        """Names of the walls that it reaches through."""
        box = self._environment.box
        if box is None:
            return []
        return _find_crossed_walls(
            box, self._state.row("x", self.row), self.radius, self._environment.time
        )
