"""Measurements of a Simulation: energies, loads, grains. They read its state and change nothing.

Internal units; (N, ...) arrays of grains are in the sample's order unless said otherwise.
"""

import numpy as np

from dusttaichi.compute.scan import CHUNK
from dusttaichi.grains.forces import accelerations, energies_since
from dusttaichi.grains.kernels.measure import (
    ANGULAR,
    FASTEST,
    FASTEST_SPIN,
    KICK,
    LINEAR,
    Columns,
)
from dusttaichi.grains.kernels.store import FIRST_SPHERE, ON_SPHERE
from dusttaichi.grains.load_sums import load_sums
from dusttaichi.method import Measurement


def energies(sim):
    """Energies [fJ], counts and extremes of the present moment, as a dict of numbers."""
    half = 0.5 * sim.dt
    mass, inertia = sim.unit_mass, sim.unit_inertia
    sim.kernels.measure_grains(mass, inertia, half / mass, half / inertia, sim.step)
    arguments = sim.step, sim.dt, sim.walls_argument
    sim.kernels.measure_pairs(*arguments)
    # those of a larger scene, which the kernels have served before, may stand behind
    grains = sim.sums["grain_sum"].to_numpy(-(-sim.grains // CHUNK))
    columns = Columns(sim.layout)
    pairs = _contact_sums(sim, "pair_sum", sim.state.pair_count)
    out = {
        "kinetic_translation": grains[:, LINEAR].sum(),
        "kinetic_rotation": grains[:, ANGULAR].sum(),
        "kinetic_kick": grains[:, KICK].sum(),
        "largest_speed": grains[:, FASTEST].max(),
        "largest_spin": grains[:, FASTEST_SPIN].max(),
        "wall_work": 0.0,
        "face_work": 0.0,
        "push_work": _push_work(sim),
        "gravity_work": 0.0,
        "force_work": 0.0,
    }
    if sim.cell is not None:
        ends = sim.ledger_sums.face_power - pairs[:, columns.faces].sum()
        work = sim.state["face_work"].sum() + half * ends + sim.ledger_sums.face_jumps
        moved = _energy_of_images(sim)
        out["kinetic_translation"] += moved
        out["face_work"] = float(work + sim.state["wrap_work"].sum() + moved)
    out |= _of_sphere(sim)
    out["kinetic_kick"] += out["sphere_kick"]
    walls = on_sphere = np.zeros((0, columns.count))
    if sim.box is not None:
        sim.kernels.measure_walls(*arguments)
        loads = load_sums(sim)
        out["wall_work"] = wall_work(sim, loads.wall_force(), loads.impulses())
        walls = _contact_sums(sim, "wall_sum", sim.state.wall_blocks * sim.layout.width)
    if sim.sphere is not None:
        on_sphere = _contact_sums(sim, "sphere_sum", int(sim.state["counts"][ON_SPHERE]))
    tables = (("", "", pairs), ("wall_", "_wall", walls), ("sphere_", "_sphere", on_sphere))
    for n, (prefix, behind, sums) in enumerate(tables):
        out[f"{prefix}contacts"] = int(round(sums[:, columns.contacts].sum()))
        out[f"potential{behind}"] = sums[:, columns.potential].sum(axis=0)
        out[f"loss{behind}"] = _losses(sim, n, sums[:, columns.pending])
    if sim.outside is not None:
        gravity, force, losses = energies_since(sim, sim.forces_at_start)
        out["gravity_work"] = gravity
        out["force_work"] = force + sim.ledger_sums.script_work
        for channel, lost in losses.items():
            out["loss"][sim.layout.channels.index(channel)] += lost
    every = np.concatenate([pairs, walls, on_sphere])
    out["largest_overlap"] = every[:, columns.deepest].max(initial=0.0)
    out["largest_strain"] = every[:, columns.strain].max(initial=0.0)
    return out


def measurement(sim):
    """The Measurement of a Simulation now; its parts are its `energies`."""
    m = energies(sim)
    kinetic = m["kinetic_translation"] + m["kinetic_rotation"] + m["sphere_kinetic"]
    # added up in this order everywhere: the ledger is a small difference of large numbers
    on_sphere = m["potential_sphere"].sum()
    energy = kinetic + m["potential"].sum() + m["potential_wall"].sum() + on_sphere
    work = m["wall_work"] + m["face_work"] + m["push_work"] + m["gravity_work"]
    return Measurement(
        kinetic=kinetic,
        potential=m["potential"].sum() + m["potential_wall"].sum() + on_sphere,
        energy=energy,
        losses=m["loss"] + m["loss_wall"] + m["loss_sphere"],
        lost=m["loss"].sum() + m["loss_wall"].sum() + m["loss_sphere"].sum(),
        work=work + m["sphere_work"] + m["force_work"],
        kick=m["kinetic_kick"],
        bound=_bound(sim, m),
        parts=m,
    )


def _bound(sim, m):
    """Binding energy of the current contacts [fJ]: at rest (JKR), or current if polydisperse."""
    if sim.polydisperse is None:
        bound = sim.pair.bound * m["contacts"] + sim.wall.bound * m["wall_contacts"]
        if sim.sphere is not None:
            bound += sim.sphere.contact.bound * m["sphere_contacts"]
        return bound
    return -(m["potential"][0] + m["potential_wall"][0] + m["potential_sphere"][0])


def loads(sim, present=False):
    """Force [nN] and torque [nN um] that move every grain, (N, 3) each, in internal order.

    present: velocities and spins in memory are those of the positions, not half a step back.
    """
    loads = contact_loads(sim)
    if sim.outside is not None:
        linear, angular = accelerations(sim, present)
        loads[0] += sim.mass * linear[: sim.grains]
        loads[1] += sim.inertia * angular[: sim.grains]
    return sim.push.on(loads, sim.step)


def half_kicks(sim, present=False):
    """Changes of velocity and of spin in half a step by the current loads, (N, 3), internal order.

    present: see `loads`.
    """
    (force, torque), half = loads(sim, present), 0.5 * sim.dt
    return half / sim.mass * force, half / sim.inertia * torque


def velocities(sim):
    """Velocities and spins now, (N, 3) each, in internal order."""
    kick, turn = half_kicks(sim)
    return sim.state.of_grains("v") + kick, sim.state.of_grains("w") + turn


def set_back(sim, v, w):
    """Put current velocities and spins into memory."""
    if sim.outside is not None:  # which may depend on them
        sim.state["v"], sim.state["w"] = v, w
    kick, turn = half_kicks(sim, present=True)
    sim.state["v"], sim.state["w"] = v - kick, w - turn


def contact_loads(sim):
    """Force [nN] and torque [nN um] of the contacts alone on every grain, (2, N, 3)."""
    owner, contact, second = sim.state.listed_contacts()
    (block, lane), load = np.divmod(contact, sim.layout.width), sim.fields["load"]
    out = np.empty((2, sim.grains, 3))
    # one column after another, which takes little memory
    for n in range(3):
        force = load.take(block, n, lane) * (1 - 2 * second)
        torque = load.take(block, 3 + 3 * second + n, lane)
        for component, own in enumerate((force, torque)):
            out[component, :, n] = np.bincount(owner, weights=own, minlength=sim.grains)
    return out


def wall_work(sim, force, impulse):
    """Work of the walls since the start, with their current force and impulse."""
    if sim.box is None:
        return 0.0
    # the force of a step acts half before and half after it
    wall_impulse = (
        impulse - sim.ledger_sums.impulse + 0.5 * sim.dt * (sim.ledger_sums.wall_force - force)
    )
    return sim.ledger_sums.wall_work + float(np.sum(sim.box.velocity * wall_impulse))


def face_power(sim):
    """Power of the moving faces now [fJ/us]."""
    if sim.cell is None:
        return 0.0
    return sim.cell.power(load_sums(sim).across_faces(), sim.time)


def _push_work(sim):
    """Work of the pushes since the start."""
    if not sim.push.works:
        return 0.0
    impulse = sim.state["carried_impulse"] if "carried_impulse" in sim.state else None
    work = sim.push.work(sim.state["x"], impulse, contact_loads(sim)[0], sim.step, sim.dt)
    return sim.ledger_sums.push_work + work


def _of_sphere(sim):
    """Energies of the sphere itself; zeros without one."""
    if sim.sphere is None:
        return dict.fromkeys(("sphere_kinetic", "sphere_kick", "sphere_work"), 0.0)
    load = sim.sphere.load()
    kinetic, kick = sim.sphere.energies(load)
    work = sim.sphere.work(load[0], sim.sphere.impulses()[:3])
    return {
        "sphere_load": load,
        "sphere_kinetic": kinetic,
        "sphere_kick": kick,
        "sphere_work": work,
    }


def _contact_sums(sim, name, contacts):
    """Sums over that many contacts, which the last measurement has filled, (tiles, columns)."""
    return sim.sums[name].to_numpy(-(-contacts // (sim.layout.width * sim.layout.tile)))


def _losses(sim, kind, pending):
    """Losses by channel up to now in contacts of a kind: 0 pairs, 1 walls, 2 the sphere.

    pending: those of this step that belong to the time before it, (tiles, channels).
    """
    table = sim.state["wall_loss" if kind == 1 else "loss"] if kind != 1 or sim.box else None
    if table is None or (kind == 2 and sim.sphere is None):
        return np.zeros(len(sim.layout.channels))
    if kind != 1 and sim.sphere is not None:
        first = int(sim.state["counts"][FIRST_SPHERE]) // sim.layout.tile
        table = table[first:] if kind == 2 else table[:first]
    return table.sum(axis=0) + pending.sum(axis=0) - np.array(sim.ledger_sums.pending[kind])


def _energy_of_images(sim):
    """Change of the kinetic energy where grains outside a moving cell are at their images [fJ].

    Grains that have left the cell since the last search are taken at their images inside, as in
    snapshots.
    """
    if not sim.cell.speeds(sim.time).any() and not sim.cell.tilt_rate:
        return 0.0
    # positions and velocities of the followed images
    x, (v, _) = sim.state.of_grains("x"), velocities(sim)
    shift = sim.cell.speeds_across(sim.cell.outside(x, sim.time), sim.time)
    return float(np.sum(0.5 * sim.mass * (shift - 2.0 * v) * shift))


def grain_state(sim):
    """Positions [um], velocities [um/us], spins [rad/us] now, (N, 3), in the sample's order.

    In a cell those of the image inside, which moves with the edges.
    """
    x, (v, w) = sim.state.of_grains("x"), velocities(sim)
    if sim.cell is not None:
        out_of = sim.cell.outside(x, sim.time)
        x = x - sim.cell.across(out_of, sim.time)
        v = v - sim.cell.speeds_across(out_of, sim.time)
    out = np.empty((3, sim.grains, 3))
    for destination, values in zip(out, (x, v, w), strict=True):
        destination[sim.order] = values
    return out


def positions(sim):
    """Positions of the grains [um], (N, 3), as `grain_state` has them."""
    x, out = sim.state.of_grains("x"), np.empty((sim.grains, 3))
    if sim.cell is not None:
        x = x - sim.cell.across(sim.cell.outside(x, sim.time), sim.time)
    out[sim.order] = x
    return out


def grain_losses(sim):
    """Energy lost in the contacts of each grain since the start [fJ], (N, channels).

    Grains are in the sample's order. Two grains share the loss; at a wall or the sphere it is
    the grain's.
    """
    sim.kernels.add_grain_losses()
    out = np.empty((sim.grains, len(sim.layout.channels)))
    out[sim.order] = sim.state["grain_loss"]
    return out


def nearest_to_walls(sim):
    """(distance [um], grain, wall) of the centre that is nearest to its wall, or beyond it most.

    The grain is that of the sample; distances are negative beyond the wall.
    """
    x, offsets = sim.state.of_grains("x"), sim.box.offsets(sim.time)
    nearest = np.inf, -1, -1
    for wall in np.flatnonzero(sim.box.present):
        distance = x @ sim.box.normal[wall] - offsets[wall]
        grain = int(np.argmin(distance))
        nearest = min(nearest, (float(distance[grain]), int(sim.order[grain]), int(wall)))
    return nearest
