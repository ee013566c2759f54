"""Closed forms of the benchmarks of the continuum (docs/benchmarks.md), in SI and plane strain.

Riemann problem of a piston, one point of dust, an imploding shell (Verney), a cantilever
(Timoshenko), a disc pressed between plates (Hertz, Hondros).
"""

from bisect import bisect_left
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from dusttaichi.continuum.physics import elasticity, strength
from dusttaichi.continuum.physics.point import MaterialPoint

# -- planar compaction -----------------------------------------------------------------------------


def riemann(m, speed, states=4000):
    """Waves ahead of a piston at a speed [m/s] in dust at rest of the MaterialNumbers m.

    (mass per area and time [kg/(m^2 s)], axial stress [Pa], density [kg/m^3]): of each wave, the
    fastest first, and of the dust behind it. Stress over specific volume is the path of a point
    that is pressed along one axis; where it is concave a wave spreads, where it is convex there is
    a shock, whose chord takes the place of the path: so the waves are the upper concave hull.
    """
    at_rest = MaterialPoint.make_unstressed(m)
    path = [at_rest, *at_rest.to_density(1.01 * m.rho_i, states)]  # dust yields at strains of 1e-4
    path += path[-1].to_density(0.99 * m.phi_cap * m.rho_s, states)
    volume = np.array([1.0 / float(state.density) for state in path])
    stress = np.array([-float(state.stress[2]) for state in path])

    def hull(end):
        out = [0]
        for k in range(1, end + 1):
            while len(out) > 1 and slope(out[-2], out[-1]) < slope(out[-1], k):
                out.pop()
            out.append(k)
        return np.array(out)

    def slope(a, b):
        return (stress[b] - stress[a]) / (volume[a] - volume[b])

    def piston_speed(end):
        at = hull(end)
        return np.sqrt(np.diff(stress[at]) * -np.diff(volume[at])).sum()

    at = hull(1 + bisect_left(range(1, 2 * states), speed, key=piston_speed))
    flux = np.sqrt(np.diff(stress[at]) / -np.diff(volume[at]))
    return flux, stress[at[1:]], 1.0 / volume[at[1:]]


# -- one point of dust -----------------------------------------------------------------------------


class Turning(NamedTuple):
    """Dust that is let go at a filling factor after confined compression.

    modulus [Pa]: longitudinal, of the unloading. released: filling factor without axial stress.
    lateral [Pa]: stress along the plates that is left then, positive in compression. tension [Pa]:
    largest axial stress when it is pulled on.
    """

    modulus: float
    released: float
    lateral: float
    tension: float


def unload_confined(phi, m):
    """Unload dust at filling factor phi: the Turning.

    p = Sigma and q = Y fall by K and 2 mu times the strain, and where the dust is pulled on, p
    reaches T and the deviator -Y.

    Elastic until the axial stress has gone, which needs Sigma + 2 Y/3 < 2 Y (K + 4 mu/3)/2 mu.
    """
    pressure, Y = strength.compressive(phi, m), strength.shear(phi, m)
    reference = float(brentq(lambda r: elasticity.elastic_pressure(phi * m.rho_s, r, m) - pressure,
                             0.9 * phi * m.rho_s, phi * m.rho_s))  # fmt: skip
    K, mu = elasticity.bulk_modulus(reference, m), elasticity.shear_modulus(reference, m)
    M = K + 4.0 / 3.0 * mu
    strain = (pressure + 2.0 / 3.0 * Y) / M
    if Y - 2.0 * mu * strain < -Y:
        raise ValueError(f"dust of filling factor {phi:.3g} yields before its axial stress is gone")
    lateral = pressure - K * strain - (Y - 2.0 * mu * strain) / 3.0
    pulled = -strength.tensile(phi, m) + 2.0 / 3.0 * Y
    return Turning(M, phi - strain * reference / m.rho_s, lateral, pulled)


# -- Verney's shell --------------------------------------------------------------------------------


def verney(inner, outer, speed, density, Y):
    """Inner radius [m] at which a cylindrical shell of an incompressible rigid-plastic material
    stops, whose inner surface moves inwards at a speed [m/s] (Verney 1968).

    In plane strain v = -u/r, so that the kinetic energy per length is pi rho u^2 ln(b/a), and
    plastic flow takes (4 pi/sqrt 3) Y u ln(b/a) of it in a time, where u = -a da/dt and b^2 - a^2
    stays. Over all of the way that is pi Y/sqrt(3) times the change of b^2 ln b^2 - a^2 ln a^2.
    """
    apart = outer**2 - inner**2
    kinetic = np.pi * density * (speed * inner) ** 2 * np.log(outer / inner)

    def dissipated_energy(a):
        s = np.array([inner**2, a**2]) / inner**2
        t = s + apart / inner**2
        F = t * np.log(t) - s * np.log(s)
        return np.pi / np.sqrt(3.0) * Y * inner**2 * (F[0] - F[1])

    largest_dissipation = dissipated_energy(1e-6 * inner)
    if largest_dissipation < kinetic:
        raise ValueError(
            f"the shell closes: {kinetic:.3g} of {largest_dissipation:.3g} J/m are enough"
        )
    return brentq(lambda a: dissipated_energy(a) - kinetic, 1e-6 * inner, inner)


