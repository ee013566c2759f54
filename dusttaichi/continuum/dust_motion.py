"""Motion of particles and rigid bodies of a continuum at the present. SI inside.

Velocities and spins in memory are half a time step behind the positions. (n, ...) arrays are in
internal order.
"""

import numpy as np

from dusttaichi.continuum.kernels.store import FACES, FREE
from dusttaichi.continuum.particle_sums import ParticleSums


class DustMotion:
    """Motion of the particles and rigid bodies of a DustState.

    state: DustState. outside: DustForces, or None. device_sums: DeviceSums where a device forms
    sums, or None.
    """

    def __init__(self, state, outside, device_sums=None):
        self.state, self.outside, self.device_sums = state, outside, device_sums

    def sum_particles(self):
        """The ParticleSums now, on a device its DeviceParticleSums."""
        return ParticleSums(self) if self.device_sums is None else self.device_sums.form(self)

    def velocities(self):
        """Present velocities (n, 3) [m/s]."""
        state = self.state
        v, group, half = state.of_particles("v"), state.of_particles("group"), state.half_step
        kick = half / state.of_particles("mass")[:, None] * state.of_particles("force")
        if self.outside is not None:
            kick += half * self.outside.accelerations()[:, state.axes]
        out = state.raise_to_space(np.where((group == FREE)[:, None], v + kick, v))
        speed, spin = self.body_speeds()
        on = group >= FACES
        if on.any():
            rows = group[on]
            arm = (
                state.raise_to_space(state.of_particles("x")[on]) - state.of_bodies("centre")[rows]
            )
            out[on] = speed[rows] + np.cross(spin[rows], arm)
        return out

    def body_speeds(self):
        """Velocities and spins of faces and rigid bodies now, (FACES + bodies, 3) both."""
        state = self.state
        half, mass = state.half_step, state.of_bodies("mass")
        mass = np.where(mass > 0.0, mass, np.inf)
        speed = state.of_bodies("speed") + half / mass * state.of_bodies("force")
        spin = np.zeros_like(speed)
        for body, momentum in enumerate(self.angular_momenta()):
            if body >= FACES:
                inverse = state.of_bodies("inertia")[body].reshape(3, 3)
                R = _rotation(state.of_bodies("turn")[body])
                spin[body] = R @ inverse @ R.T @ momentum
        return speed, spin

    def angular_momenta(self):
        """Angular momenta of faces and bodies about their centres now, (FACES + bodies, 3)."""
        state = self.state
        return state.of_bodies("momentum") + state.half_step * state.of_bodies("torque")

    def impulses(self):
        """Time integrals of the forces on faces and rigid bodies since the start [N s]."""
        state = self.state
        return state.of_bodies("impulse") + state.half_step * state.of_bodies("force")


def _rotation(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
