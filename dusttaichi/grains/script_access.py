"""Forces and velocities that a script sets between steps; the ledger counts them as work."""

from contextlib import contextmanager

import numpy as np

from dusttaichi import units


def set_forces(motion, ledger, forces):
    """Force on every grain of a Motion from now on [N], (N, 3), in the sample's order."""
    with _book_as_work(ledger):
        v, w = motion.velocities()
        force = forces[motion.state.order] / units.FORCE
        motion.state.fields["script_force"].from_numpy(force)
        motion.set_back(v, w)


def set_velocities(motion, ledger, velocity, spin):
    """Velocities [m/s] and spins [rad/s] of all grains now, (N, 3), in the sample's order.

    None leaves them as they are. Grains that are carried keep their own.
    """
    cell, time = motion.environment.cell, motion.environment.time
    with _book_as_work(ledger):
        state = motion.velocities()
        carried = motion.push.carried_grains
        scales = units.SPEED, units.SPIN
        for values, target, unit in zip(state, (velocity, spin), scales, strict=True):
            if target is not None:
                previous = values[carried].copy()
                values[:] = target[motion.state.order] / unit
                if unit == units.SPEED and cell is not None:
                    x = motion.state.of_grains("x")
                    values += cell.speeds_across(cell.outside(x, time), time)
                values[carried] = previous
        motion.set_back(*state)


@contextmanager
def _book_as_work(ledger):
    """Context in which a change of the state counts as work from outside."""
    previous = _measure_balance(ledger)
    yield
    ledger.sums.script_work += _measure_balance(ledger) - previous


def _measure_balance(ledger):
    """Energy less work plus losses [fJ], which steps do not change."""
    m = ledger.measure()
    return float(np.asarray(m.energy - m.kick - m.work + m.lost))
