"""Constants that all contact laws share: radii, JKR's scales, stiffnesses.

Everything here is in SI and imports no Taichi; the formulas hold in any consistent units, and
`grains.kernels.polydisperse` uses the same ones in internal units. Symbols: r radius, R reduced
radius, E_star, G_star, gamma, a0, delta0, F_c. Numbers that belong to a law are in the law's file.
"""

from dataclasses import asdict, dataclass
from functools import cached_property
from math import inf, pi
from types import SimpleNamespace
from typing import Any

import numpy as np

from dusttaichi.physics.contact.material_interface import Interface, interface, reduced_modulus
from dusttaichi.physics.contact.material_interface import (
    reduced_shear_modulus as reduced_shear_modulus,
)

PULL_OFF = (9.0 / 16.0) ** (1.0 / 3.0)  # delta_c / delta0
CLOSEST = 0.9  # diameters: at 10 % overlap JKR is far beyond its assumptions
S_PULL_OFF = 6.0 ** (-1.0 / 3.0)  # sqrt(a/a0) at pull-off


def sphere_mass(r: Any, density: Any) -> Any:
    """Mass of a solid sphere [kg]."""
    return 4.0 / 3.0 * pi * r**3 * density


def grain_mass(material):
    """Mass of a grain [kg]."""
    return sphere_mass(material.radius, material.density)


def moment_of_inertia(material):
    """Moment of inertia of a solid sphere [kg m^2]."""
    return 0.4 * grain_mass(material) * material.radius**2


def reduced_radius(r1, r2):
    """R = r1 r2 / (r1 + r2) [m]."""
    return r1 * r2 / (r1 + r2)


def equilibrium_contact_radius(gamma, R, E_star):
    """a0 = (9 pi gamma R^2 / E*)^(1/3) [m] (S12 after eq 2)."""
    return (9.0 * pi * gamma * R**2 / E_star) ** (1.0 / 3.0)


def equilibrium_overlap(a0, R):
    """delta0 = a0^2 / (3 R) [m] (S12 after eq 2)."""
    return a0**2 / (3.0 * R)


def pull_off_force(gamma, R):
    """F_c = 3 pi gamma R [N] (S12 after eq 3)."""
    return 3.0 * pi * gamma * R


def normal_stiffness(gamma, R, E_star):
    """k_n at equilibrium = (6/5) (9 pi gamma R^2 E*^2)^(1/3) [N/m]."""
    return 1.2 * (9.0 * pi * gamma * R**2 * E_star**2) ** (1.0 / 3.0)


def first_touch(delta0, s):
    """Gap of two surfaces [m] at which a contact of stiffness s E forms: delta0 (1 - s^(2/3)).

    delta0 of E is s^(2/3) times that of s E. Their difference is added to the distance of first
    touch, so that softened grains have the same distance at rest, and the same filling factor.
    """
    return delta0 * (1.0 - s ** (2.0 / 3.0))


def collision_time(r, density, gamma, E_star):
    """t_c = 0.95 r^(7/6) rho^(1/2) / (gamma^(1/6) E*^(1/3)) [s] (T19 sect. 2)."""
    return 0.95 * r ** (7.0 / 6.0) * density**0.5 / (gamma ** (1.0 / 6.0) * E_star ** (1.0 / 3.0))


def characteristic_time(material):
    """t_c of two equal grains of a material [s]."""
    return collision_time(
        material.radius, material.density, material.surface_energy, reduced_modulus(material)
    )


