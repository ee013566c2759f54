"""Laws of the papers: compression, tension, coordination number (NumPy, SI units).

S12 is Seizinger et al. 2012, G09 is Güttler et al. 2009, T19 is Tatsuuma et al. 2019. The
compression curves between walls have the form of S12 eq 31 (G09 eq 9),

    phi(P) = phi2 - (phi2 - phi1) / (exp((lg P - lg p_m) / Delta) + 1),

with phi1 the filling factor without load, phi2 the one at infinite load, p_m [Pa] the pressure
half way between them and Delta [dex] the width. Its steepest slope, at p_m, is
(phi2 - phi1)/(4 Delta) a decade (G09, section 3.5, prints it without the factor 4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.physics.contact import constants

EXPERIMENT_SCATTER = 0.02
"""Standard deviation of the laboratory's filling factors around their fit (G09 Fig 2)."""


def filling_factor(
    pressure: ArrayLike, phi1: float, phi2: float, p_m: float, delta: float
) -> NDArray[np.float64]:
    """Filling factor under `pressure` [Pa], any shape (S12 eq 31). No pressure, or tension: phi1.

    Written with tanh, which is the same function and cannot overflow.
    """
    pressure = np.asarray(pressure, dtype=float)
    with np.errstate(divide="ignore"):
        decades = np.log10(np.where(pressure <= 0, 0.0, pressure)) - np.log10(p_m)
    phi: NDArray[np.float64] = phi1 + (phi2 - phi1) * 0.5 * (1.0 + np.tanh(0.5 * decades / delta))
    return phi


def pressure(
    phi: ArrayLike, phi1: float, phi2: float, p_m: float, delta: float
) -> NDArray[np.float64]:
    """Pressure [Pa] at filling factor `phi`, any shape: the inverse of S12 eq 31 (G09 eq 10).

    0 at phi1, infinite at phi2, NaN outside of them.
    """
    phi = np.asarray(phi, dtype=float)
    inside = np.where((phi >= phi1) & (phi <= phi2), phi, np.nan)
    with np.errstate(divide="ignore"):
        ratio: NDArray[np.float64] = (inside - phi1) / (phi2 - inside)
        return p_m * ratio ** (delta * float(np.log(10.0)))


@dataclass(frozen=True)
class CompressionLaw:
    """One curve of the form of S12 eq 31, with its numbers and their source."""

    phi1: float
    phi2: float
    p_m: float
    delta: float
    name: str = ""
    source: str = ""

    def filling_factor(self, pressure: ArrayLike) -> NDArray[np.float64]:
        """Filling factor under `pressure` [Pa]."""
        return filling_factor(pressure, self.phi1, self.phi2, self.p_m, self.delta)

    def pressure(self, phi: ArrayLike) -> NDArray[np.float64]:
        """Pressure [Pa] at filling factor `phi`."""
        return pressure(phi, self.phi1, self.phi2, self.p_m, self.delta)


S12_STATIC = CompressionLaw(
    0.15, 0.58, 16.667e3, 0.562, "S12 eq 31 (omnidirectional, static)", "S12 section 5.1"
)
G09_OMNIDIRECTIONAL = CompressionLaw(
    0.12, 0.58, 13.0e3, 0.58, "G09 (omnidirectional, static)", "G09 Table 1"
)
UNIDIRECTIONAL = CompressionLaw(
    0.15, 0.33, 5.6e3, 0.33, "G09 (unidirectional, static)", "G09 Table 1, S12 section 5.1"
)


def _speed_within(
    speed: ArrayLike, lowest: float, highest: float, equation: str
) -> NDArray[np.float64]:
    speed = np.asarray(speed, dtype=float)
    if not np.all((speed >= lowest) & (speed <= highest)):
        raise ValueError(f"{equation} holds for {lowest} <= v <= {highest} m/s, not for {speed}")
    return speed


