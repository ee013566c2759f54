"""Damage by tension: flaws that grow into cracks (Grady & Kipp 1980, Benz & Asphaug 1995).

A volume V of dust has flaws that activate at strains e, k e^m V of them below e (Weibull). In a
particle the active ones grow into cracks, which relieve the stress around them: the relieved share
D of the particle grows by

    d(D^(1/3))/dt = n c_g / R_s,    n = min(N, (e/e_min)^p)

with n active flaws of the N of the particle, e_min the strain of the weakest, c_g the speed of a
crack and R_s the radius of a sphere of the volume of the particle. e is the largest principal
tension over Young's modulus, of the stress without damage; D is at most n/N. The share 1 - D of the
particle carries its tension and deviator.
"""

from numpy import exp, log, maximum, minimum, where

LEAST = 1e-30
"""Strain that keeps a logarithm finite."""


def tensile_strain(tension, K, m):
    """Strain that activates flaws.

    The largest principal stress [Pa], positive in tension, over Young's modulus 9 K r/(3 + r), r =
    mu/K.
    """
    return tension * (3.0 + m.mu_over_K) / (9.0 * K * m.mu_over_K)


def active_flaws(strain, weakest, exponent, count):
    """Number of active flaws of `count` at a strain; weakest: strain of the first."""
    reached = minimum(count, exp(exponent * log(maximum(strain, LEAST) / weakest)))
    return where(strain >= weakest, reached, 0.0)


def grow_cracks(root, active, count, step):
    """D^(1/3) after a time step; step: c_g dt/R_s, growth of a crack over the radius."""
    largest = exp(log(maximum(active, LEAST) / maximum(count, 1.0)) / 3.0)
    return where(active > 0.0, maximum(root, minimum(largest, root + active * step)), root)


def undamaged_fraction(root):
    """Share 1 - D of a particle that carries tension and deviator; root: D^(1/3)."""
    return 1.0 - root**3


def carried_pressure(p, undamaged):
    """Pressure [Pa] of a particle whose share `undamaged` alone carries tension."""
    return where(p < 0.0, undamaged * p, p)