@dataclass(frozen=True)
class ContactConstants(Interface):
    """Two surfaces and their radii, SI: input of the numbers of laws, which are attributes too.

    r2: infinite for a wall, of which R = r1. reduced_mass: of the two grains, that of the grain on
    a wall. R_pair: reduced radius of two grains, on a wall of the grain and another like it (S12
    after eq 27). mass: reduced mass of the two grains, on a wall that of the grain. m0 [kg],
    size [m]: mass and radius of equal grains that damping is scaled for. glue: factor on the normal
    force of a wall. interaction: the scene's block.
    """

    r1: float
    r2: float
    R: float
    R_pair: float
    mass: float
    m0: float
    size: float
    interaction: object
    glue: float = 1.0

    @property
    def r(self):
        """Radius of the first grain [m]."""
        return self.r1

    @cached_property
    def a0(self):
        """Contact radius at equilibrium [m]."""
        return equilibrium_contact_radius(self.gamma, self.R, self.E_star)

    @cached_property
    def a0_pair(self):
        """a0 of two grains, also on a wall [m]."""
        return equilibrium_contact_radius(self.gamma, self.R_pair, self.E_star)

    @cached_property
    def F_jkr(self):
        """JKR's pull-off force of the bare surfaces [N]."""
        return pull_off_force(self.gamma, self.R)

    # -- of the normal law -----------------------------------------------------------------------

    @cached_property
    def _law(self):
        from dusttaichi.physics.contact.effect_registry import normal_law

        return normal_law(self.interaction)

    @cached_property
    def delta0(self):
        """Overlap at equilibrium [m]."""
        return self._law.rest(self)

    @property
    def gap(self):
        """Gap of the surfaces at which a softened contact forms [m], 0 of one that is not."""
        return first_touch(self.delta0, self.stiffness_scaling)

    @property
    def rest_overlap(self):
        """Overlap at rest: sum of the radii less the distance of the centres [m]."""
        return self.delta0 - self.gap

    @property
    def delta_c(self):
        """The contact breaks at overlap -delta_c [m]."""
        return self.numbers["reach"]

    @cached_property
    def F_c(self):
        """Pull-off force, glue included [N]."""
        if hasattr(self._law, "pull_off"):
            return self._law.pull_off(self)
        force, _, _ = self.curve(np.linspace(-self.delta_c, self.delta0, 2000))
        return max(0.0, -float(np.min(force)))

    def curve(self, overlap):
        """(force [N], energy [J], contact radius over that at rest) at overlaps [m]."""
        return self._law.curve(overlap, self)

    def slope(self, overlap):
        """dF/d delta [N/m] at overlaps [m]."""
        if hasattr(self._law, "slope"):
            return self._law.slope(overlap, self)
        step = 1e-4 * max(self.delta0, 1e-4 * self.R)
        ahead, behind = (self.curve(overlap + side)[0] for side in (step, -step))
        return (ahead - behind) / (2.0 * step)

    @cached_property
    def k_n(self):
        """Normal stiffness at equilibrium [N/m]; without adhesion where JKR's equilibrium is."""
        overlap = self.delta0 or equilibrium_overlap(self.a0, self.R)
        return float(self.slope(np.float64(overlap)))

    @cached_property
    def barrier(self):
        """Energy [J] from first touch to where the contact breaks."""
        _, (touch, end), _ = self.curve(np.array([0.0, -self.delta_c]))
        return float(end - touch)

    @cached_property
    def bound(self):
        """Energy [J] that a contact at rest binds."""
        return -float(self.curve(np.float64(self.delta0))[1])

    @cached_property
    def numbers(self):
        """Numbers of the laws that the interaction has, by name, SI (physics.contact.registry)."""
        from dusttaichi.physics.contact.effect_registry import chosen_model, numbers_of

        return numbers_of(chosen_model(self.interaction), self)

    def kappa_at(self, overlap, speed=0.0):
        """Damping constant [kg/s] at overlaps [m] (any shape) and a rate of the distance [m/s]."""
        from dusttaichi.physics.contact.effect_registry import law_name, law_of

        name = law_name(self.interaction, "damping")
        if name is None:
            return 0.0 * overlap
        at = {"overlap": overlap, "speed": speed, "contact_radius": self.curve(overlap)[2]}
        return law_of("damping", name).coefficient(SimpleNamespace(**at), self)

    def __getattr__(self, name):
        """A number of a law; 0 for a spring or a damping that the interaction does not have."""
        if name in ("k_r", "k_s", "k_t", "kappa"):
            return self.numbers.get(name, 0.0)
        if not name.startswith("_") and name not in ("numbers", "properties"):
            values = dict(self.properties)
            values = values if name in values else self.numbers  # which are made of the properties
            if name in values:
                return values[name]
        raise AttributeError(f"a contact has no number {name!r}")


def pair_constants(material: Any, interaction: Any) -> Any:
    """Constants of a contact between two equal grains, modifiers included."""
    r = material.radius
    return mixed_constants(material, r, material, r, interaction)


def mixed_constants(a: Any, r1: float, b: Any, r2: float, interaction: Any) -> Any:
    """Constants of a contact between grains of materials a, b and radii r1, r2 [m].

    `scaled` damping takes the harmonic mean of the masses for m0, 2 R for the radius.
    """
    R = reduced_radius(r1, r2)
    m1, m2 = sphere_mass(r1, a.density), sphere_mass(r2, b.density)
    return ContactConstants(
        **asdict(interface(a, b, interaction)),
        r1=r1,
        r2=r2,
        R=R,
        R_pair=R,
        mass=m1 * m2 / (m1 + m2),
        m0=m1 if m1 == m2 else 2.0 * m1 * m2 / (m1 + m2),
        size=r1 if r1 == r2 else 2.0 * R,
        interaction=interaction,
    )


def wall_constants(material, interaction, r=None, wall=None):
    """Constants of a contact between a grain and a flat wall (S12 sect. 2.2).

    r [m]: another radius than the material's; wall: material of the wall, the grain's if not given.
    R = r, so a0, delta0, F_c and k_s differ from those of a pair; k_r and k_t are a pair's (S12
    after eq 27: the wall's own a0 would make k_t four times that; a minor difference).
    """
    r = material.radius if r is None else r
    mass = sphere_mass(r, material.density)
    return ContactConstants(
        **asdict(interface(material, wall or material, interaction)),
        r1=r,
        r2=inf,
        R=r,
        R_pair=reduced_radius(r, r),
        mass=mass,
        m0=mass,
        size=r,
        interaction=interaction,
    )
