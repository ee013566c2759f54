"""Forces from outside on a continuum: numbers, charges, energies, the longest step. SI."""

from types import SimpleNamespace

import numpy as np

from dusttaichi.continuum.kernels.outside import ENERGIES
from dusttaichi.scene.forces import find_law


def put_forces(sim, particles, scene):
    """Write numbers of the forces of a scene, and charges of its Particles, for a Simulation."""
    if not scene.forces:
        return
    numbers = [np.zeros(0)]
    for block in scene.forces:
        law = find_law(block)
        values = law.numbers(block)
        numbers += [np.ravel(values[name]) for name in law.NUMBERS]
    numbers = np.concatenate(numbers)
    if len(numbers):
        sim.lists["forces"].from_numpy(numbers)
    if "charge" in sim.tables:
        sim.put("charge", scene.charge.draw(particles.mass, particles.mass))


def shortest_timescale(scene, particles):
    """Shortest time [s] in which a force of a scene changes a motion; infinite without one."""
    mass = particles.mass
    charge = np.zeros(len(mass)) if scene.charge is None else scene.charge.bound(mass, mass)
    radius = np.cbrt(0.75 / np.pi * mass / particles.density)
    found = SimpleNamespace(mass=mass, radius=radius, charge=charge)
    laws = [(block, find_law(block)) for block in scene.forces]
    scales = [law.timescale(block, found) for block, law in laws if hasattr(law, "timescale")]
    return min(scales, default=np.inf)


def evaluate(sim):
    """Accelerations (n, 3) now, and totals of potential energies and of the work so far."""
    model = sim.layout.forces
    if not model:
        return None, np.zeros(0)
    sim.kernels.evaluate_forces(sim.step_numbers())
    rows = sim.lists["force_now"].to_numpy(sim.n)
    totals = rows[:, ENERGIES:].sum(axis=0)
    if model.powers:
        totals[len(model.potentials) :] += sim.of_particles("force_work").sum(axis=0)
    return rows[:, :ENERGIES], totals
