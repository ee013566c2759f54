"""The energy ledger, and the guard that stops a run in which it does not close."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.errors import GuardStop
from dusttaichi.method import moment
from dusttaichi.results.variables import reference_energy

if TYPE_CHECKING:
    from dusttaichi.method import Engine, Measurement, Start


BETWEEN = 3000, 1_000_000  # steps between checks; for small samples over the number of grains
FIRST = (10, 30, 100, 300, 1000)  # checks after the start, for instabilities


def ledger(m: Measurement, start: Start | Measurement) -> tuple[float, float]:
    """Residual of a Measurement and its share of the energy that has gone through the system.

    start: the Start, or another Measurement. The kinetic energy is m v(n-1/2).v(n+1/2)/2 here.
    Leapfrog conserves its sum with the potential of linear springs exactly for any step, so that
    the residual is due to motion that the step does not resolve.
    """
    change = m.energy - m.kick - start.energy + start.kick
    residual = change - m.work + m.lost
    through = reference_energy(m.work, start.kinetic, start.potential, m.lost)
    return residual, residual / through if through > 0.0 else 0.0


def turnover(m: Measurement, start: Start) -> tuple[float, float]:
    """Residual of the ledger, and its reference energy.

    The energy that has gone through the system, with two lower bounds. The first is the largest
    change of the kinetic energy so far: a body that is released at rest and oscillates without
    losses exchanges kinetic and potential energy, and returns to a state in which nothing else has
    changed. The second is the binding energy of the present contacts at rest: at the first contacts
    of a loose sample, the initial energies are far below those exchanged.
    """
    losses = np.abs(m.losses).sum()  # negative ones must not cancel others
    through = reference_energy(m.work, start.kinetic, start.potential, losses)
    through = max(through, start.exchanged_by(m))
    return ledger(m, start)[0], through + max(0.0, m.bound - abs(start.potential))


def next_check(step: int, first: int, size: int) -> int:
    """The next step after `step` at which a stage that began at step `first` is checked.

    A function of the scene alone, so that a guard stops a run at the same step on any machine; a
    check takes as long as the steps of some thousand grains.
    """
    every = max(BETWEEN[0], BETWEEN[1] // size)
    early = [first + n for n in FIRST if first + n > step]
    return min([*early[:1], first + ((step - first) // every + 1) * every])


def check(sim: Engine, m: Measurement, start: Start, tolerance: float = 0.01) -> None:
    """Raise GuardStop if a Measurement shows an invalid run, by itself or to the method.

    tolerance: allowed residual, as a share of the energy that has gone through the system or is
    bound in its contacts.
    """
    if not isfinite(m.energy) or not np.isfinite(m.losses).all():
        invalid_particles = getattr(sim, "name_invalid", str)()
        remedies = getattr(sim, "remedies", ("a lower speed",))
        raise GuardStop(
            f"{moment(sim)} the energy is not a number{invalid_particles}"
            + _cause(sim, m, "the step is too long", *remedies)
        )
    sim.validate(m)
    residual, through = turnover(m, start)
    if abs(residual) > tolerance * through:
        raise GuardStop(
            f"{moment(sim)} the energy ledger is open by {abs(residual) / through:.2%} of the "
            f"energy that has gone through the system, more than {tolerance:.2%}"
            + _cause(sim, m, "the step does not resolve the motion")
        )
    channel_losses = m.losses
    if storing := getattr(sim, "storing", ()):  # channels that may return energy
        channel_losses = np.where(np.isin(sim.channels, storing), np.inf, m.losses)
    worst = int(np.argmin(channel_losses))
    if m.losses[worst] < -tolerance * through:
        raise GuardStop(
            f"{moment(sim)} the losses by {sim.channels[worst]} are negative, "
            f"{-m.losses[worst] / through:.2%} of the energy that has gone through the system"
            + _cause(sim, m, "the step is so long that it generates energy")
        )


def _cause(sim: Engine, m: Measurement, cause: str, *remedies: str) -> str:
    """End of a message: the cause and what to try, as the state or the start shows it."""
    explain = getattr(sim, "explain_state", None)  # of methods that see causes beside the step
    if explain is not None and (explanation := explain(m)):
        return f": {explanation}."
    advice = " or ".join([f"a smaller {sim.step_key}", *remedies])
    if start := getattr(sim, "suspect", ""):
        return f". At the start {start}. Otherwise try {advice}."
    return f": {cause}. Try {advice}."
