"""Sums over the particles of a continuum that a device forms; the host reads totals. SI inside."""

import numpy as np

from dusttaichi.continuum.kernels.particle_sums import (
    AT_ONCE,
    MAXIMA,
    MOTION,
    STORED,
    count_totals,
)
from dusttaichi.continuum.particle_sums import describe_means


class DeviceSums:
    """Forms the sums of a DustState.

    kernels: those of a Compiled. scratch: memory.Table of its lists, by name. state: DustState.
    numbers: KernelNumbers.
    """

    def __init__(self, kernels, scratch, state, numbers):
        self._kernels, self.scratch, self.state = kernels, scratch, state
        self._numbers = numbers
        scratch["solid"].from_numpy(state.materials.rho_s)
        self.layout, (self.sums, _) = state.layout, count_totals(state.layout)

    def label_particles(self, labels):
        """Pass the number of the elastic body of each particle of the sample, -1 of others."""
        self.scratch["label"].from_numpy(labels)

    def form(self, motion):
        """The DeviceParticleSums of a DustMotion now."""
        self._pass_bodies(motion)
        of_step = self._numbers.of_step
        if self.layout.forces:
            self._kernels.evaluate_forces(of_step)
        if self.layout.self_gravity:
            self._kernels.potential(of_step)
        for launch in self._kernels.sums.particles:
            launch(self.state.count)
        return DeviceParticleSums(self, self.scratch["totals"].to_numpy())

    def sum_bodies(self, motion, bodies):
        """BODY of that many elastic bodies, (bodies, BODY.count)."""
        self._pass_bodies(motion)
        if self.layout.forces:
            self._kernels.evaluate_forces(self._numbers.of_step)
        rows = []
        for first in range(0, bodies, AT_ONCE):
            self._kernels.sums.bodies(self.state.count, first)
            rows.append(self.scratch["body_sums"].to_numpy(min(AT_ONCE, bodies - first)))
        return np.concatenate(rows)

    def _pass_bodies(self, motion):
        if self.layout.bodies:
            self.scratch["body_motion"].from_numpy(np.concatenate(motion.body_speeds(), axis=1))


class DeviceParticleSums:
    """Sums as ParticleSums has them, of the totals that a device has formed.

    maker: DeviceSums. totals: sums, then maxima (kernels.particle_sums).
    """

    def __init__(self, maker, totals):
        self._state = maker.state
        self._moving, behind = totals[: MOTION.count], MOTION.count + STORED.count
        self._stored, self._outside = totals[MOTION.count : behind], totals[behind : maker.sums]
        self._maxima = totals[maker.sums :]

    def kinetic(self):
        return self._moving[MOTION.kinetic]

    def largest_speed(self):
        return float(np.sqrt(self._maxima[0]))

    def momentum(self):
        return self._moving[MOTION["momentum"]]

    def angular_momentum(self):
        return self._moving[MOTION["angular_momentum"]]

    def weight_energy(self, gravity, masses, centres):
        moment = self._moving[MOTION["moment"]][self._state.axes]
        return -(moment @ gravity) - masses @ (centres @ gravity)

    def attraction(self, _self_gravity):
        return 0.5 * self._stored[STORED.attraction]

    def outside_energies(self):
        return self._outside.copy()

    def elastic(self):
        return self._stored[STORED["elastic"]]

    def work(self):
        return self._stored[STORED["work"]]

    def loss(self):
        return self._stored[STORED["loss"]]

    def noise_power(self):
        return self._moving[MOTION.noise_power]

    def power(self, name):
        return self._moving[getattr(MOTION, name)]

    def taken(self):
        return self._moving[MOTION.taken]

    def largest(self):
        materials = self._state.materials
        ends = self._maxima[MAXIMA:].reshape(-1, 2)[: len(materials.rho_s)]
        rows = zip(materials.phi_2, ends / materials.rho_s[:, None], strict=True)
        return [(float(phi_2), *map(float, largest)) for phi_2, largest in rows]

    def average_dust(self):
        sums = self._stored
        mass, volume = (sums[getattr(STORED, name)] or 1.0 for name in ("mass", "volume"))
        by_volume = (sums[STORED.pressure] / volume, sums[STORED["deviator"]] / volume)
        by_mass = (sums[STORED.filling] / mass, sums[STORED.damaged] / mass)
        return describe_means(*by_volume, *by_mass)

    def heat(self):
        """Heat of the dust [J] and its largest temperature [K]."""
        return float(self._stored[STORED.heat]), float(self._maxima[1])
