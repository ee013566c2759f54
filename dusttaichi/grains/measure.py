"""Measurements of a simulation: energies, loads, stresses, grains, contacts.

Internal units; (N, ...) arrays of grains are in the sample's order unless said otherwise.
"""

import numpy as np

from dusttaichi.grains.kernels.measure import (
    ANGULAR,
    FASTEST,
    FASTEST_SPIN,
    KICK,
    LINEAR,
    Columns,
)
from dusttaichi.grains.kernels.store import FIRST_SPHERE, ON_SPHERE
from dusttaichi.grains.load_sums import DeviceLoadSums, LoadSums
from dusttaichi.grains.pointers import pair_pointers, touching, wall_pointers
from dusttaichi.physics.contact.parts import pair_parts, wall_parts


class Readout:
    """The measuring part of a Simulation: it reads the state and changes nothing."""

    # -- measuring -------------------------------------------------------------------------------

    def loads(self):
        """Force [nN] and torque [nN um] that move every grain, (N, 3) each, in internal order."""
        loads = self.contact_loads()
        if self.gravity is not None:
            loads[0] += self.mass * self.gravity.acceleration(self.state.of_grains("x"))
        return self.push.on(loads, self.step)

    def gravity_potential(self):
        """Potential energy of grains and sphere in the gravity of the scene [fJ].

        Carried grains and a driven sphere, whose weight its drive carries, are left out.
        """
        if self.gravity is None:
            return 0.0
        x = self.state["x"]
        own = np.reshape(self.mass, -1) * self.gravity.potential(x[: self.grains])
        own[self.push.carried_grains] = 0.0
        if self.sphere is not None and self.sphere.speed is None:
            at = x[self.sphere.row][None]
            own = np.append(own, self.sphere.mass * self.gravity.potential(at))
        return float(own.sum())

    def contact_loads(self):
        """Force [nN] and torque [nN um] of the contacts alone on every grain, (2, N, 3)."""
        owner, contact, second = self.state.listed_contacts()
        (block, lane), load = np.divmod(contact, self.layout.width), self.fields["load"]
        out = np.empty((2, self.grains, 3))
        # one column after another, which takes little memory
        for n in range(3):
            force = load.take(block, n, lane) * (1 - 2 * second)
            torque = load.take(block, 3 + 3 * second + n, lane)
            for part, own in enumerate((force, torque)):
                out[part, :, n] = np.bincount(owner, weights=own, minlength=self.grains)
        return out

    def wall_forces(self):
        """Force of each wall on the grains now [nN], (6, 3)."""
        if self.box is None:
            return np.zeros((6, 3))
        self.kernels.measure[2](self.walls_argument, self.time, self.dt)
        return self.sums["wall_force"].to_numpy()

    def load_sums(self):
        """Current LoadSums: of no use once something has moved."""
        return (LoadSums if self.kernels.load_sums is None else DeviceLoadSums)(self)

    def impulses(self):
        """Time integral of the wall forces since the start [nN us], (6, 3)."""
        return self.load_sums().impulses()

    def measure(self):
        """Energies [fJ], counts and extremes of the present moment, as a dict of numbers."""
        half = 0.5 * self.dt
        measure_grains, measure_pairs = self.kernels.measure[:2]
        mass, inertia = self.unit_mass, self.unit_inertia
        measure_grains(mass, inertia, half / mass, half / inertia)
        measure_pairs(self.step, self.dt)
        grains, columns = self.sums["grain_sum"].to_numpy(), Columns(self.layout)
        pairs = self._pair_sums()
        none = np.zeros((0, columns.count))
        out = {
            "kinetic_translation": grains[:, LINEAR].sum(),
            "kinetic_rotation": grains[:, ANGULAR].sum(),
            "kinetic_kick": grains[:, KICK].sum(),
            "largest_speed": grains[:, FASTEST].max(),
            "largest_spin": grains[:, FASTEST_SPIN].max(),
            "wall_work": 0.0,
            "face_work": 0.0,
            "push_work": self._push_work(),
            "stiffness_work": self.ledger_sums.stiffness_work,
            "gravity_work": self.potential_of_start - self.gravity_potential(),
        }
        if self.cell is not None:
            ends = self.ledger_sums.face_power - pairs[:, columns.faces].sum()
            work = self.state["face_work"].sum() + half * ends + self.ledger_sums.face_jumps
            moved = self._energy_of_images()
            out["kinetic_translation"] += moved
            out["face_work"] = float(work + self.state["wrap_work"].sum() + moved)
        out |= self._of_sphere()
        out["kinetic_kick"] += out["sphere_kick"]
        walls, on_sphere = none, none
        if self.box is not None:
            force = self.wall_forces()
            walls = self.sums["wall_sum"].to_numpy(-(-self.state.wall_blocks // self.layout.tile))
            out["wall_work"] = self.wall_work(force, self.impulses())
        if self.sphere is not None:
            on_sphere = self._sphere_sums()
        kinds = (("", "", pairs), ("wall_", "_wall", walls), ("sphere_", "_sphere", on_sphere))
        for n, (before, behind, sums) in enumerate(kinds):
            out[f"{before}contacts"] = int(round(sums[:, columns.contacts].sum()))
            out[f"potential{behind}"] = sums[:, columns.potential].sum(axis=0)
            out[f"loss{behind}"] = self._losses(n, sums[:, columns.pending])
        every = np.concatenate([pairs, walls, on_sphere])
        out["largest_overlap"] = every[:, columns.deepest].max(initial=0.0)
        out["largest_strain"] = every[:, columns.strain].max(initial=0.0)
        return out

    def _sphere_sums(self):
        """Sums over the contacts with the sphere that the last measurement has filled."""
        on, per_tile = int(self.state["counts"][ON_SPHERE]), self.layout.width * self.layout.tile
        return self.sums["sphere_sum"].to_numpy(-(-on // per_tile))

    def _of_sphere(self):
        """Energies of the sphere itself; zeros without one."""
        if self.sphere is None:
            return dict.fromkeys(("sphere_kinetic", "sphere_kick", "sphere_work"), 0.0)
        load = self.sphere.load()
        kinetic, kick = self.sphere.energies(load)
        work = self.sphere.work(load[0], self.sphere.impulses()[:3])
        return {
            "sphere_load": load,
            "sphere_kinetic": kinetic,
            "sphere_kick": kick,
            "sphere_work": work,
        }

    def _energy_of_images(self):
        """Change of the kinetic energy where grains outside a moving cell are at their images [fJ].

        Grains that have left the cell since the last search are taken at their images inside, as in
        snapshots.
        """
        if not self.cell.speeds(self.time).any() and not self.cell.tilt_rate:
            return 0.0
        x, v = self._moving()
        shift = self.cell.speeds_across(self.cell.outside(x, self.time), self.time)
        return float(np.sum(0.5 * self.mass * (shift - 2.0 * v) * shift))

    def _moving(self):
        """Positions [um] and velocities [um/us] of the followed images, (N, 3), internal order."""
        kick = 0.5 * self.dt / self.mass
        return self.state.of_grains("x"), self.state.of_grains("v") + kick * self.loads()[0]

    def _pair_sums(self):
        """Sums over the pairs that the last measurement has filled, (tiles, columns)."""
        tiles = -(-self.state.pair_count // (self.layout.width * self.layout.tile))
        return self.sums["pair_sum"].to_numpy(tiles)

    def wall_work(self, force, impulse):
        """Work of the walls since the start, with their current force and impulse."""
        if self.box is None:
            return 0.0
        # the force of a step acts half before and half after it
        own = (
            impulse
            - self.ledger_sums.impulse
            + 0.5 * self.dt * (self.ledger_sums.wall_force - force)
        )
        return self.ledger_sums.wall_work + float(np.sum(self.box.velocity * own))

    def _push_work(self):
        """Work of the pushes since the start."""
        if not self.push.works:
            return 0.0
        impulse = self.state["carried_impulse"] if "carried_impulse" in self.state else None
        own = self.push.work(self.state["x"], impulse, self.contact_loads()[0], self.step, self.dt)
        return self.ledger_sums.push_work + own

    def face_power(self):
        """Power of the moving faces now [fJ/us]."""
        if self.cell is None:
            return 0.0
        return self.cell.power(self.load_sums().across_faces(), self.time)

    def momentum_flux(self):
        """Time integral of the momentum flux since the start [fJ us], (3, 3).

        The sum of m v_a v_b and of branch_a force_b over all contacts: minus volume times stress
        (T19 eq 23).
        """
        return self.load_sums().momentum_flux()

    def lengths(self):
        """Current edges of the space for the grains [um], (3,); not a number where it is open."""
        return self.domain.lengths(self.step)

    def _losses(self, kind, pending):
        """Losses by channel up to now in contacts of a kind: 0 pairs, 1 walls, 2 the sphere.

        pending: those of this step that belong to the time before it, (tiles, channels).
        """
        table = self.state["wall_loss" if kind == 1 else "loss"] if kind != 1 or self.box else None
        if table is None or (kind == 2 and self.sphere is None):
            return np.zeros(len(self.layout.channels))
        if kind != 1 and self.sphere is not None:
            first = int(self.state["counts"][FIRST_SPHERE]) // self.layout.tile
            table = table[first:] if kind == 2 else table[:first]
        return table.sum(axis=0) + pending.sum(axis=0) - np.array(self.ledger_sums.pending[kind])

    # -- arrays ----------------------------------------------------------------------------------

    def grain_state(self):
        """Positions [um], velocities [um/us], spins [rad/us] now, (N, 3), in the sample's order.

        In a cell those of the image inside, which moves with the edges.
        """
        n = self.grains
        force, torque = self.loads()
        half = 0.5 * self.dt
        x = self.state.of_grains("x")
        v = self.state.of_grains("v") + half / self.mass * force
        w = self.state.of_grains("w") + half / self.inertia * torque
        if self.cell is not None:
            out_of = self.cell.outside(x, self.time)
            x = x - self.cell.across(out_of, self.time)
            v = v - self.cell.speeds_across(out_of, self.time)
        out = np.empty((3, n, 3))
        out[:, self.order] = x, v, w
        return out

    def grain_losses(self):
        """Energy lost in the contacts of each grain since the start [fJ], (N, channels).

        Grains are in the sample's order. Two grains share the loss; at a wall or the sphere it is
        the grain's.
        """
        self.kernels.add_grain_losses()
        out = np.empty((self.grains, len(self.layout.channels)))
        out[self.order] = self.state["grain_loss"]
        return out

    def contact_state(self):
        """Contacts between grains now, a dict of arrays; grains by the sample's numbers.

        force [nN]: on the first grain; torque_i, torque_j [nN um]: on both, and the parts of these
        (physics.contact.parts).
        """
        i, j = self.state.pairs()
        state = self.state.rows("history")[: len(i)]
        on = touching(self.layout, state)
        i, j, state = i[on], j[on], state[on]
        d = self.distances(np.flatnonzero(on), i, j)
        distance = np.linalg.norm(d, axis=1)
        load = self.state.rows("load")[: len(on)][on].astype(float)
        load, normal = (load[:, :3], load[:, 3:6], load[:, 6:9]), d / distance[:, None]
        i, j = self.order[i], self.order[j]
        radii = np.broadcast_to(self.radii, self.grains)
        own = radii[i][:, None], radii[j][:, None]
        first, second = pair_pointers(self.layout, state, normal, own)
        return {
            "grain_i": i,
            "grain_j": j,
            "pointer_i": first,
            "pointer_j": second,
            "overlap": self.touch(i, j) - distance,
            "force": load[0],
            "torque_i": load[1],
            "torque_j": load[2],
            **pair_parts(normal, load, (radii[i], radii[j])),
            **self.history_of(state),
        }

    def distances(self, rows, i, j):
        """Distance vectors from grains j to i now [um], of the pairs in these rows of `lanes`."""
        x = self.state["x"]
        d = x[i] - x[j]
        if self.cell is not None:
            d -= self.cell.across(self.edges_between(rows), self.time)
        return d

    def edges_between(self, rows):
        """Edges of the cell from the second grains to the first of pairs in these rows, (n, 3)."""
        out = np.zeros((len(rows), 3))
        out[:, list(self.cell.axes)] = self.state.lanes("shift")[rows]
        return out

    def touch(self, i, j):
        """Distance of the centres of these grains (the sample's numbers) at first touch [um]."""
        if self.polydisperse is None:
            return 2.0 * self.radius
        return self.radii[i] + self.radii[j]

    def history_of(self, history):
        """Histories of contacts, by the names of the result, in internal units.

        Losses [fJ] where they are followed. Zeros for numbers that the scene does not have.
        """
        zero, rows = np.zeros(len(history)), self.layout.rows
        out = {"twist": zero, "approach": zero}
        for name, declared in self.layout.model.history.items():
            if declared.result:
                first, width = rows[name]
                values = declared.sign * history[:, first : first + width]
                out[declared.result] = values if width > 1 else values[:, 0]
        if "lost" in rows:
            first, width = rows["lost"]
            out["loss"] = history[:, first : first + width]
        return out

    def wall_contact_state(self):
        """Contacts with walls now, a dict of arrays; feet and overlaps in um.

        force [nN], torque [nN um]: on the grain, and the parts of these (physics.contact.parts).
        """
        rows, grain, wall = self.state.wall_lanes()
        state = self.state.rows("history")[rows]
        on = touching(self.layout, state)
        grain, wall, state = grain[on], wall[on], state[on]
        load = self.state.rows("load")[rows][on].astype(float)
        x, normal = self.state["x"][grain], self.box.normal[wall]
        radius = np.broadcast_to(self.radii, self.grains)[self.order[grain]]
        # foot points are those on the wall, wherever it has gone along itself
        way = self.box.tangential_displacements(self.time)[wall]
        pointer, foot = wall_pointers(self.layout, state, (x - way, radius[:, None], normal))
        offset = self.box.offsets(self.time)[wall]
        # what follows from the history has the overlap in it: the foot is a point of the plane
        foot += (offset - np.sum(foot * normal, axis=1))[:, None] * normal
        distance = np.sum(x * normal, axis=1) - offset
        found = {"grain": self.order[grain], "wall": wall, "pointer": pointer}
        found |= {"force": load[:, :3], "torque": load[:, 3:6], "foot": foot + way}
        parts = wall_parts(normal, (found["force"], found["torque"]), radius)
        return found | {"overlap": radius - distance} | parts | self.history_of(state)

    def wall_distances(self):
        """Distance of every centre from every wall [um], (N, 6), in the sample's order."""
        x = self.state.of_grains("x")
        out = np.empty((self.grains, 6))
        out[self.order] = x @ self.box.normal.T - self.box.offsets(self.time)
        return out
