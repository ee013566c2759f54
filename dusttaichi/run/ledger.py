"""The energy ledger, and the guard that stops a run in which it does not close."""

import numpy as np

from dusttaichi.errors import GuardStop
from dusttaichi.method import moment
from dusttaichi.results.variables import reference_energy

BETWEEN = 3000, 1_000_000  # steps between two checks: this many, of small samples this many a grain
FIRST = (10, 30, 100, 300, 1000)  # checks after the start: what is unstable shows at once


def ledger(m, start):
    """Residual [fJ] of a Measurement and its share of the energy that has gone through the system.

    start: the Start, or another Measurement. The kinetic energy is m v(n-1/2).v(n+1/2)/2 here: its
    sum with the potential of linear springs leapfrog keeps exactly, however long the step, so that
    what is left over is what the step does not resolve.
    """
    own = m.energy - m.kick - start.energy + start.kick
    residual = own - m.work + m.lost
    through = reference_energy(m.work, start.kinetic, start.potential, m.lost)
    return residual, residual / through if through > 0.0 else 0.0


def turnover(m, start):
    """Residual of the ledger, and the energy that it is measured by [fJ].

    That is the energy that has gone through the system, with two lower bounds. The first is the
    largest change of the kinetic energy so far: a body that is released at rest and oscillates
    without losses exchanges kinetic and potential energy, and returns to a state in which nothing
    else has changed. The second is the energy that the present contacts bind at rest: where the
    first grains of a loose sample touch, the initial energies are far below those exchanged.
    """
    losses = np.abs(m.losses).sum()  # those that make energy must not cancel
    through = reference_energy(m.work, start.kinetic, start.potential, losses)
    through = max(through, start.exchanged_by(m))
    return ledger(m, start)[0], through + max(0.0, m.bound - abs(start.potential))


def next_check(step, first, size):
    """The next step after `step` at which a stage that began at step `first` is checked.

    Fixed by the scene alone, so that a guard stops a run at the same step on any machine; a check
    costs as much as the steps of some thousand grains.
    """
    every = max(BETWEEN[0], BETWEEN[1] // size)
    early = [first + n for n in FIRST if first + n > step]
    return min([*early[:1], first + ((step - first) // every + 1) * every])


def check(sim, m, start, tolerance=0.01):
    """Raise GuardStop if a Measurement shows a run that has gone wrong.

    The guards of the method come first. tolerance: residual allowed, a share of the energy that has
    gone through the system or is bound in its contacts.
    """
    sim.validate(m)
    if not np.isfinite(m.energy) or not np.isfinite(m.losses).all():
        raise GuardStop(
            f"{moment(sim)} the energy is not a number: the step is too long for what happens. Try "
            f"a smaller {sim.step_key} or a lower speed."
        )
    residual, through = turnover(m, start)
    if abs(residual) > tolerance * through:
        raise GuardStop(
            f"{moment(sim)} the energy ledger is open by {abs(residual) / through:.2%} of the "
            f"energy that has gone through the system, more than {tolerance:.2%}: the step does "
            f"not resolve the motion. Try a smaller {sim.step_key}."
        )
    storing = getattr(sim, "storing", ())  # channels that may give back, of a method that has any
    own = np.where(np.isin(sim.channels, storing), np.inf, m.losses)
    worst = int(np.argmin(own))
    if m.losses[worst] < -tolerance * through:
        raise GuardStop(
            f"{moment(sim)} the losses by {sim.channels[worst]} are negative, "
            f"{-m.losses[worst] / through:.2%} of the energy that has gone through the system: the "
            f"step is so long that it makes energy. Try a smaller {sim.step_key}."
        )
