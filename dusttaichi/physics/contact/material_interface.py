"""Interface of two materials: numbers of a contact, whatever the radii. SI, no Taichi."""

from dataclasses import dataclass, field
from math import sqrt
from typing import Any


def reduced_modulus(material: Any) -> float:
    """E* of two grains of one material [Pa] (S12 sect. 2.1)."""
    modulus: float = material.young_modulus / (2.0 * (1.0 - material.poisson_ratio**2))
    return modulus


def shear_modulus(material):
    """G of one grain [Pa]."""
    return material.young_modulus / (2.0 * (1.0 + material.poisson_ratio))


def reduced_shear_modulus(material, rule):
    """G* of two grains of one material [Pa].

    `mindlin`: 1/G* = 2 (2 - nu)/G, contact mechanics; `printed`: 2 (2 - nu^2)/G, as S12 prints it.
    """
    nu = material.poisson_ratio
    compliance = {"mindlin": 2.0 - nu, "printed": 2.0 - nu**2}[rule]
    return shear_modulus(material) / (2.0 * compliance)


MIXING = {
    "geometric": lambda a, b: sqrt(a * b),
    "arithmetic": lambda a, b: 0.5 * (a + b),
    "work_of_adhesion": lambda a, b: a + b - 2.0 / (1.0 / a + 1.0 / b),
}
"""gamma of a contact between two materials from the two surface energies, by name of the rule.

The papers have one material only. gamma is that of one surface, F_c = 3 pi gamma R, and each rule
gives back gamma1 = gamma2. `work_of_adhesion`: gamma1 + gamma2 less an interface energy that is the
harmonic mean of the two.
"""


def _define_field(unit):
    return field(metadata={"unit": unit})


@dataclass(frozen=True)
class Interface:
    """Numbers of a contact between two materials, SI, that do not depend on the radii.

    gamma by a rule of MIXING; 1/E* = sum of (1 - nu^2)/E, 1/G* = sum of (2 - nu)/G (`printed`:
    (2 - nu^2)/G), 1/G = 1/G1 + 1/G2; nu, xi_crit, density and asperity_volume are means
    of the two. stiffness_scaling: factor s that is in E* and G* (see `softened`).
    """

    gamma: float = _define_field("J/m^2")
    E_star: float = _define_field("Pa")
    G_star: float = _define_field("Pa")
    G: float = _define_field("Pa")
    nu: float = _define_field("1")
    xi_crit: float = _define_field("m")
    density: float = _define_field("kg/m^3")
    asperity_volume: float = _define_field("m")
    stiffness_scaling: float = _define_field("1")
    properties: tuple  # (name, value) of those that laws have brought in, SI


def mixed_properties(a, b, interaction):
    """(name, value) of the properties that the chosen laws have brought in, for two materials.

    The checks of a scene refuse it where one is missing.
    """
    from dusttaichi.physics.contact.effect_registry import properties_of

    values_a, values_b = dict(a.properties), dict(b.properties)
    return tuple(
        (name, MIXING[definition.mixing](values_a[name], values_b[name]))
        for name, definition in properties_of(interaction).items()
        if name in values_a and name in values_b
    )


def interface(a: Any, b: Any, interaction: Any) -> Any:
    """Interface of two materials, in either order the same."""
    rule = interaction.shear_modulus
    first, second = (
        Interface(
            gamma=m.surface_energy,
            E_star=reduced_modulus(m),
            G_star=reduced_shear_modulus(m, rule),
            G=shear_modulus(m) / 2.0,
            nu=m.poisson_ratio,
            xi_crit=m.critical_rolling,
            density=m.density,
            asperity_volume=interaction.asperity_volume(m),
            stiffness_scaling=m.stiffness_scaling,
            properties=mixed_properties(a, b, interaction),
        )
        for m in (a, b)
    )
    if first == second:
        return first

    def series(x, y):
        # x and y are those of two grains of one material each: 1/(2 x) is the part of one grain
        return 2.0 * x * y / (x + y)

    return Interface(
        gamma=MIXING[interaction.mixing](first.gamma, second.gamma),
        E_star=series(first.E_star, second.E_star),
        G_star=series(first.G_star, second.G_star),
        G=series(first.G, second.G),
        nu=0.5 * (first.nu + second.nu),
        xi_crit=0.5 * (first.xi_crit + second.xi_crit),
        density=0.5 * (first.density + second.density),
        asperity_volume=0.5 * (first.asperity_volume + second.asperity_volume),
        stiffness_scaling=first.stiffness_scaling,
        properties=first.properties,
    )
