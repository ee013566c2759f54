"""A simulation goes on at half its time step, from exactly the state it is in.

Positions, contact pointers and twist stand at a whole step and stay. Velocities and spins stand
half a step back: they are carried to the whole step by the loads of now and set back by half of the
new step. Of a contact three numbers belong to the step as well: its normal speed half a step back,
and the speed and the impulse of a first touch on asperities, which acts as a force over one step.
"""

import copy
from dataclasses import replace

import numpy as np

from dusttaichi.grains.kept import touching, unit
from dusttaichi.names import NEVER


def halve_time_step(sim):
    """Make `sim` (a Simulation) go on at half its step, and count its steps accordingly.

    Its time, its measurements and what its surroundings do stay as they are.
    """
    old, new, n = sim.dt, 0.5 * sim.dt, sim.grains
    v, w = sim.state["v"], sim.state["w"]
    force, torque = sim.loads()
    v[:n] += 0.5 * old / sim.mass * force
    w[:n] += 0.5 * old / sim.inertia * torque
    pairs, walls = _pairs(sim), sim.state.wall_lanes()
    if sim.sphere is not None:
        v[sim.sphere.row], w[sim.sphere.row] = sim.sphere.now()[1:]
    if sim.layout.asperities:
        _strike_in(sim, (pairs, walls), old, new)
        force, torque = sim.loads()
    v[:n] -= 0.5 * new / sim.mass * force
    w[:n] -= 0.5 * new / sim.inertia * torque
    sim.state["v"], sim.state["w"] = v, w
    sim.dt, sim.step = new, 2 * sim.step
    if sim.sphere is not None:
        sim.sphere.set_back()
    _set_speeds(sim, pairs, walls, sim.state["v"], new)
    sim.search.searched_at *= 2
    sim.push = _later(sim.push)
    sim.servo = None if sim.servo is None else sim.servo.halved()
    sim.search.ask()  # when a face has gone its part of the skin is counted in steps


def _later(push):
    """The same pushes, whose ends are counted in steps of half the length."""
    push = copy.copy(push)
    push.forces = tuple(
        force if force.end == NEVER else replace(force, end=2 * force.end) for force in push.forces
    )
    return push


def _pairs(sim):
    """(rows of the state, first and second grain, distance vector [um]) of all listed pairs, those
    with the sphere included."""
    i, j = sim.state.pairs()
    rows = np.arange(len(i))
    if sim.sphere is not None:
        own, grain, ball = sim.state.on_sphere()
        rows = np.concatenate([rows, np.arange(own.start, own.stop)])
        i, j = np.concatenate([i, grain]), np.concatenate([j, np.full(len(grain), ball)])
    return rows, i, j, sim.distances(rows, i, j)


def _strike_in(sim, contacts, old, new):
    """Forces of first touches act over a step of the new length, with the same impulse."""
    (rows, _, _, d), walls = contacts
    state, load = sim.state.lanes("state"), sim.state.lanes("load")
    change = state[:, sim.layout.graze + 1, None] * (1.0 / new - 1.0 / old)
    push = change[rows] * unit(d)
    load[rows, :3] += push
    load[rows, 6:9] -= push
    if walls is not None:
        rows, _, wall = walls
        load[rows, :3] += change[rows] * sim.box.normal[wall]
    sim.state.put_lanes("load", load)


def _set_speeds(sim, pairs, walls, v, new):
    """Normal speeds of contacts half a step back, as kernels.contacts has them."""
    layout = sim.layout
    if not (layout.damping or layout.asperities):
        return
    state = sim.state.lanes("state")
    touches = touching(layout, state)
    rows, i, j, d = pairs
    dv = v[i] - v[j]
    if sim.cell is not None:
        dv -= sim.cell.speeds_across(sim.edges_between(rows), sim.time - 0.5 * new)
    back = unit(d - 0.5 * new * dv)
    u = np.sum(dv * back, axis=1), np.sum(dv * unit(d), axis=1)
    _put_speeds(layout, state, touches, rows, u)
    if walls is not None:
        rows, grain, wall = walls
        u = np.sum(v[grain] * sim.box.normal[wall], axis=1) - sim.box.speed[wall]
        _put_speeds(layout, state, touches, rows, (u, u))
    sim.state.put_lanes("state", state)


def _put_speeds(layout, state, touches, rows, speeds):
    """speeds: along n_c, half a step back and now."""
    back, now = speeds
    if layout.damping:
        state[rows, layout.approach] = touches[rows] * back
    if layout.asperities:
        struck = state[rows, layout.graze + 1] != 0.0
        state[rows, layout.graze] = np.where(struck, now, 0.0)
