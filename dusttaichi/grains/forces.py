"""Forces from outside in a simulation of grains: their numbers, energies and work. Internal units.

The laws are in physics.forces, each evaluated by kernels.forces.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from dusttaichi import units
from dusttaichi.grains.kernels.forces import ACCELERATION, ENERGIES, LAWS, START, STEP, TURNING
from dusttaichi.grains.kernels.store import SPHERE
from dusttaichi.physics.forces.ledger import split_work
from dusttaichi.physics.forces.model import ForceModel
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


def shortest_timescale(scene, radius, mass):
    """Shortest time [s] in which a force of the scene changes a motion; infinite without one.

    radius [m], mass [kg]: of the particles, arrays.
    """
    charge = np.zeros(len(mass)) if scene.charge is None else scene.charge.bound(mass, radius)
    particles = SimpleNamespace(radius=radius, mass=mass, charge=charge)
    scales = [
        law.timescale(block, particles)
        for block, law in ((block, find_law(block)) for block in list_forces(scene))
        if hasattr(law, "timescale")
    ]
    return min(scales, default=np.inf)


# -- in a simulation ------------------------------------------------------------------------------


def put_forces(sim):
    """Write the numbers of the forces of a Simulation into its fields."""
    sphere = (0.0,) * 3
    if sim.sphere is not None:
        sphere = sim.sphere.mass, sim.sphere.inertia, sim.sphere.radius
    grain = (0.0,) * 3 if sim.polydisperse is not None else (sim.mass, sim.inertia, sim.radius)
    if sim.outside.model.charged:
        sim.fields["charge"].from_numpy(sim.outside.charges[sim.order])
    sim.state["forces"] = sim.outside.table(sim.dt, grain, sphere)


def evaluate(sim, present=False):
    """Numbers of each grain, and behind them of the sphere, by the columns of kernels.forces.

    present: velocities and spins in memory are those of the positions, not half a step back.
    """
    kick = turn = np.zeros(3)
    half, sphere = 0.5 * sim.dt, sim.sphere
    if sphere is not None and sphere.speed is None:
        force, torque = sphere.load()
        kick, turn = half * force / sphere.mass, half * torque / sphere.inertia
    sim.kernels.evaluate_forces(sim.step, half, int(present), kick.tolist(), turn.tolist())
    return _used_rows(sim, sim.sums["force_now"])


def _used_rows(sim, table):
    """Rows of the grains and of the sphere in a memory.Table of all particles."""
    if sim.sphere is None:
        return table.to_numpy(sim.grains)
    rows = table.to_numpy(sim.grains + SPHERE + 1)
    return np.delete(rows, slice(sim.grains, sim.grains + SPHERE), axis=0)


def accelerations(sim, present=False):
    """Accelerations and angular ones, (N, 3) each, with a row more for the sphere."""
    rows = evaluate(sim, present)
    return rows[:, ACCELERATION:TURNING], rows[:, TURNING:ENERGIES]


def sum_energies(sim):
    """Potential energies, then work up to the present by the powers that are summed [fJ].

    The work lacks that of the half step before the start, see `energies_since`.
    """
    totals, model = evaluate(sim)[:, ENERGIES:].sum(axis=0), sim.outside.model
    if model.powers:
        totals[len(model.potentials) :] += _used_rows(sim, sim.fields["force_work"]).sum(axis=0)
    return totals


def energies_since(sim, start):
    """Work of gravity and of all other forces since the start, losses by channel [fJ].

    start: `sum_energies` then. Returns (work of gravity, of others, dict of losses).
    """
    works, losses = split_work(sim.outside.model, sum_energies(sim) - start)
    gravity = works.pop(0) if sim.outside.has_gravity else 0.0
    return float(gravity), float(sum(works.values())), losses