def verney_radii(times, inner, outer, speed, density, Y):
    """Inner radii [m] of that shell at times [s], constant after its stop: of u from the remaining
    energy, a da = -u dt."""
    stop = verney(inner, outer, speed, density, Y)
    radii = stop + (inner - stop) * np.linspace(1.0, 0.0, 4001) ** 2
    apart = outer**2 - inner**2
    s = radii**2 / inner**2
    t = s + apart / inner**2
    F = t * np.log(t) - s * np.log(s)
    remaining_energy = np.pi / np.sqrt(3.0) * Y * inner**2 * (F - F[-1])
    speeds = np.sqrt(remaining_energy / (np.pi * density * radii**2 * 0.5 * np.log(t / s)))
    pace = 0.5 * (speeds[1:] + speeds[:-1])
    passed = np.append(0.0, np.cumsum(-np.diff(radii) / pace))
    return np.interp(times, passed, radii)


# -- oscillating plate -----------------------------------------------------------------------------


class Cantilever(NamedTuple):
    """A plate that is clamped at one end, under a load across it that sets in at once.

    period [s] of its first mode. sag [m]: static deflection of its middle of mass.
    """

    period: float
    sag: float


def cantilever(length, height, density, K, mu, gravity):
    """The Cantilever of Timoshenko's theory [SI], in plane strain: with shear and rotation.

    The frequency is the first root of Huang's (1961) equation for an end that is clamped and one
    that is free; without shear and rotation it is 1.8751^2 sqrt(E' h^2/(12 rho))/L^2, E' = E/(1 -
    nu^2).
    """
    nu = (3.0 * K - 2.0 * mu) / (6.0 * K + 2.0 * mu)
    E = 2.0 * mu * (1.0 + nu) / (1.0 - nu**2)
    # of plane strain, the ratio of an equal plate in plane stress is nu/(1 - nu)
    flat = nu / (1.0 - nu)
    shear = 5.0 * (1.0 + flat) / (6.0 + 5.0 * flat) * mu
    r2 = height**2 / (12.0 * length**2)
    s2 = E * r2 / shear

    def missing(squared_number):
        root = np.sqrt((r2 - s2) ** 2 + 4.0 / squared_number**2)
        alpha, beta = (
            squared_number * np.sqrt(0.5 * (sign * (r2 + s2) + root)) for sign in (-1.0, 1.0)
        )
        uneven = squared_number * (r2 + s2) / np.sqrt(1.0 - squared_number**2 * r2 * s2)
        return (
            2.0
            + (squared_number**2 * (r2 - s2) ** 2 + 2.0) * np.cosh(alpha) * np.cos(beta)
            - uneven * np.sinh(alpha) * np.sin(beta)
        )

    # (k length)^2 of the lowest mode: 3.516 without shear and rotation, which lower it
    squared_number = brentq(missing, 1.0, 3.6)
    period = 2.0 * np.pi / squared_number * length**2 * np.sqrt(12.0 * density / (E * height**2))
    load = density * gravity * height
    bending = load * length**4 / (20.0 * E * height**3 / 12.0)
    return Cantilever(period, bending + load * length**2 / (3.0 * shear * height))


# -- diametral compression -------------------------------------------------------------------------


def hertz_half_width(force, radius, K, mu):
    """Half width [m] of the contact of an elastic disc with a rigid plane, under a force per length
    [N/m] (Hertz)."""
    nu = (3.0 * K - 2.0 * mu) / (6.0 * K + 2.0 * mu)
    E = 2.0 * mu * (1.0 + nu) / (1.0 - nu**2)
    return np.sqrt(4.0 * force * radius / (np.pi * E))


def brazilian(force, diameter, square):
    """Tension [Pa] across the load in the middle of a disc that two plates press together.

    force [N/m]: per length. square [m^2]: mean square of the distance of the load from the axis;
    b^2/4 for Hertz's contact of half width b.

    The middle responds to the mean N_0 of the normal traction on the rim and to its part
    N_2 cos(2 theta) alone: its stress along theta is N_0 + N_2 cos(2 theta) (Michell's solution, in
    which the tangential traction of that order has no stress in the middle). A force along the axis
    that acts on the rim at an angle a from it contributes cos(a) (2 cos 2a - 1) of what it does at
    a = 0, 2 P/(pi D) (Hertz 1883); averaged over the load to second order, 1 - 4.5 a^2. (Hondros
    1959 has tractions normal to the rim, cos 2a for the same force.)
    """
    return 2.0 * force / (np.pi * diameter) * (1.0 - 4.5 * square / (0.5 * diameter) ** 2)