def p_m_slow(speed: ArrayLike) -> NDArray[np.float64]:
    """p_m [Pa] for a wall `speed` [m/s] up to 1 m/s (S12 eq 32). ValueError beyond."""
    v = _speed_within(speed, 0.0, 1.0, "S12 eq 32")
    return (18.296 * v**2 - 33.663 * v + 16.667) * 1e3


def p_m_fast(speed: ArrayLike) -> NDArray[np.float64]:
    """p_m [Pa] for a wall `speed` [m/s] of 1 to 25 m/s (S12 eq 33). ValueError beyond."""
    v = _speed_within(speed, 1.0, 25.0, "S12 eq 33")
    return (1.340 * v**1.93 + 0.307) * 1e3


def delta_dynamic(speed: ArrayLike) -> NDArray[np.float64]:
    """Delta [dex] for a wall `speed` [m/s] of 0 to 25 m/s (S12 eq 35). ValueError beyond."""
    v = _speed_within(speed, 0.0, 25.0, "S12 eq 35")
    return (v + 1.598) ** -1.997 + 0.170


def dynamic_law(speed: float) -> CompressionLaw:
    """The law for one wall `speed` [m/s]: p_m by S12 eq 32 below 1 m/s, by eq 33 from there on.

    Delta by S12 eq 35, phi1 and phi2 those of the static curve. At 1 m/s the two fits of the
    paper do not meet (1.30 and 1.65 kPa).
    """
    speed = float(speed)
    p_m = p_m_slow(speed) if speed < 1.0 else p_m_fast(speed)
    equation = "eq 32" if speed < 1.0 else "eq 33"
    return CompressionLaw(
        S12_STATIC.phi1,
        S12_STATIC.phi2,
        float(p_m),
        float(delta_dynamic(speed)),
        f"S12 {equation} at {speed:g} m/s",
        "S12 section 5.2",
    )


def tensile_strength(phi: ArrayLike, surface_energy: float, radius: float) -> NDArray[np.float64]:
    """Tensile strength [Pa] of aggregates stretched from filling factor `phi` (T19 eq 33).

    0.12 (F_c/r^2) phi^1.8 with F_c = 3 pi gamma R of two equal grains: 5.7e5 phi^1.8 Pa for ice
    of 0.1 um, which T19 rounds to 6e5. Simulated for phi of 0.01 to 0.5; the factor is
    0.12 +- 0.01. surface_energy [J/m^2], radius [m].
    """
    F_c: float = constants.pull_off_force(surface_energy, constants.reduced_radius(radius, radius))
    return 0.12 * F_c / radius**2 * np.asarray(phi, dtype=float) ** 1.8


def tensile_strength_laboratory(phi: ArrayLike) -> NDArray[np.float64]:
    """Tensile strength [Pa] of silica cakes in the laboratory, 10^(2.8 + 1.48 phi) (G09 eq 8)."""
    return 10.0 ** (2.8 + 1.48 * np.asarray(phi, dtype=float))


def rolling_energy(surface_energy: float, radius: float, critical_rolling: float) -> float:
    """E_roll = 6 pi^2 gamma r xi_crit [J]: to roll a grain by 90 degrees (T19 eq 1)."""
    return 6.0 * np.pi**2 * surface_energy * radius * critical_rolling


def isotropic_pressure(
    phi: ArrayLike, surface_energy: float, radius: float, critical_rolling: float
) -> NDArray[np.float64]:
    """Pressure [Pa] that holds cluster-cluster aggregates at `phi`, (E_roll/r^3) phi^3 (T19 eq 9).

    Kataoka et al. 2013b, for static isotropic compression of thin aggregates: at phi = 0.1
    the law of Tatsuuma et al. 2023 (configs/tatsuuma2023) is already half as much again.
    """
    scale = rolling_energy(surface_energy, radius, critical_rolling) / radius**3
    return scale * np.asarray(phi, dtype=float) ** 3


def coordination_number(phi: ArrayLike) -> NDArray[np.float64]:
    """Mean number of grains that a grain touches, 2 + 9.38 phi^1.62 (arXiv:1901.09700)."""
    return 2.0 + 9.38 * np.asarray(phi, dtype=float) ** 1.62
