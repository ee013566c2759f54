"""Forces from outside on a continuum: numbers, charges, energies, the longest step. SI."""

import numpy as np

from dusttaichi.continuum.kernels.outside import ENERGIES
from dusttaichi.physics.forces.outside_work import split_work
from dusttaichi.scene.forces import find_law, find_shortest_timescale


def shortest_timescale(scene, particles):
    """Shortest time [s] in which a force of a scene changes a motion; infinite without one."""
    mass = particles.mass
    charge = np.zeros(len(mass)) if scene.charge is None else scene.charge.bound(mass, mass)
    radius = np.cbrt(0.75 / np.pi * mass / particles.density)
    return find_shortest_timescale(scene.forces, radius=radius, mass=mass, charge=charge)


class DustForces:
    """Forces from outside on the particles of a DustState, as kernels evaluate them now.

    kernels: those of a Compiled. scratch: memory.Table of its lists, by name. state: DustState.
    numbers: KernelNumbers.
    """

    def __init__(self, kernels, scratch, state, numbers):
        self._kernels, self._scratch, self._state = kernels, scratch, state
        self._numbers, self.model = numbers, state.layout.forces

    def place(self, scene, particles):
        """Write numbers of the forces of a scene, and charges of its Particles, into fields."""
        numbers = [np.zeros(0)]
        for block in scene.forces:
            law = find_law(block)
            values = law.numbers(block)
            numbers += [np.ravel(values[name]) for name in law.NUMBERS]
        numbers = np.concatenate(numbers)
        if len(numbers):
            self._scratch["forces"].from_numpy(numbers)
        if "charge" in self._state:
            self._state["charge"] = scene.charge.draw(particles.mass, particles.mass)

    def _evaluate(self):
        """Numbers of each particle, by columns of kernels.outside."""
        self._kernels.evaluate_forces(self._numbers.of_step)
        return self._scratch["force_now"].to_numpy(self._state.count)

    def accelerations(self):
        """Accelerations now [m/s^2], (n, 3)."""
        return self._evaluate()[:, :ENERGIES]

    def sum_energies(self):
        """Potential energies, then work up to the present by the powers that are summed [J]."""
        totals, model = self._evaluate()[:, ENERGIES:].sum(axis=0), self.model
        if model.powers:
            totals[len(model.potentials) :] += self._state.of_particles("force_work").sum(axis=0)
        return totals

    def split_work(self, energies):
        """Work of all forces [J], losses by channel: (number, dict).

        energies: a difference of two `sum_energies`.
        """
        works, losses = split_work(self.model, energies)
        return float(sum(works.values())), losses
