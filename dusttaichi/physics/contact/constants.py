"""Derived constants of a contact: one function each, used by forces, energies, time step and tests.

Everything here is in SI; `build` converts to the internal units. Symbols as in PHYSICS:
r radius, R reduced radius, E_star, G_star, gamma, a0, delta0, F_c.
"""

from dataclasses import dataclass, replace
from math import pi, sqrt

PULL_OFF = (9.0 / 16.0) ** (1.0 / 3.0)  # delta_c / delta0
S_PULL_OFF = 6.0 ** (-1.0 / 3.0)  # sqrt(a/a0) at pull-off


def sphere_mass(r, density):
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


def scaled_damping(coefficient, mass, t_c):
    """kappa = k_n' m0/t_c [kg/s] (T19 eq 5)."""
    return coefficient * mass / t_c


def viscoelastic_damping(time, nu, E_star, a0):
    """kappa at a = a0 [kg/s], (2 T/nu^2) E* a0 (Brilliantov et al. 2007)."""
    return 2.0 * time / nu**2 * E_star * a0


def damping_coefficient(damping, face, mass, r, a0):
    """kappa [kg/s] of a contact; for `viscoelastic` its value at a = a0 (it grows with a).

    viscous: S12 eq 7. scaled: T19 eq 5, with `mass` and `r` of its equal grains. face: Interface.
    """
    if damping.model == "none":
        return 0.0
    if damping.model == "viscous":
        return damping.kappa
    if damping.model == "scaled":
        t_c = collision_time(r, face.density, face.gamma, face.E_star)
        return scaled_damping(damping.coefficient, mass, t_c)
    return viscoelastic_damping(damping.time, face.nu, face.E_star, a0)


def collision_time(r, density, gamma, E_star):
    """t_c = 0.95 r^(7/6) rho^(1/2) / (gamma^(1/6) E*^(1/3)) [s] (T19 sect. 2)."""
    return 0.95 * r ** (7.0 / 6.0) * density**0.5 / (gamma ** (1.0 / 6.0) * E_star ** (1.0 / 3.0))


def asperity_volume(material, asperities):
    """Volume deformed per area [m]: what the scene says, else the material's own; 0 without."""
    if asperities is None:
        return 0.0
    return material.asperity_volume if asperities.volume is None else asperities.volume


def characteristic_time(material):
    """t_c of two equal grains of a material [s]."""
    return collision_time(
        material.radius, material.density, material.surface_energy, reduced_modulus(material)
    )


MIXING = {
    "geometric": lambda a, b: sqrt(a * b),
    "arithmetic": lambda a, b: 0.5 * (a + b),
    "work_of_adhesion": lambda a, b: a + b - 2.0 / (1.0 / a + 1.0 / b),
}
"""gamma of a contact between unlike materials from the two surface energies, by name of the rule.

The papers have one material only. gamma is that of one surface, F_c = 3 pi gamma R, and each rule
gives back gamma1 = gamma2. `work_of_adhesion`: gamma1 + gamma2 less an interface energy that is the
harmonic mean of the two.
"""


@dataclass(frozen=True)
class Interface:
    """Numbers of a contact between two materials, SI: what does not depend on the radii.

    gamma by a rule of MIXING; 1/E* = sum of (1 - nu^2)/E, 1/G* = sum of (2 - nu)/G (`printed`:
    (2 - nu^2)/G), 1/G = 1/G1 + 1/G2; nu (of zeta_crit and of damping), xi_crit, density (of
    `scaled` damping) and asperity_volume [m] (0 without asperities) are means of the two.
    """

    gamma: float
    E_star: float
    G_star: float
    G: float
    nu: float
    xi_crit: float
    density: float
    asperity_volume: float


