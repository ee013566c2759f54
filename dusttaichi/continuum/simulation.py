"""A built continuum in motion. SI inside.

It advances by output steps, searches for neighbours when due, and returns its state.
"""

from dataclasses import asdict

import numpy as np

from dusttaichi.compute.loops import DONE, STUCK
from dusttaichi.continuum.kernels.motion import MOST_STEPS
from dusttaichi.continuum.kernels.store import (
    COLUMN,
    DT,
    FACES,
    FREE,
    OLD,
    SUBSTEPS,
    WHOLE,
    declare,
)
from dusttaichi.continuum.outside import evaluate
from dusttaichi.continuum.physics.kernels import material_type
from dusttaichi.errors import GuardStop
from dusttaichi.method import SimpleSimulation, moment


class Simulation:
    """State and kernels of one scene. `step` counts output steps of length `output_step` [s].

    compiled: Compiled. n: particles; dimension: 2 or 3; axes: those of the kernels among x, y, z.
    numbers: arguments of the kernels (kernels.run_arguments) that are constant. materials:
    MaterialNumbers of all materials; material: of the first. tables, lists: memory.Table by name.
    bodies: rigid bodies.
    """

    units = SimpleSimulation.units  # SI

    def __init__(self, compiled, tables, n, *, numbers, materials, output_step, threads, bodies):
        self.kernels, self.layout = compiled.kernels, compiled.layout
        self.dimension = self.layout.dimension
        self.axes = [0, 2] if self.dimension == 2 else [0, 1, 2]
        self.n, self.numbers = n, numbers
        self.materials, self.material = materials, materials.taken(0)
        self.material_numbers = material_type(self.layout.laws)(**asdict(self.material))
        self.output_step, self.threads, self.bodies = output_step, threads, bodies
        self.tables, self.lists = tables
        self.names = [variable.name for variable in declare(self.layout)]
        self.step, self.search = 0, None
        self._passed = {}, None  # numbers that were passed to the kernels last, and their struct

    @property
    def time(self):
        """Simulated time [s]."""
        return self.step * self.output_step

    # -- memory ----------------------------------------------------------------------------------

    def of_particles(self, name):
        """A copy of a variable of all particles, in internal order."""
        return self.tables[name].to_numpy(self.n)

    def material_of(self, which=slice(None)):
        """MaterialNumbers of particles in internal order, of one where there is one alone."""
        if not self.layout.materials:
            return self.material
        return self.materials.taken(self.of_particles("material")[which])

    def put(self, name, values):
        """Write a variable of all particles."""
        self.tables[name].from_numpy(values)

    def reorder(self, order):
        """Put the particles in another order."""
        for name in self.names:
            self.put(name, self.of_particles(name)[order])

    def in_order(self, values):
        """Rows of all particles in the order of the sample, of those in internal order."""
        out = np.empty_like(values)
        out[self.of_particles("number")] = values
        return out

    def rigid(self, name):
        """A Column of the faces and rigid bodies by its name, (FACES + bodies, width)."""
        return self.tables["rigid"].to_numpy(FACES + self.bodies, COLUMN[name])

    @property
    def clock(self):
        return self.tables["clock"].to_numpy()

    @property
    def substeps(self):
        """Time steps so far."""
        return int(self.clock[SUBSTEPS])

    # -- steps -----------------------------------------------------------------------------------

    def advance(self, output_steps):
        """Make that many output steps, searching for neighbours whenever it is due."""
        end, pending = self.step + output_steps, 0
        while self.step < end:
            self.step += self._call(end - self.step, pending)
            pending = 0
            if self.step < end:
                self.search.update()
                pending = 1

    def step_numbers(self):
        """The present StepNumbers: the last ones where nothing has changed.

        Taichi takes a millisecond to make a struct, and searches may be as frequent as steps.
        """
        numbers = self.numbers | {
            "count": self.n,
            "bodies": self.bodies,
            "output_step": self.output_step,
            "way2": self.search.way2,
        }
        if numbers != self._passed[0]:
            self._passed = numbers, self.kernels.StepNumbers(**numbers)
        return self._passed[1]

    def _call(self, output_steps, pending):
        numbers = self.step_numbers()
        outcome = self.kernels.advance(
            output_steps, self.step, pending, self.threads, numbers, self.material_numbers
        )
        if outcome is None:  # workers write it to `sync`
            outcome = self.lists["sync"].to_numpy()[[DONE, STUCK]]
        steps_done, stuck = outcome
        if stuck:
            raise GuardStop(
                f"{moment(self)} an output step would take more than {MOST_STEPS:.0e} time steps "
                "of the method: particles move or are strained too fast. Try a lower speed, "
                "or a shorter numerics.time_step if it is a long one."
            )
        return int(steps_done)

    def load_once(self):
        """Compute stresses and forces at the present positions, without moving anything."""
        clock = self.clock
        self.tables["clock"].from_numpy([0.0], DT)
        self._call(1, 1)
        self.tables["clock"].from_numpy(clock)

    def move_faces(self, speeds):
        """Velocities of the six faces from now on [m/s], (6, 3)."""
        rows = self.tables["rigid"].to_numpy(FACES)
        rows[:, COLUMN["speed"]] = speeds
        self.tables["rigid"].from_numpy(rows)

    # -- the present state -----------------------------------------------------------------------

    def raised(self, values):
        """Vectors of the kernels (n, dimension) as (n, 3)."""
        out = np.zeros((len(values), 3))
        out[:, self.axes] = values
        return out

    def velocities(self):
        """Present velocities (n, 3) in internal order: half a step after those in memory."""
        v, group = self.of_particles("v"), self.of_particles("group")
        half = 0.5 * self.clock[OLD]
        kick = half / self.of_particles("mass")[:, None] * self.of_particles("force")
        if self.layout.forces:
            kick += half * evaluate(self)[0][:, self.axes]
        out = self.raised(np.where((group == FREE)[:, None], v + kick, v))
        speed, spin = self.body_speeds()
        on = group >= FACES
        if on.any():
            rows = group[on]
            arm = self.raised(self.of_particles("x")[on]) - self.rigid("centre")[rows]
            out[on] = speed[rows] + np.cross(spin[rows], arm)
        return out

    def body_speeds(self):
        """Velocities and spins of faces and rigid bodies now, (FACES + bodies, 3) both."""
        half, mass = 0.5 * self.clock[OLD], self.rigid("mass")
        mass = np.where(mass > 0.0, mass, np.inf)
        speed = self.rigid("speed") + half / mass * self.rigid("force")
        spin = np.zeros_like(speed)
        for b, momentum in enumerate(self.angular_momenta()):
            if b >= FACES:
                inverse = self.rigid("inertia")[b].reshape(3, 3)
                R = _rotation(self.rigid("turn")[b])
                spin[b] = R @ inverse @ R.T @ momentum
        return speed, spin

    def angular_momenta(self):
        """About their own centres, now, (FACES + bodies, 3)."""
        return self.rigid("momentum") + 0.5 * self.clock[OLD] * self.rigid("torque")

    def impulses(self):
        """Time integrals of the forces on faces and rigid bodies since the start [N s]."""
        return self.rigid("impulse") + 0.5 * self.clock[OLD] * self.rigid("force")

    # -- checkpoint ------------------------------------------------------------------------------

    def arrays(self):
        """All state, for a checkpoint."""
        arrays = {name: self.tables[name].to_numpy() for name in WHOLE}
        return {name: self.of_particles(name) for name in self.names} | arrays

    def restore(self, arrays, step):
        """Go back to a checkpoint of the same scene."""
        for name in (*self.names, *WHOLE):
            self.tables[name].from_numpy(arrays[name])
        self.step = step
        self.search.again()


def body_row(body, mirrors=()):
    """The row of `rigid` of a body at the start (samples.continuum.particles.Body) [SI].

    mirrors: axes of the mirrors through its centre. Each leaves half of its mass, no force across
    the mirror, and no torque but the one about its normal.
    """
    out, mirror_fraction = np.zeros(COLUMN.count), 0.5 ** len(mirrors)
    forces, torques = np.ones(3), np.ones(3)
    for axis in mirrors:
        forces[axis] = 0.0
        torques *= np.arange(3) == axis
    values = {
        "centre": body.centre,
        "speed": body.velocity,
        "turn": [1.0, 0.0, 0.0, 0.0],
        "spin": body.spin,
        "momentum": mirror_fraction * body.inertia @ body.spin,
        "mass": mirror_fraction * body.mass,
        "inertia": np.linalg.pinv(mirror_fraction * body.inertia).ravel(),
        "radius": body.radius,
        "half_height": body.half_height,
        "freedom": [*forces, *torques],
    }
    for name, value in values.items():
        out[COLUMN[name]] = value
    return out


def _rotation(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
