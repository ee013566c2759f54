"""A simulation goes on at half its time step, from exactly the state it is in.

Positions, contact pointers and twist stand at a whole step and stay. Velocities and spins stand
half a step back: they are carried to the whole step by the loads of now and set back by half of the
new step. Of a contact what belongs to the step as well are speeds of half a step back, which
effects give anew (`halved`), and impulses that act as a force over one step (`IMPULSE`).
"""

import copy
from dataclasses import replace

import numpy as np

from dusttaichi.grains.pointers import touching, unit
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
    pairs, walls = contact_pairs(sim), sim.state.wall_lanes()
    if sim.sphere is not None:
        v[sim.sphere.row], w[sim.sphere.row] = sim.sphere.now()[1:]
    impulses = [law.IMPULSE for law in sim.layout.model.laws if hasattr(law, "IMPULSE")]
    if impulses:
        _strike_in(sim, (pairs, walls), impulses, 1.0 / new - 1.0 / old)
        force, torque = sim.loads()
    v[:n] -= 0.5 * new / sim.mass * force
    w[:n] -= 0.5 * new / sim.inertia * torque
    sim.state["v"], sim.state["w"] = v, w
    sim.dt, sim.step = new, 2 * sim.step
    if sim.sphere is not None:
        sim.sphere.set_back()
    set_speeds(sim, pairs, walls, sim.state["v"], new)
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


def contact_pairs(sim):
    """(rows of the state, first and second grain, distance vector [um]) of all listed pairs, those
    with the sphere included."""
    i, j = sim.state.pairs()
    rows = np.arange(len(i))
    if sim.sphere is not None:
        own, grain, ball = sim.state.on_sphere()
        rows = np.concatenate([rows, np.arange(own.start, own.stop)])
        i, j = np.concatenate([i, grain]), np.concatenate([j, np.full(len(grain), ball)])
    return rows, i, j, sim.distances(rows, i, j)


def _strike_in(sim, contacts, impulses, change):
    """Impulses (names in the history) act over a step of the new length; change: of one over it."""
    (rows, _, _, d), walls = contacts
    history, load = sim.state.rows("history"), sim.state.rows("load")
    columns = [sim.layout.rows[name][0] for name in impulses]
    more = history[:, columns].sum(axis=1, keepdims=True) * change
    push = more[rows] * unit(d)
    load[rows, :3] += push
    if walls is not None:
        rows, _, wall = walls
        load[rows, :3] += more[rows] * sim.box.normal[wall]
    sim.state.put_rows("load", load)


def set_speeds(sim, pairs, walls, v, new):
    """Normal speeds of contacts half a step of the length `new` back, as kernels.contacts has them.

    pairs: as of `contact_pairs`; walls: WallLanes or None; v [um/us]: of that time.
    """
    layout = sim.layout
    if not any(hasattr(law, "halved") for law in layout.model.laws):
        return
    state = sim.state.rows("history")
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
    sim.state.put_rows("history", state)


def _put_speeds(layout, history, touches, rows, speeds):
    """speeds: along n_c, half a step back and now."""
    rows = np.arange(len(history))[rows]
    kept = {name: history[rows, first] for name, (first, _) in layout.rows.items()}
    for law in layout.model.laws:
        if hasattr(law, "halved"):
            for name, values in law.halved(kept, touches[rows], *speeds).items():
                history[rows, layout.rows[name][0]] = values
