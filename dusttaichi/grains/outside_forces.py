"""Forces from outside in a simulation of grains: their numbers, energies and work. Internal units.

The laws are in physics.forces, each evaluated by kernels.outside_kick.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi import units
from dusttaichi.grains.kernels.outside_kick import (
    ACCELERATION,
    ENERGIES,
    LAWS,
    START,
    STEP,
    TURNING,
)
from dusttaichi.grains.kernels.store import SPHERE
from dusttaichi.physics.forces.model import ForceModel
from dusttaichi.physics.forces.outside_work import split_work
from dusttaichi.scene.forces import find_law, list_forces


@dataclass(frozen=True, eq=False)
class OutsideForces:
    """Forces of a scene.

    blocks: of the YAML, gravity first where has_gravity. numbers: of all laws, in the order of
    ForceModel. charges [C], (N,): of the grains, in the sample's order. start: time of step 0 [us].
    """

    model: ForceModel
    blocks: tuple
    numbers: np.ndarray
    charges: np.ndarray
    has_gravity: bool
    start: float

    def table(self, dt, grain, sphere):
        """Values of the field `forces`; mass, moment of inertia and radius of grain and sphere."""
        out = np.zeros(LAWS + self.model.width)
        out[START], out[STEP] = self.start, dt
        out[2:LAWS] = *grain, *sphere
        out[LAWS:] = self.numbers
        return out


def choose_model(scene):
    """The ForceModel of a scene."""
    return ForceModel(tuple(find_law(block) for block in list_forces(scene)))


def make_forces(scene, model, sample, properties):
    """OutsideForces of a scene with its ForceModel, a Sample and GrainProperties; None without."""
    blocks = list_forces(scene)
    if not blocks:
        return None
    columns = []
    for block, law in zip(blocks, model.laws, strict=True):
        values = law.numbers(block)
        columns += [np.ravel(values[name]) / _unit(number) for name, number in law.NUMBERS.items()]
    numbers = np.concatenate([np.zeros(0), *columns])
    charges = np.zeros(len(sample))
    if scene.charge is not None:
        mass, radius = (
            np.broadcast_to(a, len(sample)) for a in (properties.mass, properties.radius)
        )
        charges = scene.charge.draw(mass, radius)
    start = sample.info.get("start_time", 0.0) / units.TIME
    return OutsideForces(model, blocks, numbers, charges, scene.gravity is not None, start)


def _unit(number):
    """SI value of the internal unit of a Number: a power of ten, without rounding of products."""
    return float(f"{units.GRAINS(number.unit):.12g}")


# -- in a simulation ------------------------------------------------------------------------------


NO_KICKS = np.zeros(3), np.zeros(3)


class ActingForces:
    """OutsideForces on the particles of a GrainState, as kernels evaluate them now.

    forces: OutsideForces. kernels: those of a Compiled, by name. tables: memory.Table of sums, by
    name. state: GrainState. bodies: GrainBodies. environment: GrainEnvironment. Arguments: kicks,
    `contact_kicks` of the sphere; present, true where velocities and spins in memory are those of
    the positions, not half a step back.
    """

    def __init__(self, forces, kernels, tables, *, state, bodies, environment):
        self.forces, self.model = forces, forces.model
        self._kernels, self._tables, self._state = kernels, tables, state
        self._bodies, self._environment = bodies, environment

    def place(self, sphere):
        """Write the numbers of the forces into fields; sphere: MovingSphere, or None."""
        state, bodies = self._state, self._bodies
        of_sphere = of_grain = (0.0,) * 3
        if sphere is not None:
            of_sphere = sphere.mass, sphere.inertia, sphere.radius
        if bodies.are_equal:
            of_grain = bodies.mass, bodies.inertia, bodies.radius
        if self.model.charged:
            state.fields["charge"].from_numpy(self.forces.charges[state.order])
        state["forces"] = self.forces.table(self._environment.dt, of_grain, of_sphere)

    def _evaluate(self, present, kicks):
        """Numbers of each grain, then of the sphere, by columns of kernels.outside_kick."""
        half, (kick, turn) = 0.5 * self._environment.dt, kicks
        step = self._environment.step
        self._kernels.evaluate_forces(step, half, int(present), kick.tolist(), turn.tolist())
        return self._read_used_rows(self._tables["force_now"])

    def _read_used_rows(self, table):
        """Rows of the grains and of the sphere in a memory.Table of all particles."""
        count = self._bodies.count
        if not self._state.layout.sphere:
            return table.to_numpy(count)
        rows = table.to_numpy(count + SPHERE + 1)
        return np.delete(rows, slice(count, count + SPHERE), axis=0)

    def accelerations(self, present, kicks=NO_KICKS):
        """Accelerations and angular ones, (N, 3) each, with a row more for the sphere."""
        rows = self._evaluate(present, kicks)
        return rows[:, ACCELERATION:TURNING], rows[:, TURNING:ENERGIES]

    def sum_energies(self, kicks=NO_KICKS):
        """Potential energies, then work up to the present by the powers that are summed [fJ].

        The work lacks that of the half step before the start, see `energies_since`.
        """
        totals, model = self._evaluate(False, kicks)[:, ENERGIES:].sum(axis=0), self.model
        if model.powers:
            work = self._read_used_rows(self._state.fields["force_work"]).sum(axis=0)
            totals[len(model.potentials) :] += work
        return totals

    def energies_since(self, start, kicks=NO_KICKS):
        """Work of gravity and of all other forces since the start, losses by channel [fJ].

        start: `sum_energies` then. Returns (work of gravity, of others, dict of losses).
        """
        works, losses = split_work(self.model, self.sum_energies(kicks) - start)
        gravity = works.pop(0) if self.forces.has_gravity else 0.0
        return float(gravity), float(sum(works.values())), losses
