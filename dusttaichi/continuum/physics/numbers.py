"""The numbers of a material: the argument `m` of the laws, on the host and in kernels."""

from dataclasses import dataclass, fields
from math import log

import numpy as np

FLOOR = 0.005
"""Difference from phi_1 below which the strength is constant: 0.125 for G09's curve, as in
miluphcuda."""

CAP = 1e-3
"""Difference from phi_2, where the strength is infinite, within which dust is elastic."""

SHEAR = {"sqrt": (1.0, 0.5), "compressive": (1.0, 1.0), "tensile": (1.0, 0.0)}
"""C and a of Y = C Sigma^a |T|^(1-a) by the name of the law (G09 sections 4.1 and 5.1.2)."""


def largest_share(gamma):
    """Largest p/K(density) that an elastic path can have at a density, gamma at least 1.

    p/K(density) = d (1 - d)^(gamma - 1) where its density at zero pressure is (1 - d) density.
    """
    return (1.0 - 1.0 / gamma) ** (gamma - 1.0) / gamma


@dataclass(frozen=True)
class MaterialNumbers:
    """Numbers of one material, SI; scalars, or arrays of a shape of many materials.

    In this order they are the run-time arguments of the kernels.
    """

    rho_s: float  #: Density of the solid [kg/m^3].
    rho_i: float  #: Density at zero pressure for which K_0 holds [kg/m^3].
    K_0: float  #: Bulk modulus at rho_i [Pa].
    gamma: float  #: Exponent of the bulk modulus, K = K_0 (rho_0/rho_i)^gamma.
    mu_over_K: float  #: Shear modulus over bulk modulus.
    phi_1: float  #: Filling factor at which the compressive strength vanishes.
    phi_2: float  #: Filling factor at which the compressive strength is infinite.
    phi_floor: float  #: Filling factor below which the compressive strength is constant.
    phi_cap: float  #: Filling factor above which dust is elastic in compression.
    p_m: float  #: Compressive strength half way between phi_1 and phi_2 [Pa].
    power: float  #: Exponent of the compressive strength, Delta ln 10.
    T_0: float  #: Tensile strength at filling factor 0 [Pa].
    T_rate: float  #: Growth of ln |T| with the filling factor.
    C: float  #: Factor of the shear strength.
    a: float  #: Exponent of the compressive strength in the shear strength.
    q_max: float  #: Largest pressure over the bulk modulus at the same density.
    crack_speed: float = 0.0  #: Speed of cracks over the longitudinal speed of sound.

    @classmethod
    def of(cls, material):
        """Numbers of a material block (continuum.scene.ContinuumMaterial)."""
        squeeze, pull, shear = material.compressive, material.tensile, material.shear
        damage = getattr(material, "damage", None)
        return cls(
            rho_s=material.solid_density,
            rho_i=material.density,
            K_0=material.bulk_modulus,
            gamma=material.exponent,
            mu_over_K=material.shear_ratio,
            phi_1=squeeze.phi_1,
            phi_2=squeeze.phi_2,
            phi_floor=squeeze.phi_1 + FLOOR,
            phi_cap=squeeze.phi_2 - CAP,
            p_m=squeeze.p_m,
            power=squeeze.delta * log(10.0),
            T_0=10.0**pull.a,
            T_rate=pull.b * log(10.0),
            C=shear.factor,
            a=shear.exponent,
            q_max=0.9 * largest_share(material.exponent),
            crack_speed=0.0 if damage is None else damage.crack_speed,
        )

    @classmethod
    def together(cls, materials):
        """Numbers of several materials, arrays (materials,) each."""
        rows = (cls.of(material).values() for material in materials)
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    def taken(self, index):
        """The numbers at an index of their arrays, such as the material of each particle (n,)."""
        return MaterialNumbers(*(value[index] for value in self.values()))

    def values(self):
        """The numbers in the order of NUMBERS, for a struct of a kernel."""
        return tuple(getattr(self, name) for name in NUMBERS)


NUMBERS = tuple(field.name for field in fields(MaterialNumbers))