def interface(a, b, interaction):
    """Interface of two materials, in either order the same."""
    rule = interaction.shear_modulus
    one, two = (
        Interface(
            m.surface_energy,
            reduced_modulus(m),
            reduced_shear_modulus(m, rule),
            shear_modulus(m) / 2.0,
            m.poisson_ratio,
            m.critical_rolling,
            m.density,
            asperity_volume(m, interaction.asperities),
        )
        for m in (a, b)
    )
    if one == two:
        return one

    def series(x, y):
        # x and y are those of two bodies of one material each: 1/(2 x) is the part of one body
        return 2.0 * x * y / (x + y)

    return Interface(
        MIXING[interaction.mixing](one.gamma, two.gamma),
        series(one.E_star, two.E_star),
        series(one.G_star, two.G_star),
        series(one.G, two.G),
        0.5 * (one.nu + two.nu),
        0.5 * (one.xi_crit + two.xi_crit),
        0.5 * (one.density + two.density),
        0.5 * (one.asperity_volume + two.asperity_volume),
    )


def crush_force(F_c, R, E_star):
    """F_eq/F_c for a kinetic energy of 1 J along the normal [J^(-3/5)] (PD08 eq 9)."""
    return 2.5**0.6 * R**0.2 * E_star**0.4 / F_c


def crush_energy(yield_strength, volume, a0):
    """Y v pi a0^2 [J]: what flattening asperities costs over the area pi a0^2 (PD08 eqs 7, 10).

    volume: deformed per area [m].
    """
    return yield_strength * volume * pi * a0**2


@dataclass(frozen=True)
class ContactConstants:
    """Numbers of one kind of contact, SI; r is the radius of the (first) grain, mass the reduced.

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
    return mixed_constants(material, r, material, r, interaction)


def mixed_constants(a, r1, b, r2, interaction):
    """Constants of a contact between grains of materials a, b and radii r1, r2 [m].

    `scaled` damping takes the harmonic mean of the masses for m0, 2 R for the radius.
    """
    R = reduced_radius(r1, r2)
    m1, m2 = sphere_mass(r1, a.density), sphere_mass(r2, b.density)
    mass = m1 if m1 == m2 else 2.0 * m1 * m2 / (m1 + m2)
    size = r1 if r1 == r2 else 2.0 * R
    reduced = m1 * m2 / (m1 + m2)
    return _constants(interface(a, b, interaction), interaction, r1, R, reduced, mass, size)


def wall_constants(material, interaction, r=None, wall=None):
    """Constants of a contact between a grain and a flat wall (S12 sect. 2.2).

    r [m]: another radius than the material's; wall: material of the wall, the grain's if not given.
    R = r, so a0, delta0, F_c and k_s differ from those of a pair; k_r and k_t are a pair's (S12
    after eq 27: the wall's own a0 would make k_t four times that; of minor importance).
    """
    r = material.radius if r is None else r
    face = interface(material, wall or material, interaction)
    mass = sphere_mass(r, material.density)
    pair = _constants(face, interaction, r, reduced_radius(r, r), 0.5 * mass, mass, r)
    return replace(_constants(face, interaction, r, r, mass, mass, r), k_t=pair.k_t)


def _constants(face, interaction, r, R, reduced, mass, size):
    """face: Interface. reduced: reduced mass [kg]. mass [kg], size [m]: of the equal grains that
    damping is scaled for."""
    a0 = equilibrium_contact_radius(face.gamma, R, face.E_star)
    F_c = pull_off_force(face.gamma, R)
    rolling, sliding, twisting = interaction.rolling, interaction.sliding, interaction.twisting
    crush = interaction.asperities
    return ContactConstants(
        r=r,
        R=R,
        a0=a0,
        delta0=equilibrium_overlap(a0, R),
        F_c=F_c,
        k_n=normal_stiffness(face.gamma, R, face.E_star),
        k_r=rolling.modifier * rolling_stiffness(F_c, R) if rolling else 0.0,
        k_s=sliding.modifier * sliding_stiffness(a0, face.G_star) if sliding else 0.0,
        k_t=twisting.modifier * twisting_stiffness(a0, face.G) if twisting else 0.0,
        xi_crit=face.xi_crit,
        zeta_crit=critical_sliding(a0, face.nu),
        phi_crit=CRITICAL_TWISTING,
        kappa=damping_coefficient(interaction.damping, face, mass, size, a0),
        mass=reduced,
        crush_force=crush_force(F_c, R, face.E_star) if crush else 0.0,
        crush_energy=crush_energy(crush.yield_strength, face.asperity_volume, a0) if crush else 0.0,
    )
