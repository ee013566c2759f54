"""Derived constants of a contact: one function each, used by forces, energies, time step and tests.

Everything here is in SI; `build` converts to the internal units. Symbols as in PHYSICS:
r radius, R reduced radius, E_star, G_star, gamma, a0, delta0, F_c.
"""

from dataclasses import dataclass, replace
from math import pi

PULL_OFF = (9.0 / 16.0) ** (1.0 / 3.0)  # delta_c / delta0
S_PULL_OFF = 6.0 ** (-1.0 / 3.0)  # sqrt(a/a0) at pull-off


def grain_mass(material):
    """Mass of a grain [kg]."""
    return 4.0 / 3.0 * pi * material.radius**3 * material.density


def moment_of_inertia(material):
    """Moment of inertia of a solid sphere [kg m^2]."""
    return 0.4 * grain_mass(material) * material.radius**2


def reduced_radius(r1, r2):
    """R = r1 r2 / (r1 + r2) [m]."""
    return r1 * r2 / (r1 + r2)


def reduced_modulus(material):
    """E* of two bodies of one material [Pa] (S12 sect. 2.1)."""
    return material.young_modulus / (2.0 * (1.0 - material.poisson_ratio**2))


def shear_modulus(material):
    """G of one body [Pa]."""
    return material.young_modulus / (2.0 * (1.0 + material.poisson_ratio))


def reduced_shear_modulus(material, rule):
    """G* of two bodies of one material [Pa].

    `mindlin`: 1/G* = 2 (2 - nu)/G, contact mechanics; `printed`: 2 (2 - nu^2)/G, as S12 prints it.
    """
    nu = material.poisson_ratio
    compliance = {"mindlin": 2.0 - nu, "printed": 2.0 - nu**2}[rule]
    return shear_modulus(material) / (2.0 * compliance)


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


def rolling_stiffness(F_c, R):
    """k_r = 4 F_c / R [N/m] (S12 eq 17)."""
    return 4.0 * F_c / R


def sliding_stiffness(a0, G_star):
    """k_s = 8 a0 G* [N/m] (S12 eq 18)."""
    return 8.0 * a0 * G_star


def twisting_stiffness(a0, G):
    """k_t = (16/3) G a0^3 [N m] with 1/G = 1/G1 + 1/G2 (S12 eq 19)."""
    return 16.0 / 3.0 * G * a0**3


def critical_sliding(a0, nu):
    """zeta_crit = (2 - nu) a0 / (16 pi) [m] (S12 sect. 2.1.6)."""
    return (2.0 - nu) * a0 / (16.0 * pi)


CRITICAL_TWISTING = 1.0 / (16.0 * pi)  # phi_crit [rad] (S12 sect. 2.1.6)


def damping_coefficient(damping, material, a0):
    """kappa [kg/s]; for `viscoelastic` its value at a = a0 (it grows with a).

    viscous: S12 eq 7. scaled: T19 eq 5, kappa = k_n' m0/t_c with t_c = 0.95 r^(7/6) rho^(1/2)
    / (gamma^(1/6) E*^(1/3)). viscoelastic: Brilliantov et al. 2007, kappa = (2 T/nu^2) E* a.
    """
    if damping.model == "none":
        return 0.0
    if damping.model == "viscous":
        return damping.kappa
    E_star = reduced_modulus(material)
    if damping.model == "scaled":
        return damping.coefficient * grain_mass(material) / characteristic_time(material)
    return 2.0 * damping.time / material.poisson_ratio**2 * E_star * a0


def asperity_volume(material, asperities):
    """Volume deformed per area [m]: what the scene says, else the material's own."""
    return material.asperity_volume if asperities.volume is None else asperities.volume


def characteristic_time(material):
    """t_c = 0.95 r^(7/6) rho^(1/2) / (gamma^(1/6) E*^(1/3)) [s] (T19 sect. 2)."""
    return (
        0.95
        * material.radius ** (7.0 / 6.0)
        * material.density**0.5
        / (material.surface_energy ** (1.0 / 6.0) * reduced_modulus(material) ** (1.0 / 3.0))
    )


def crush_force(gamma, R, E_star):
    """F_eq/F_c for a kinetic energy of 1 J along the normal [J^(-3/5)] (PD08 eq 9)."""
    return 2.5**0.6 * R**0.2 * E_star**0.4 / pull_off_force(gamma, R)


def crush_energy(yield_strength, volume, a0):
    """Y v pi a0^2 [J]: what flattening asperities costs over the area pi a0^2 (PD08 eqs 7, 10).

    volume: deformed per area [m].
    """
    return yield_strength * volume * pi * a0**2


@dataclass(frozen=True)
class ContactConstants:
    """Numbers of one kind of contact, SI. `mass` is the reduced one.

    crush_force, crush_energy: of asperities, 0 without.
    """

    r: float
    R: float
    a0: float
    delta0: float
    F_c: float
    k_n: float
    k_r: float
    k_s: float
    k_t: float
    xi_crit: float
    zeta_crit: float
    phi_crit: float
    kappa: float
    mass: float
    crush_force: float
    crush_energy: float

    @property
    def delta_c(self):
        """Overlap at pull-off is -delta_c [m]."""
        return PULL_OFF * self.delta0


def pair_constants(material, interaction):
    """Constants of a contact between two equal grains, modifiers included."""
    r = material.radius
    return _constants(material, interaction, reduced_radius(r, r), 0.5 * grain_mass(material))


def wall_constants(material, interaction):
    """Constants of a contact between a grain and a flat wall of the same material (S12 sect. 2.2).

    R = r, so a0, delta0, F_c and k_s differ from those of a pair; k_r and k_t are a pair's (S12
    after eq 27: the wall's own a0 would make k_t four times that; of minor importance).
    """
    wall = _constants(material, interaction, material.radius, grain_mass(material))
    pair = pair_constants(material, interaction)
    return replace(wall, k_t=pair.k_t)


def _constants(material, interaction, R, mass):
    E_star = reduced_modulus(material)
    a0 = equilibrium_contact_radius(material.surface_energy, R, E_star)
    F_c = pull_off_force(material.surface_energy, R)
    G_star = reduced_shear_modulus(material, interaction.shear_modulus)
    rolling, sliding, twisting = interaction.rolling, interaction.sliding, interaction.twisting
    crush = interaction.asperities
    return ContactConstants(
        r=material.radius,
        R=R,
        a0=a0,
        delta0=equilibrium_overlap(a0, R),
        F_c=F_c,
        k_n=normal_stiffness(material.surface_energy, R, E_star),
        k_r=rolling.modifier * rolling_stiffness(F_c, R) if rolling else 0.0,
        k_s=sliding.modifier * sliding_stiffness(a0, G_star) if sliding else 0.0,
        k_t=twisting.modifier * twisting_stiffness(a0, shear_modulus(material) / 2.0)
        if twisting
        else 0.0,
        xi_crit=material.critical_rolling,
        zeta_crit=critical_sliding(a0, material.poisson_ratio),
        phi_crit=CRITICAL_TWISTING,
        kappa=damping_coefficient(interaction.damping, material, a0),
        mass=mass,
        crush_force=crush_force(material.surface_energy, R, E_star) if crush else 0.0,
        crush_energy=crush_energy(crush.yield_strength, asperity_volume(material, crush), a0)
        if crush
        else 0.0,
    )
