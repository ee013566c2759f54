"""Forces and velocities that a script sets between steps; the ledger counts them as work."""

from contextlib import contextmanager

import numpy as np

from dusttaichi import units
from dusttaichi.grains.measure import measurement, set_back, velocities


def set_forces(sim, forces):
    """Force on every grain from now on [N], (N, 3), in the sample's order."""
    with _as_work(sim):
        v, w = velocities(sim)
        sim.fields["script_force"].from_numpy(forces[sim.order] / units.FORCE)
        set_back(sim, v, w)


def set_velocities(sim, velocity, spin):
    """Velocities [m/s] and spins [rad/s] of all grains now, (N, 3), in the sample's order.

    None leaves them as they are. Grains that are carried keep their own.
    """
    with _as_work(sim):
        state = velocities(sim)
        carried = sim.push.carried_grains
        for own, new, unit in zip(state, (velocity, spin), (units.SPEED, units.SPIN), strict=True):
            if new is not None:
                before = own[carried].copy()
                own[:] = new[sim.order] / unit
                if unit == units.SPEED and sim.cell is not None:
                    x = sim.state.of_grains("x")
                    own += sim.cell.speeds_across(sim.cell.outside(x, sim.time), sim.time)
                own[carried] = before
        set_back(sim, *state)


@contextmanager
def _as_work(sim):
    """Context in which a change of the state is work from outside: the ledger continues."""
    before = _balance(sim)
    yield
    sim.ledger_sums.script_work += _balance(sim) - before


def _balance(sim):
    """Energy less work plus losses, which the steps of a run leave as it is [fJ]."""
    m = measurement(sim)
    return float(np.asarray(m.energy - m.kick - m.work + m.lost))
