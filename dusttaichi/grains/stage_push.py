"""Pushes that a stage brings: grains are kicked, pushed or carried from one step on."""

import numpy as np

from dusttaichi import samples, units
from dusttaichi.domain.pushes import at_stage, forces_and_speeds
from dusttaichi.geometry import rigid_rotation
from dusttaichi.grains.measure import contact_loads, grain_state, half_kicks


def push_anew(sim, entries):
    """The pushes of a Simulation's last stage end, and `entries` (scene.Push) begin.

    Velocities and spins are half a step back: they are brought to the current step by the loads
    that have acted, changed there, and set back by those that act from now on. The work of the
    pushes up to now, and the kinetic energy that the change itself gives or takes, go into the
    ledger sums.
    """
    state, (kick, turn) = sim.state, half_kicks(sim)
    v, w = state.of_grains("v") + kick, state.of_grains("w") + turn
    before = _kinetic(sim, v, w)
    contact, x = contact_loads(sim)[0], state["x"]
    impulse = state["carried_impulse"] if "carried_impulse" in state else None
    work = sim.push.work_of_stage(x, impulse, contact, sim.step, sim.dt)

    mass = np.broadcast_to(sim.mass, (sim.grains, 1))
    groups = _groups(sim, entries)
    forces, speeds = forces_and_speeds(entries, groups, sim.dt, sim.step)
    sim.push = sim.push.next_stage(at_stage(forces, x), speeds)
    sim.push.first = contact[sim.push.carried_grains]
    sim.push.place(sim.fields, sim.step)
    for entry, grains in zip(entries, groups, strict=True):
        if entry.velocity is not None:
            v[grains] += np.array(entry.velocity) / units.SPEED
        if entry.spin is not None:
            spin, own = np.array(entry.spin) / units.SPIN, mass[grains]
            v[grains] += rigid_rotation(spin, x[grains], own)
            w[grains] += spin
    v[sim.push.carried_grains], w[sim.push.carried_grains] = sim.push.velocity, 0.0

    kick, turn = half_kicks(sim)
    state["v"], state["w"] = v - kick, w - turn
    sim.ledger_sums.push_work += work + _kinetic(sim, v, w) - before


def _groups(sim, entries):
    """Internal numbers of the grains of each push; faces are the current ones."""
    x, rank = grain_state(sim)[0] * units.LENGTH, sim.state.rank
    radius = sim.radius * units.LENGTH
    return [
        rank[samples.group_of(f"drive.push[{n}]", entry, x, radius)]
        for n, entry in enumerate(entries)
    ]


def _kinetic(sim, v, w):
    """Kinetic energy of all grains [fJ]."""
    return 0.5 * float(np.sum(sim.mass * v**2) + np.sum(sim.inertia * w**2))
