"""The numbers of a material: the argument `m` of the laws, on the host and in kernels."""

from dataclasses import dataclass, fields, make_dataclass, replace
from functools import cache, reduce
from typing import ClassVar

import numpy as np

from dusttaichi.continuum.physics.chosen import exponent_law
from dusttaichi.continuum.physics.dust_laws import (
    BUILT_IN,
    KINDS,
    LAWS,
    DustLaws,
    law_name,
    laws_of,
)

FLOOR = 0.005
"""Difference from phi_1 below which the strength is constant: 0.125 for G09's curve, as in
miluphcuda."""

CAP = 1e-3
"""Difference from phi_2, where the strength is infinite, within which dust is elastic."""

STEEPEST = np.linspace(0.01, 1.0, 100)
"""Filling factors among which the largest exponent of the bulk modulus is sought."""


def largest_share(gamma):
    """Largest p/K(density) that an elastic path can have at a density, gamma at least 1.

    p/K(density) = d (1 - d)^(gamma - 1) where its density at zero pressure is (1 - d) density. A
    modulus whose exponent is at most gamma reaches as much.
    """
    return (1.0 - 1.0 / gamma) ** (gamma - 1.0) / gamma


@dataclass(frozen=True, kw_only=True)
class CommonNumbers:
    """Numbers that every material has, SI; scalars, or arrays of a shape of many materials.

    `numbers_class` adds those of its laws. In their order they are run-time arguments of kernels.
    """

    rho_s: float  #: Density of the solid [kg/m^3].
    rho_i: float  #: Density at zero pressure for which the bulk modulus of the YAML holds [kg/m^3].
    mu_over_K: float  #: Shear modulus over bulk modulus.
    phi_1: float  #: Filling factor at which the compressive strength vanishes.
    phi_2: float  #: Filling factor at which the compressive strength is infinite.
    phi_floor: float  #: Filling factor below which the compressive strength is constant.
    phi_cap: float  #: Filling factor above which dust is elastic in compression.
    q_max: float  #: Largest pressure over the bulk modulus at the same density.
    crack_speed: float = 0.0  #: Speed of cracks over the longitudinal speed of sound.
    compressive_choice: float = 0.0  #: Number of its compressive law among those of the scene.
    tensile_choice: float = 0.0  #: Number of its tensile law.
    shear_choice: float = 0.0  #: Number of its shear law.
    elasticity_choice: float = 0.0  #: Number of its law of elasticity.

    laws: ClassVar[DustLaws]

    @classmethod
    def names(cls):
        """Names of the numbers in their order."""
        return tuple(field.name for field in fields(cls))

    @staticmethod
    def from_material(material, laws=None):
        """Numbers of a material block (continuum.scene.ContinuumMaterial).

        laws: DustLaws of its scene; without them, the laws of the material alone.
        """
        damage = getattr(material, "damage", None)
        laws = laws or laws_of([material])
        laws_by_kind = {
            law_kind: LAWS[law_kind, law_name(material, law_kind)] for law_kind in KINDS
        }
        phi_1, phi_2 = laws_by_kind["compressive"].limits(material.compressive)
        # numbers of laws that it has not chosen are never used
        values = dict.fromkeys((name for law in laws.all for name in law.NUMBERS), 1.0)
        for number, (law_kind, law) in enumerate(laws_by_kind.items()):
            values |= law.numbers(material, getattr(material, law_kind, None))
            values[f"{law_kind}_choice"] = float(laws[number].index(law))
        m = numbers_class(laws)(
            rho_s=material.solid_density,
            rho_i=material.density,
            mu_over_K=material.shear_ratio,
            phi_1=phi_1,
            phi_2=phi_2,
            phi_floor=phi_1 + FLOOR,
            phi_cap=phi_2 - CAP,
            q_max=np.nan,
            crack_speed=0.0 if damage is None else damage.crack_speed,
            **values,
        )
        steepest = reduce(np.maximum, (exponent_law(phi * m.rho_s, m) for phi in STEEPEST), 1.0)
        return replace(m, q_max=0.9 * largest_share(steepest))

    @classmethod
    def together(cls, materials):
        """Numbers of several materials, arrays (materials,) each."""
        laws = laws_of(materials)
        rows = (cls.from_material(material, laws).values() for material in materials)
        columns = map(np.array, zip(*rows, strict=True))
        numbers_type = numbers_class(laws)
        return numbers_type(**dict(zip(numbers_type.names(), columns, strict=True)))

    def take(self, index):
        """The numbers at an index of their arrays, such as the material of each particle (n,)."""
        return type(self)(**{name: getattr(self, name)[index] for name in self.names()})

    def values(self):
        """The numbers in the order of `names`, for a struct of a kernel."""
        return tuple(getattr(self, name) for name in self.names())


@cache
def numbers_class(laws):
    """Class of the numbers of materials with DustLaws."""
    names = dict.fromkeys(name for law in laws.all for name in law.NUMBERS)
    return make_dataclass(
        "MaterialNumbers",
        [(name, float) for name in names],
        bases=(CommonNumbers,),
        namespace={"laws": laws, "__doc__": "Numbers of a material and of its laws [SI]."},
        frozen=True,
        kw_only=True,
    )


MaterialNumbers = numbers_class(DustLaws(*((law,) for law in BUILT_IN.values())))
"""Class of the numbers of a material with the built-in laws; its `of` takes any material."""
