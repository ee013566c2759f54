"""A material point on the host: stress of dust without inertia as a function of its strain.

It follows the laws of the kernels, for strains along fixed axes (NumPy). Many points, or
one strain with many materials, are computed together: the numbers of the material are then arrays.
"""

from dataclasses import dataclass, replace

import numpy as np

from dusttaichi.continuum.physics import elasticity, path, strength
from dusttaichi.continuum.physics.deviator import radial
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers


@dataclass(frozen=True)
class MaterialPoint:
    """A state of the dust of `m`; `strained` gives the next one. Each array has a common shape.

    density, reference [kg/m^3], p [Pa], positive in compression; S (shape, 3) [Pa]: the deviator
    along x, y and z. work, compaction, tension, shear [J/kg]: work done on it, and energy
    dissipated at each of the three strengths; the difference is stored elastically.
    """

    m: MaterialNumbers
    density: np.ndarray
    reference: np.ndarray
    p: np.ndarray
    S: np.ndarray
    work: np.ndarray
    compaction: np.ndarray
    tension: np.ndarray
    shear: np.ndarray

    @classmethod
    def make_unstressed(cls, m, density=None):
        """Dust without stress at `density` [kg/m^3] (default: rho_i of the material)."""
        start = m.rho_i if density is None else density
        shape = np.broadcast_shapes(*(np.shape(value) for value in (*m.values(), start)))
        density = np.broadcast_to(np.asarray(start, dtype=float), shape)
        zero = np.zeros(shape)
        return cls(m, density, density, zero, np.zeros((*shape, 3)), zero, zero, zero, zero)

    @property
    def phi(self):
        """Filling factor."""
        return self.density / self.m.rho_s

    @property
    def stress(self):
        """Stress along x, y and z [Pa], positive in tension, (shape, 3)."""
        return self.S - self.p[..., None]

    @property
    def volume_energy(self):
        """Energy that the pressure stores [J/kg]."""
        return elasticity.volume_energy(self.density, self.reference, self.m) / self.density

    @property
    def shear_energy(self):
        """Energy that the deviator stores [J/kg]."""
        J2 = 0.5 * (self.S**2).sum(axis=-1)
        return elasticity.shear_energy(J2, self.reference, self.m) / self.density

    def apply_strain(self, increments):
        """The point after natural strains `increments` along x, y and z, (3,) or (shape, 3).

        Where the dust flows in one direction a step may be of any size: the pressure depends on
        the density alone, and the deviator returns to the yield surface. The work is that of the
        mean stress of the step.
        """
        d = np.broadcast_to(np.asarray(increments, dtype=float), self.S.shape)
        volume = d.sum(axis=-1)
        density = self.density * np.exp(-volume)
        pressure, reference = path.pressure(density, self.reference, self.m)
        shearing = d - volume[..., None] / 3.0
        trial = self.S + 2.0 * elasticity.shear_modulus(reference, self.m)[..., None] * shearing
        J2 = 0.5 * (trial**2).sum(axis=-1)
        S = trial * radial(J2, strength.shear(density / self.m.rho_s, self.m))[..., None]
        strained_point = replace(self, density=density, reference=reference, p=pressure, S=S)

        pressing = 0.5 * (pressure + self.p) * (1.0 / self.density - 1.0 / density)
        turning = 0.5 * ((S + self.S) * shearing).sum(axis=-1) / np.sqrt(density * self.density)
        lost = pressing - strained_point.volume_energy + self.volume_energy
        return replace(
            strained_point,
            work=self.work + pressing + turning,
            compaction=self.compaction + np.where(pressure > 0, lost, 0.0),
            tension=self.tension + np.where(pressure > 0, 0.0, lost),
            shear=self.shear + turning - strained_point.shear_energy + self.shear_energy,
        )

    def to_density(self, density, steps=1):
        """States up to a density [kg/m^3] by strain along z alone, in even steps."""
        step = np.log(self.density / density)[..., None] * np.array((0.0, 0.0, 1.0)) / steps
        states = [self]
        for _ in range(steps):
            states.append(states[-1].apply_strain(step))
        return states[1:]


def restitution(point):
    """Square root of the stored elastic energy over the work done on a point.

    The coefficient of restitution of a body that is strained evenly, without waves.
    """
    return np.sqrt((point.volume_energy + point.shear_energy) / point.work)
