"""Continuation of a simulation with another stiffness, and with steps of another length.

Positions, velocities, rolling displacements and twist stay. A sliding displacement is scaled so
that its force stays, and grains at rest have the same distance. Loaded contacts relax. The energy
of the contacts changes at that moment; the difference is in the ledger, as work. Velocities and
spins are half a step back: the current loads bring them to the whole step, and back by half of the
new one. Speeds of half a step back, which effects return (`halved`), belong to the step as well.
"""

import numpy as np

from dusttaichi.grains.build import chosen_numbers
from dusttaichi.grains.contacts import distances, edges_between
from dusttaichi.grains.grain_contacts import farthest_contacts, scaled
from dusttaichi.grains.load_sums import load_sums
from dusttaichi.grains.measure import half_kicks, measurement, set_back, wall_work
from dusttaichi.grains.pointers import touching, unit
from dusttaichi.grains.time_step import chosen_step

SLICES = 2**30  # of a step: a pass over the contacts takes one, in which nothing moves


def contact_pairs(sim):
    """(rows of the state, first and second grain, distance vector [um]) of all listed pairs.

    Those with the sphere are included.
    """
    i, j = sim.state.pairs()
    rows = np.arange(len(i))
    if sim.sphere is not None:
        own, grain, sphere = sim.state.on_sphere()
        rows = np.concatenate([rows, own])
        i, j = np.concatenate([i, grain]), np.concatenate([j, np.full(len(grain), sphere)])
    return rows, i, j, distances(sim, rows, i, j)


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
        dv -= sim.cell.speeds_across(edges_between(sim, rows), sim.time - 0.5 * new)
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
    contact = {name: history[rows, first] for name, (first, _) in layout.rows.items()}
    for law in layout.model.laws:
        if hasattr(law, "halved"):
            for name, values in law.halved(contact, touches[rows], *speeds).items():
                history[rows, layout.rows[name][0]] = values


def with_stiffness(scene, scale):
    """The scene with another numerics.stiffness_scaling."""
    numerics = scene.numerics.model_copy(update={"stiffness_scaling": scale})
    return scene.model_copy(update={"numerics": numerics})


def steps_of_stages(scene, sample, own):
    """stiffness_scaling -> TimeStep, of all values in the stages of a scene.

    Arguments as of `chosen_step`. Raises DustError for a step that one of them cannot take.
    """
    return {
        scale: chosen_step(with_stiffness(scene, scale), sample, own)
        for scale in dict.fromkeys(scene.stiffnesses)
    }


def take_numbers(sim, scene):
    """Give a Simulation the contact constants of a scene of the same parts."""
    scene, own = scaled(scene), sim.polydisperse
    contacts = farthest_contacts(scene, own)
    sim.pair, sim.wall, on_sphere, table = chosen_numbers(scene, sim.layout.model, own, contacts)
    if sim.sphere is not None:
        sim.sphere.contact = on_sphere
    if table is not None:
        sim.scratch["interfaces"].from_numpy(table)
    sim.state.put_numbers(sim.pair, sim.wall, on_sphere)


def change_stiffness(sim, scene, dt):
    """Continue `sim` (a Simulation) with the contact constants of a scene and a step of about dt.

    dt [us]: of the new step, no longer than that of before; it is shortened a little, so that whole
    steps lead to the current time.
    """
    scale = scene.numerics.stiffness_scaling
    before = measurement(sim)
    kick, turn = half_kicks(sim)
    sums, loads = sim.ledger_sums, load_sums(sim)
    impulse = loads.impulses()
    sums.wall_work, sums.impulse = wall_work(sim, loads.wall_force(), impulse), impulse
    if sim.sphere is not None:
        load, impulse = sim.sphere.load()[0], sim.sphere.impulses()[:3]
        sums.sphere_work, sums.sphere_impulse = sim.sphere.work(load, impulse), impulse
    sim.state.stiffen(sim.stiffness / scale)
    sim.stiffness = scale
    take_numbers(sim, scene)
    sim.search.now(sim.step)

    state, time = sim.state, sim.time
    v, w = state.of_grains("v") + kick, state.of_grains("w") + turn
    sim.step = int(-(-time // dt))
    sim.dt = time / sim.step
    pairs, walls = contact_pairs(sim), state.wall_lanes()
    state["v"], state["w"] = v, w
    set_speeds(sim, pairs, walls, state["v"], 0.0)
    _pass_in_no_time(sim)
    set_back(sim, v, w)
    set_speeds(sim, pairs, walls, state["v"], sim.dt)

    sums.wall_force = load_sums(sim).wall_force()
    if sim.sphere is not None:
        sums.sphere_force = sim.sphere.load()[0]
    sums.face_jumps += before.parts["face_work"] - measurement(sim).parts["face_work"]
    sums.stiffness_work += _residual(measurement(sim)) - _residual(before)


def _residual(m):
    """Energy of a Measurement that its work and losses do not account for (run.ledger) [fJ]."""
    return m.energy - m.kick - m.work + m.lost


def _pass_in_no_time(sim):
    """Contacts form and break as they are now, and their loads are the current ones."""
    step = sim.step
    sim.step = SLICES * step - 1
    try:
        sim._call(1, 1, sim.dt / SLICES)
    finally:
        sim.step = step
