"""Momenta and motion of the elastic bodies of a continuum, from their particles. SI inside."""

import numpy as np

from dusttaichi.continuum.kernels.particle_sums import BODY, SECOND


class ElasticBodies:
    """The elastic bodies of a sample in a DustMotion.

    motion: DustMotion. sample: Particles.
    """

    def __init__(self, motion, sample):
        self._state, self._motion = motion.state, motion
        self._numbers = [k for k, body in enumerate(sample.bodies) if body.elastic]
        self._body = sample.body

    def list_labels(self):
        """Number of the elastic body of each particle of the sample, -1 of others, (N,) int32."""
        numbers = np.full(len(self._body), -1, np.int32)
        for label, k in enumerate(self._numbers):
            numbers[self._body == k] = label
        return numbers

    def _list_members(self):
        """Numbers of the particles of each body, in internal order: a list."""
        if not self._numbers:
            return []
        label = self._body[self._state.of_particles("number")]
        return [np.flatnonzero(label == k) for k in self._numbers]

    def momenta(self):
        """Present momenta [kg m/s], (bodies, 3)."""
        members = self._list_members()
        if not members:
            return np.zeros((0, 3))
        mass, v = self._state.of_particles("mass"), self._motion.velocities()
        return np.array([mass[body] @ v[body] for body in members])

    def measure(self):
        """Present centre [m], velocity [m/s] and spin [rad/s], (bodies, 3) each, as a tuple."""
        state, members = self._state, self._list_members()
        values = np.zeros((3, len(members), 3))
        if not members:
            return tuple(values)
        x, v = state.raise_to_space(state.of_particles("x")), self._motion.velocities()
        mass = state.of_particles("mass")
        for row, number in enumerate(members):
            m = mass[number]
            centre, velocity = m @ x[number] / m.sum(), m @ v[number] / m.sum()
            r = x[number] - centre
            inertia = m @ np.sum(r * r, axis=1) * np.eye(3) - r.T @ (m[:, None] * r)
            turning = m @ np.cross(r, v[number] - velocity)
            values[:, row] = centre, velocity, np.linalg.pinv(inertia) @ turning
        return tuple(values)


class DeviceElasticBodies(ElasticBodies):
    """ElasticBodies whose sums a device forms."""

    def __init__(self, motion, sample):
        super().__init__(motion, sample)
        motion.device_sums.label_particles(self.list_labels())

    def _sum(self):
        return self._motion.device_sums.sum_bodies(self._motion, len(self._numbers))

    def momenta(self):
        return self._sum()[:, BODY["momentum"]] if self._numbers else np.zeros((0, 3))

    def measure(self):
        values = np.zeros((3, len(self._numbers), 3))
        if not self._numbers:
            return tuple(values)
        sums = self._sum()
        mass = sums[:, BODY["mass"]]
        values[0], values[1] = sums[:, BODY["moment"]] / mass, sums[:, BODY["momentum"]] / mass
        moments = zip(sums[:, BODY["second"]], sums[:, BODY["turning"]], strict=True)
        for row, (second, turning) in enumerate(moments):
            spread = np.zeros((3, 3))
            for (a, b), value in zip(SECOND, second, strict=True):
                spread[a, b] = spread[b, a] = value
            inertia = np.trace(spread) * np.eye(3) - spread
            values[2, row] = np.linalg.pinv(inertia) @ turning
        return tuple(values)
