"""Normal force between two adhesive elastic spheres (Johnson, Kendall & Roberts 1971; S12 eqs 2-3).

With s = sqrt(a/a0):  delta/delta0 = 3 s^4 - 2 s,  F = 4 F_c (s^6 - s^3),
U = 4 F_c delta0 (6/5 s^10 - 2 s^7 + 1/2 s^4), on the branch s^3 >= 1/6 that ends at pull-off.

t = sqrt(delta/delta0 + (9/16)^(1/3)) removes the square-root singularity at pull-off: s(t) is
regular for t >= 0, a rational fit gives it to 8e-5, and each Newton step squares that error
(1e-8, 1e-13), so that no contact radius has to be stored and no start value can be wrong.
"""

from functools import cache

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact import constants, jkr_curve
from dusttaichi.physics.contact.constants import PULL_OFF, S_PULL_OFF
from dusttaichi.physics.contact.effect_numbers import Constant

NUMBERS = {
    "inv_delta0": Constant("m^-1", "one over the overlap at equilibrium"),
    "reach": Constant("m", "gap at which the contact breaks"),
    "F4": Constant("N", "four times the pull-off force"),
    "U4": Constant("J", "four times pull-off force times overlap at equilibrium"),
}

# s^2 = W0 + WI t - (WI - W1) t (1 + C t)/(1 + A t + B t^2): value and slope exact at t = 0,
# leading order exact for t -> infinity; A, B, C by least squares on the relative error.
W0 = S_PULL_OFF**2
W1 = 2.0 * S_PULL_OFF / (18.0 * S_PULL_OFF**2) ** 0.5
WI = 3.0**-0.5
A, B, C = 0.71808842, 0.0593261, 0.1507543


equilibrium_overlap = ti.pyfunc(constants.equilibrium_overlap)


@ti.pyfunc
def numbers(c, block):
    """From delta0 and F_c (S12 after eqs 2 and 3)."""
    delta0, F_c = equilibrium_overlap(c.a0, c.R), c.glue * c.F_jkr
    return {
        "inv_delta0": 1.0 / delta0,
        "reach": PULL_OFF * delta0,
        "F4": 4.0 * F_c,
        "U4": 4.0 * F_c * delta0,
    }


def rest(c):
    """Overlap at equilibrium [m] (S12 after eq 2)."""
    return constants.equilibrium_overlap(c.a0, c.R)


def pull_off(c):
    """Pull-off force [N] (S12 after eq 3)."""
    return c.glue * c.F_jkr


def curve(overlap, c):
    """(force [N], energy [J], contact radius over that at rest) at overlaps [m] of any shape."""
    s = jkr_curve.scaled_radius(overlap / rest(c))
    F4 = 4.0 * pull_off(c)
    return F4 * force(s), F4 * rest(c) * energy(s), s * s


def slope(overlap, c):
    """dF/d delta [N/m]."""
    k_n = c.glue * constants.normal_stiffness(c.gamma, c.R, c.E_star)
    return k_n * jkr_curve.slope(jkr_curve.scaled_radius(overlap / rest(c)))


@ti.pyfunc
def start(t):
    """s^2 from t; its root, taken by the caller, is s to 8e-5."""
    return W0 + WI * t - (WI - W1) * t * (1.0 + C * t) / (1.0 + A * t + B * t * t)


@ti.func
def newton(s, d):
    """One Newton step for 3 s^4 - 2 s = d.

    The slope vanishes at pull-off, where the start is exact: its floor keeps rounding small there.
    """
    s2 = s * s
    return s - (3.0 * s2 * s2 - 2.0 * s - d) / ti.max(12.0 * s2 * s - 2.0, 1e-3)


@ti.pyfunc
def force(s):
    """F / (4 F_c), positive when repulsive."""
    s3 = s * s * s
    return s3 * s3 - s3


@ti.pyfunc
def energy(s):
    """U / (4 F_c delta0), zero when apart (s = 0)."""
    s2 = s * s
    s4 = s2 * s2
    return s4 * (1.2 * s4 * s2 - 2.0 * s2 * s + 0.5)


@cache
def contact_radius(newton_steps=2):
    """Returns the function s(d): s = sqrt(a/a0) for the scaled overlap d = delta/delta0.

    Below pull-off that of pull-off.
    """

    @ti.func
    def radius(d):
        depth = ti.max(d + PULL_OFF, 0.0)
        t = ti.sqrt(depth)
        s = ti.sqrt(start(t))
        for _ in ti.static(range(newton_steps)):
            s = newton(s, depth - PULL_OFF)
        return s

    return radius


@cache
def response(newton_steps=2):
    """Returns the function respond(motion, constants): struct of `force` and `energy`.

    It sets the contact_radius of the Motion.
    """
    scaled_radius = contact_radius(newton_steps)

    @ti.func
    def respond(motion: ti.template(), constants):
        s = scaled_radius(motion.overlap * constants.inv_delta0)
        motion.contact_radius = s * s
        return ti.Struct(force=constants.F4 * force(s), energy=constants.U4 * energy(s))

    return respond
