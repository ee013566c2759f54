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
    radii = sim.grain_radii[sim.order]
    on, state, normal, columns = touching_pairs(
        sim, np.arange(len(i)), (i, j), (radii[i], radii[j])
    )
    i, j = i[on], j[on]
    radii_pair = radii[i][:, None], radii[j][:, None]
    first, second = pair_pointers(sim.layout, state, normal, radii_pair)
    columns |= {"grain_i": sim.order[i], "grain_j": sim.order[j]}
    return columns | {"pointer_i": first, "pointer_j": second}


def touching_pairs(sim, rows, bodies, radii):
    """(which of the pairs in these rows of `lanes` touch, their histories, normals, a dict).

    bodies: numbers of the first and the second body of each pair; radii [um]: of both. In the dict
    are the overlap, the loads and their parts, and what of the history the result has.
    """
    state, load = (sim.state.rows_of(table_name, rows) for table_name in ("history", "load"))
    on = touching(sim.layout, state)
    rows, state, (r1, r2) = rows[on], state[on], (r[on] for r in radii)
    d = distances(sim, rows, *(body[on] for body in bodies))
    distance = np.linalg.norm(d, axis=1)
    load = load[on].astype(float)
    load, normal = (load[:, :3], load[:, 3:6], load[:, 6:9]), d / distance[:, None]
    columns = {"overlap": r1 + r2 - distance, "force": load[0]}
    columns |= {"torque_i": load[1], "torque_j": load[2]}
    return on, state, normal, columns | pair_parts(normal, load, (r1, r2)) | history_of(sim, state)


def wall_contact_state(sim):
    """Contacts with walls now, a dict of arrays; feet and overlaps in um.

    force [nN], torque [nN um]: on the grain, and the parts of these (physics.contact.parts).
    """
    blocks, grain, wall = sim.state.wall_lanes()
    state, load = (sim.state.rows(table_name, blocks) for table_name in ("history", "load"))
    on = touching(sim.layout, state)
    grain, wall, state = grain[on], wall[on], state[on]
    load = load[on].astype(float)
    x, normal = sim.state["x"][grain], sim.box.normal[wall]
    radius = sim.grain_radii[sim.order[grain]]
    # foot points are those on the wall, wherever it has gone along itself
    way = sim.box.tangential_displacements(sim.time)[wall]
    pointer, foot = wall_pointers(sim.layout, state, (x - way, radius[:, None], normal))
    offset = sim.box.offsets(sim.time)[wall]
    # what follows from the history has the overlap in it: the foot is a point of the plane
    foot += (offset - np.sum(foot * normal, axis=1))[:, None] * normal
    distance = np.sum(x * normal, axis=1) - offset
    columns = {"grain": sim.order[grain], "wall": wall, "pointer": pointer}
    columns |= {"force": load[:, :3], "torque": load[:, 3:6], "foot": foot + way}
    components = wall_parts(normal, (columns["force"], columns["torque"]), radius)
    return columns | {"overlap": radius - distance} | components | history_of(sim, state)


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
    if len(rows):
        blocks = sim.state.blocks_of(rows)
        shift = sim.state.lanes("shift", blocks)[rows - blocks.start * sim.layout.width]
        out[:, list(sim.cell.axes)] = shift
    return out


def touch(sim, i, j):
    """Distance of the centres of these grains (the sample's numbers) at first touch [um]."""
    radii = sim.grain_radii
    return radii[i] + radii[j]


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
