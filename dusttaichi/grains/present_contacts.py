"""Present contacts of the grains: pointers, overlaps, forces, histories. Internal units."""

import numpy as np

from dusttaichi.grains.kernels.store import PLANES
from dusttaichi.grains.pointers import pair_pointers, touching, wall_pointers
from dusttaichi.grains.wall_geometry import normals_at, offsets_at, reduced_radii_at
from dusttaichi.physics.contact.parts import PARTS, pair_parts, wall_parts
from dusttaichi.physics.geometry import dot_rows, measure_rows


class Contacts:
    """Contacts of the grains of a GrainState with each other, with walls and with the sphere.

    state: GrainState. bodies: GrainBodies. environment: GrainEnvironment.
    """

    def __init__(self, state, bodies, environment):
        self._state, self._bodies, self._environment = state, bodies, environment

    @property
    def grain_count(self):
        return self._bodies.count

    def restore(self, sample, scaling):
        """Put histories of contacts that a Sample has into fields; a search has listed their pairs.

        scaling: numerics.stiffness_scaling of the scene.
        """
        state, radii = self._state, self._bodies.grain_radii
        if sample.contacts is not None:
            i, j = state.pairs()
            state.take_contacts(sample.contacts, self.distances(np.arange(len(i)), i, j), radii)
        if sample.wall_contacts is not None:
            domain = self._environment.domain

            def geometry(wall, x, radius):
                return normals_at(domain, wall, x, 0.0), reduced_radii_at(domain, wall, radius)

            state.take_wall_contacts(sample.wall_contacts, radii, geometry)
        if (ratio := sample.info.get("stiffness_scaling", 1.0) / scaling) != 1.0:
            state.stiffen(ratio)

    # -- between grains --------------------------------------------------------------------------

    def measure_pairs(self, names=PARTS):
        """Contacts between grains now, a dict of arrays; grains by the sample's numbers.

        force [nN]: on the first grain; torque_i, torque_j [nN um]: on both; and those parts of
        these (physics.contact.parts) that are among the names.
        """
        state, (i, j) = self._state, self._state.pairs()
        radii = self._bodies.grain_radii[state.order]
        touch, history, normal, contacts = self._measure_touching(
            np.arange(len(i)), (i, j), (radii[i], radii[j]), names
        )
        i, j = i[touch], j[touch]
        both_radii = radii[i][:, None], radii[j][:, None]
        first, second = pair_pointers(state.layout, history, normal, both_radii)
        contacts |= {"grain_i": state.order[i], "grain_j": state.order[j]}
        return contacts | {"pointer_i": first, "pointer_j": second}

    def _measure_touching(self, rows, bodies, radii, names):
        """(numbers of the pairs in these rows of `lanes` that touch, histories, normals, a dict).

        bodies: numbers of the first and the second body of each pair; radii [um]: of both. In the
        dict are the overlap, the loads and their parts of these names, and the numbers of the
        history that are in the result.
        """
        layout = self._state.layout
        history, load = (self._state.rows_of(name, rows) for name in ("history", "load"))
        touch = np.flatnonzero(touching(layout, history))
        rows, (r1, r2) = rows[touch], (r[touch] for r in radii)
        # sooner than by an index
        history, load = (values.take(touch, axis=0) for values in (history, load))
        d = self.distances(rows, *(body[touch] for body in bodies))
        distance = measure_rows(d)
        load = load.astype(float, copy=False)
        load, normal = (load[:, :3], load[:, 3:6], load[:, 6:9]), d / distance[:, None]
        contacts = {"overlap": r1 + r2 - distance, "force": load[0]}
        contacts |= {"torque_i": load[1], "torque_j": load[2]}
        contacts |= pair_parts(normal, load, (r1, r2), names)
        return touch, history, normal, contacts | name_history(layout, history)

    def distances(self, rows, i, j):
        """Distance vectors from grains j to i now [um], of the pairs in these rows of `lanes`."""
        x, cell = self._state["x"], self._environment.cell
        d = x.take(i, axis=0)
        d -= x.take(j, axis=0)
        if cell is not None:
            d -= cell.across(self.crossed_edges(rows), self._environment.time)
        return d

    def crossed_edges(self, rows):
        """Edges of the cell from the second grains to the first of pairs in these rows, (n, 3)."""
        out = np.zeros((len(rows), 3))
        if len(rows):
            state = self._state
            blocks = state.blocks_of(rows)
            shift = state.lanes("shift", blocks)[rows - blocks.start * state.layout.width]
            out[:, list(self._environment.cell.axes)] = shift
        return out

    def smaller_radius(self, i, j):
        """Radius of the smaller of two grains (by the sample's numbers) [um]."""
        radii = self._bodies.grain_radii
        return np.minimum(radii[i], radii[j])

    # -- with walls and the sphere ---------------------------------------------------------------

    def measure_walls(self, names=PARTS):
        """Contacts with walls now, a dict of arrays; feet and overlaps in um.

        force [nN], torque [nN um]: on the grain; names: see `measure_pairs`.
        """
        state, layout, domain = self._state, self._state.layout, self._environment.domain
        blocks, grain, wall = state.wall_lanes()
        history, load = (state.rows(name, blocks) for name in ("history", "load"))
        touch = touching(layout, history)
        grain, wall, history = grain[touch], wall[touch], history[touch]
        load = load[touch].astype(float)
        x, time = state["x"][grain], self._environment.time
        normal = normals_at(domain, wall, x, time)
        radius = self._bodies.grain_radii[state.order[grain]]
        # foot points move with a wall that moves along itself
        flat = (wall < PLANES)[:, None]
        slid = domain.box.tangential_displacements(time)[np.minimum(wall, PLANES - 1)]
        displacement = np.where(flat, slid, 0.0)
        reduced = reduced_radii_at(domain, wall, radius)
        geometry = x - displacement, radius[:, None], normal, reduced[:, None]
        pointer, foot = wall_pointers(layout, history, geometry)
        offset = offsets_at(domain, wall, x, time)
        # what follows from the history has the overlap in it: the foot is a point of the plane
        foot += (offset - dot_rows(foot, normal))[:, None] * normal
        distance = dot_rows(x, normal) - offset
        contacts = {"grain": state.order[grain], "wall": wall, "pointer": pointer}
        contacts |= {"force": load[:, :3], "torque": load[:, 3:6], "foot": foot + displacement}
        loads = contacts["force"], contacts["torque"]
        contacts |= {"overlap": radius - distance} | wall_parts(normal, loads, radius, names)
        return contacts | name_history(layout, history)

    def measure_sphere(self, radius, names=PARTS):
        """Grains that touch the rigid sphere of that radius [um] now, a dict of arrays.

        grain (C,), by the sample's numbers; overlap [um]; force [nN] and torque [nN um] on the
        grain (C, 3), and loss [fJ] by channel where it is followed; names: see `measure_pairs`.
        """
        rows, grain, sphere = self._state.on_sphere()
        number, second = self._state.order[grain], np.full(len(grain), sphere)
        radii = self._bodies.grain_radii[number], np.full(len(grain), radius)
        touch, _, _, contacts = self._measure_touching(rows, (grain, second), radii, names)
        return contacts | {"grain": number[touch], "torque": contacts["torque_i"]}


def name_history(layout, history):
    """Histories of contacts (contacts, rows), by the names of the result, in internal units.

    Losses [fJ] where they are followed. Zeros for numbers that the scene does not have.
    """
    zero, rows = np.zeros(len(history)), layout.rows
    out = {"twist": zero, "approach": zero}
    for name, declared in layout.model.history.items():
        if declared.result:
            first, width = rows[name]
            values = declared.sign * history[:, first : first + width]
            out[declared.result] = values if width > 1 else values[:, 0]
    if "lost" in rows:
        first, width = rows["lost"]
        out["loss"] = history[:, first : first + width]
    return out
