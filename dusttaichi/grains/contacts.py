"""Contacts of a Simulation at the moment: pointers, overlaps, forces, histories. Internal units."""

import numpy as np

from dusttaichi.grains.pointers import pair_pointers, touching, wall_pointers
from dusttaichi.physics.contact.parts import pair_parts, wall_parts


def contact_state(sim):
    """Contacts between grains now, a dict of arrays; grains by the sample's numbers.

    force [nN]: on the first grain; torque_i, torque_j [nN um]: on both, and the parts of these
    (physics.contact.parts).
    """
    i, j = sim.state.pairs()
    state = sim.state.rows("history")[: len(i)]
    on = touching(sim.layout, state)
    i, j, state = i[on], j[on], state[on]
    d = distances(sim, np.flatnonzero(on), i, j)
    distance = np.linalg.norm(d, axis=1)
    load = sim.state.rows("load")[: len(on)][on].astype(float)
    load, normal = (load[:, :3], load[:, 3:6], load[:, 6:9]), d / distance[:, None]
    i, j = sim.order[i], sim.order[j]
    radii = np.broadcast_to(sim.radii, sim.grains)
    own = radii[i][:, None], radii[j][:, None]
    first, second = pair_pointers(sim.layout, state, normal, own)
    return {
        "grain_i": i,
        "grain_j": j,
        "pointer_i": first,
        "pointer_j": second,
        "overlap": touch(sim, i, j) - distance,
        "force": load[0],
        "torque_i": load[1],
        "torque_j": load[2],
        **pair_parts(normal, load, (radii[i], radii[j])),
        **history_of(sim, state),
    }


def wall_contact_state(sim):
    """Contacts with walls now, a dict of arrays; feet and overlaps in um.

    force [nN], torque [nN um]: on the grain, and the parts of these (physics.contact.parts).
    """
    rows, grain, wall = sim.state.wall_lanes()
    state = sim.state.rows("history")[rows]
    on = touching(sim.layout, state)
    grain, wall, state = grain[on], wall[on], state[on]
    load = sim.state.rows("load")[rows][on].astype(float)
    x, normal = sim.state["x"][grain], sim.box.normal[wall]
    radius = np.broadcast_to(sim.radii, sim.grains)[sim.order[grain]]
    # foot points are those on the wall, wherever it has gone along itself
    way = sim.box.tangential_displacements(sim.time)[wall]
    pointer, foot = wall_pointers(sim.layout, state, (x - way, radius[:, None], normal))
    offset = sim.box.offsets(sim.time)[wall]
    # what follows from the history has the overlap in it: the foot is a point of the plane
    foot += (offset - np.sum(foot * normal, axis=1))[:, None] * normal
    distance = np.sum(x * normal, axis=1) - offset
    found = {"grain": sim.order[grain], "wall": wall, "pointer": pointer}
    found |= {"force": load[:, :3], "torque": load[:, 3:6], "foot": foot + way}
    parts = wall_parts(normal, (found["force"], found["torque"]), radius)
    return found | {"overlap": radius - distance} | parts | history_of(sim, state)


def distances(sim, rows, i, j):
    """Distance vectors from grains j to i now [um], of the pairs in these rows of `lanes`."""
    x = sim.state["x"]
    d = x[i] - x[j]
    if sim.cell is not None:
        d -= sim.cell.across(edges_between(sim, rows), sim.time)
    return d


def edges_between(sim, rows):
    """Edges of the cell from the second grains to the first of pairs in these rows, (n, 3)."""
    out = np.zeros((len(rows), 3))
    out[:, list(sim.cell.axes)] = sim.state.lanes("shift")[rows]
    return out


def touch(sim, i, j):
    """Distance of the centres of these grains (the sample's numbers) at first touch [um]."""
    if sim.polydisperse is None:
        return 2.0 * sim.radius
    return sim.radii[i] + sim.radii[j]


def history_of(sim, history):
    """Histories of contacts, by the names of the result, in internal units.

    Losses [fJ] where they are followed. Zeros for numbers that the scene does not have.
    """
    zero, rows = np.zeros(len(history)), sim.layout.rows
    out = {"twist": zero, "approach": zero}
    for name, declared in sim.layout.model.history.items():
        if declared.result:
            first, width = rows[name]
            values = declared.sign * history[:, first : first + width]
            out[declared.result] = values if width > 1 else values[:, 0]
    if "lost" in rows:
        first, width = rows["lost"]
        out["loss"] = history[:, first : first + width]
    return out
