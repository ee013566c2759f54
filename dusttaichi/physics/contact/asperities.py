"""Flattening of asperities at first touch (PD08 section 2.2, after Tsai et al. 1990).

E_asp = Y V_asp (PD08 eq 7) of the kinetic energy E_kin = mu u^2/2 along n_c, with

    V_asp = v pi a_max^2 (eq 10; v: volume deformed per area, the one fitted number),
    a_max^3 = (3 R/4 E*) [F_eq + g + sqrt(g^2 + 2 g F_eq)], g = 6 pi gamma R (eq 8),
    F_eq = 2.5^(3/5) E_kin^(3/5) R^(1/5) E*^(2/5) (eq 9).

Eq 8 is JKR: with s = sqrt(a/a0) it reads s_max^3 = (1 + sqrt(1 + F_eq/F_c))/2, hence

    E_asp = crush_energy s_max^4 (`area`), F_eq/F_c = crush_force E_kin^(3/5),

with crush_energy = Y v pi a0^2. An impulse J along n_c takes the energy within
the step that finds the touch.
"""

from math import pi

from dusttaichi.compute.engine import ti
from dusttaichi.physics.contact.effect_numbers import Constant, History

NUMBERS = {
    "crush_force": Constant("J^-0.6", "F_eq/F_c of asperities for a unit of kinetic energy"),
    "crush_energy": Constant("J", "energy that flattening asperities costs over the area pi a0^2"),
}
HISTORY = {
    "touch_speed": History("m/s", "velocity along n_c at a first touch in the last step"),
    "touch_impulse": History("N s", "its impulse"),
}
CHANNEL = "asperities"
RADIAL = True


@ti.pyfunc
def numbers(c, block):
    """crush_force (PD08 eq 9), crush_energy = Y v pi a0^2 (PD08 eqs 7, 10)."""
    return {
        "crush_force": 2.5**0.6 * c.R**0.2 * c.E_star**0.4 / c.F_jkr,
        "crush_energy": block.yield_strength * c.asperity_volume * pi * c.a0**2,
    }


@ti.pyfunc
def area(energy, crush_force):
    """(a_max/a0)^2 after a touch with that kinetic energy."""
    return (0.5 + 0.5 * (1.0 + crush_force * energy**0.6) ** 0.5) ** (4.0 / 3.0)


@ti.func
def loss(u, constants):
    """E_asp of a touch with the relative speed u along n_c, whether or not there is as much."""
    energy = 0.5 * constants.mass * u * u
    return constants.crush_energy * area(energy, constants.crush_force)


@ti.func
def impulse(u, change, constants):
    """J >= 0 that takes `loss` from a contact that is approaching, u < 0, or all its energy.

    u: half a step back, before the grains touched, of which E_asp is a function. change: of u by
    the other forces of the contact in the whole step. The work of J is J times the mean of
    the speeds before and after, -u - change/2 - J/(2 mu), so that there is mu/2 times the square
    of `speed` to take, and a touch that loses all ends at rest.
    """
    speed = ti.max(-u - 0.5 * change, 0.0)
    remaining_square = ti.max(speed * speed - 2.0 * loss(u, constants) / constants.mass, 0.0)
    return constants.mass * (speed - ti.sqrt(remaining_square))


@ti.func
def update(motion: ti.template(), history: ti.template(), constants, dt):
    """Work of the impulse of the previous step.

    With the current speed along the previous n_c: its actual work, whatever other forces act on the
    grains.
    """
    lost = -0.5 * history.touch_impulse * (history.touch_speed + motion.speed_before)
    motion.struck += history.touch_impulse / constants.mass
    history.touch_speed = 0.0 * lost
    history.touch_impulse = 0.0 * lost
    return lost


@ti.func
def form(motion: ti.template(), history: ti.template(), constants, dt, push):
    """Force along n_c during the step that finds the touch; push: of the contact without it."""
    history.touch_speed = motion.speed_now
    history.touch_impulse = impulse(motion.speed_now, push * (dt / constants.mass), constants)
    return history.touch_impulse / dt


@ti.func
def pending(motion: ti.template(), history: ti.template(), constants, dt, push):
    """Energy taken by half of the impulse, in half of the change of speed, up to now.

    push: force along n_c with that of the impulse.
    """
    return (
        -0.5 * history.touch_impulse * (history.touch_speed + (0.25 * dt / constants.mass) * push)
    )
