"""A solid that stays elastic, such as a glass bead (G09 eq 14): Murnaghan's equation of state.

p = (K_0/n) ((rho/rho_0)^n - 1). m: any object with rho_0 [kg/m^3], K_0 [Pa], n and mu [Pa].
"""

from dataclasses import dataclass

from numpy import sqrt


@dataclass(frozen=True)
class SolidNumbers:
    """Numbers of a solid, SI; the values are G09's glass, and mu = 0.6 K_0 is near glass."""

    rho_0: float = 2540.0
    K_0: float = 5e9
    n: float = 4.0
    mu: float = 3e9


def murnaghan(density, m):
    """p [Pa] (G09 eq 14)."""
    return m.K_0 / m.n * ((density / m.rho_0) ** m.n - 1.0)


def murnaghan_sound_speed(density, m):
    """Longitudinal speed of sound [m/s], sqrt(dp/drho + 4 mu/(3 rho))."""
    bulk = m.K_0 * (density / m.rho_0) ** m.n
    return sqrt((bulk + 4.0 / 3.0 * m.mu) / density)


def murnaghan_energy(density, m):
    """Energy stored by pressure in a unit of today's volume [J/m^3], n not 1.

    rho times the integral of p drho/rho^2 from rho_0 on.
    """
    x = density / m.rho_0
    return m.K_0 / m.n * ((x**m.n - x) / (m.n - 1.0) - x + 1.0)
