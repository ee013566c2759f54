"""Members of a simulation: independent pairs of bodies side by side, each with its sums.

A member has the bits that it has alone: its positions are about an origin of its own, its grains
are in the order in which they would be alone, and loads are summed in that order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dusttaichi import units
from dusttaichi.grains.kernels.measure import ANGULAR, KICK, LINEAR, Columns
from dusttaichi.grains.kernels.members import BODY_COLUMNS, MASS, PLACE
from dusttaichi.method import Measurement, State

SI = np.array([[units.LENGTH], [units.SPEED]])
CARRIED = ("x", "v", "w", "grain_loss", "orientation")  # of each grain, as far as they exist


@dataclass(frozen=True)
class Look:
    """Numbers of a member at one moment.

    motion: distance [m] and velocity [m/s] of the first body from the second, (2, 3).
    measurement: of which `parts` has contacts, loss and largest_strain; None without energies.
    fragment: of each grain, where there are energies: the same number for all that contacts
    connect, (n,).
    """

    motion: NDArray[np.float64]
    measurement: Measurement | None = None
    fragment: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, np.int32))


class Members:
    """Members of a Motion, one behind the other in the sample as in memory.

    kernels: those of a Compiled, by name. kernel_sums: KernelSums. motion: Motion. search: Search.
    ledger: Ledger. bodies (M, 2): number of grains of both bodies of each. first (M + 1,): first
    grain of each. forming (M, C): losses of the first step that belong to the time before it [fJ].
    """

    def __init__(self, kernels, kernel_sums, motion, search, ledger, *, bodies):
        self._kernels, self._tables, self._motion = kernels, kernel_sums.tables, motion
        self._search, self._ledger, self._state = search, ledger, motion.state
        self._environment, self.bodies = motion.environment, np.array(bodies)
        self._columns = Columns(self._state.layout)
        self.first = np.concatenate([[0], np.cumsum(self.bodies.sum(axis=1))])
        self.forming = np.zeros((len(self), len(self._state.layout.channels)))

    def __len__(self):
        return len(self.bodies)

    def grains(self, member):
        """Slice of the grains of a member, in the sample and in memory."""
        return slice(int(self.first[member]), int(self.first[member + 1]))

    def place(self, x):
        """Write which grain is of which member; x: positions in memory [um], (N, 3).

        The search sees the members on a lattice, one beside the other.
        """
        sizes = np.diff(self.first)
        member, number = np.repeat(np.arange(len(self)), sizes), self._state.order
        second = number - self.first[member] >= self.bodies[member, 0]
        edges = [np.ptp(x[self.grains(m)], axis=0) for m in range(len(self))]
        pitch = np.max(edges, axis=0) + 4.0 * self._motion.bodies.radius
        side = int(np.ceil(len(self) ** (1.0 / 3.0)))
        lattice = np.stack(np.unravel_index(np.arange(len(self)), (side,) * 3), axis=1)
        state = self._state
        state["body"] = 2 * member + second
        state["origin"] = (lattice * pitch)[member]
        state.fields["member_first"].from_numpy(self.first)

    def rest(self, member):
        """End a member: its grains rest where they are, touch nothing and are not searched."""
        state, grains = self._state, self.grains(member)
        count = grains.stop - grains.start
        x = state.fields["x"].copy_rows(grains.start, grains.stop)
        state.fields["x"].from_numpy(np.where(np.isfinite(x), x, 0.0), grains.start)
        for name in ("v", "w"):
            state.fields[name].from_numpy(np.zeros((count, 3)), grains.start)
        state.fields["body"].from_numpy(np.full(count, -1), grains.start)
        pairs = self._list_pairs(member)
        if len(pairs):
            blocks = state.blocks_of(pairs)
            for row_type in ("history", "load"):
                rows = state.rows(row_type, blocks)
                rows[pairs - blocks.start * state.layout.width] = 0.0
                state.put_rows(row_type, rows, blocks)
        self._search.ask()

    # -- measuring -------------------------------------------------------------------------------

    def measure(self, members: Sequence[int], with_energies: Sequence[bool]) -> list[Look]:
        """The Look at each of these members now; with_energies: whether energies are measured.

        Raises RuntimeError where a grain of another member is among the contacts of one.
        """
        sums = self._sum_bodies(members, 1 + np.array(with_energies, int))
        bodies = sums[:, :, PLACE : PLACE + 6] / sums[:, :, MASS, None]
        motions = (bodies[:, 0] - bodies[:, 1]).reshape(-1, 2, 3) * SI
        looks = [Look(motion) for motion in motions]
        full = np.flatnonzero(with_energies)
        if len(full):
            measurements = self._make_measurements(np.take(members, full), sums[full])
            for k, measurement, fragment in zip(full, *measurements, strict=True):
                looks[k] = Look(motions[k], measurement, fragment)
        return looks

    def _sum_bodies(self, members, due):
        """Sums over both bodies of these members (m, 2, BODY_COLUMNS), which are `due` then."""
        count, particles = len(self), self._motion.bodies
        due_of_all = np.zeros(count, int)
        due_of_all[members] = due
        self._state.fields["due"].from_numpy(due_of_all)
        half, mass = 0.5 * self._environment.dt, particles.unit_mass
        inertia = particles.unit_inertia
        self._kernels.measure_bodies(count, mass, inertia, half / mass, half / inertia)
        sums = self._tables["body_sum"].to_numpy(2 * count)
        return sums.reshape(count, 2, BODY_COLUMNS)[members]

    def _sum_contacts(self):
        """Sums over the contacts and losses of all members (M, ...), valid of those due with them.

        And the fragment of each grain in memory, (N,).
        """
        self._kernels.measure_members(len(self), *self._environment.moment)
        tables = (self._tables[name] for name in ("member_sum", "member_loss"))
        fragment = self._tables["fragment"].to_numpy(self.first[-1])
        return *(table.to_numpy(len(self)) for table in tables), fragment

    def _make_measurements(self, members, bodies):
        """(Measurements, fragments) of members (m,) from the sums over their bodies (m, 2, ...)."""
        contacts, lost, fragment = self._sum_contacts()
        for member in members[fragment[self.first[members]] < 0]:
            raise self._make_stranger_error(member)
        by_sample = np.empty_like(fragment)
        by_sample[self._state.order] = fragment
        fragments = [by_sample[self.grains(member)] for member in members]
        if self.surrounded:
            return [self._ledger.measure()], fragments
        columns, contacts = self._columns, contacts[members]
        losses = lost[members] + contacts[:, columns.pending] - self.forming[members]
        # one after another: the order of `sum` would depend on the number of members
        linear, angular = bodies[:, :, LINEAR], bodies[:, :, ANGULAR]
        kinetic = linear[:, 0] + linear[:, 1] + angular[:, 0] + angular[:, 1]
        potential = contacts[:, columns.potential].sum(axis=1)
        numbers = np.round(contacts[:, columns.contacts]).astype(int)
        values = {
            "kinetic": kinetic,
            "potential": potential,
            "energy": kinetic + potential,
            "lost": losses.sum(axis=1),
            "kick": bodies[:, :, KICK].sum(axis=1),
            "bound": self._ledger.binding_energy(numbers, contacts[:, columns.potential.start]),
        }
        columns_of_parts = numbers.tolist(), contacts[:, columns.strain].tolist()
        rows = zip(*(column.tolist() for column in values.values()), strict=True)
        measurements = [
            Measurement(
                losses=loss,
                parts={"loss": loss, "contacts": number, "largest_strain": strain},
                **dict(zip(values, row, strict=True)),
            )
            for loss, number, strain, row in zip(losses, *columns_of_parts, rows, strict=True)
        ]
        return measurements, fragments

    @property
    def surrounded(self):
        """True where more than contacts acts on the grains, which only a single member allows."""
        environment, layout = self._environment, self._state.layout
        acting = environment.box, environment.cell, self._motion.outside
        is_pushed = layout.sphere or self._motion.push.works
        return is_pushed or any(effect is not None for effect in acting)

    def begin(self):
        """Begin the ledgers of all members, at step 0."""
        self._sum_bodies(range(len(self)), 2)
        self.forming = self._sum_contacts()[0][:, self._columns.pending]

    # -- contacts --------------------------------------------------------------------------------

    def _list_pairs(self, member):
        """Numbers of the listed pairs of a member in `lanes`."""
        start = self._state.fields["pair_start"]
        return np.arange(*(int(start.copy_rows(n, n + 1)[0]) for n in self.first[member:][:2]))

    def touching(self, member):
        """(numbers in `lanes`, first, second grain in memory) of the contacts of a member.

        Raises RuntimeError where a grain of another member is among them.
        """
        grains, state, pairs = self.grains(member), self._state, self._list_pairs(member)
        block, lane = np.divmod(pairs, state.layout.width)
        touched = state.fields["contact"].take(block, state.layout.rows["touched"][0], lane)
        contacts = pairs[touched > 0.5]
        if not len(contacts):
            return contacts, contacts, contacts
        blocks = state.blocks_of(contacts)
        lanes = contacts - blocks.start * state.layout.width
        tables = (state.fields[name] for name in ("pair_i", "pair_j"))
        rows = (table.copy_rows(blocks.start, blocks.stop) for table in tables)
        i, j = (numbers.reshape(-1)[lanes].astype(int) for numbers in rows)
        if min(i.min(), j.min()) < grains.start or max(i.max(), j.max()) >= grains.stop:
            raise self._make_stranger_error(member)
        return contacts, i, j

    @staticmethod
    def _make_stranger_error(member):
        return RuntimeError(f"grains of member {member} touch those of another one")

    def positions(self, member):
        """Positions [um] of the grains of a member in the sample's order, (n, 3)."""
        grains, state = self.grains(member), self._state
        out = np.empty((grains.stop - grains.start, 3))
        x = state.fields["x"].copy_rows(grains.start, grains.stop)
        out[state.order[grains] - grains.start] = x
        return out

    # -- from one simulation to another ----------------------------------------------------------

    def states(self, members: Sequence[int]) -> list[State]:
        """The State of each of these members: fields of its grains, its contacts, `forming`.

        i, j: numbers of its grains in memory, from 0; history, loads: of its contacts.
        """
        if members:
            self._kernels.add_grain_losses()
        return [self._copy_state(member) for member in members]

    def _copy_state(self, member):
        state, grains = self._state, self.grains(member)
        arrays = {
            name: state.fields[name].copy_rows(grains.start, grains.stop)
            for name in CARRIED
            if name in state.fields
        }
        contacts, i, j = self.touching(member)
        history, loads = (state.rows(rows, slice(0, 0)) for rows in ("history", "load"))
        if len(contacts):
            blocks = state.blocks_of(contacts)
            rows = contacts - blocks.start * state.layout.width
            history, loads = (state.rows(name, blocks)[rows] for name in ("history", "load"))
        arrays |= {"i": i - grains.start, "j": j - grains.start}
        arrays |= {"history": history, "loads": loads, "forming": self.forming[member]}
        return State(arrays, {})

    def put(self, states: Mapping[int, State]) -> None:
        """Continue the States of members of other simulations; the other members stay as they are.

        Neighbours are searched; contacts keep history and loads exactly.
        """
        state = self._state
        staying = [member for member in range(len(self)) if member not in states]
        of_members = dict(zip(staying, self.states(staying), strict=True)) | dict(states)
        every = [of_members[member].arrays for member in range(len(self))]
        for arrays, first in zip(every, self.first[:-1], strict=True):
            for name in CARRIED:
                if name in arrays:
                    state.fields[name].from_numpy(arrays[name], int(first))
        self.forming = np.array([arrays["forming"] for arrays in every])
        self._search.update(self._environment.step)
        i, j = (
            np.concatenate([a[name] + f for a, f in zip(every, self.first[:-1], strict=True)])
            for name in ("i", "j")
        )
        rows = np.searchsorted(self._number_pairs(*state.pairs()), self._number_pairs(i, j))
        blocks = state.used_blocks()[0]
        for rows_name, name in (("history", "history"), ("load", "loads")):
            values = np.zeros_like(state.rows(rows_name, blocks))
            values[rows] = np.concatenate([arrays[name] for arrays in every])
            state.put_rows(rows_name, values, blocks)

    def _number_pairs(self, i, j):
        """Number of each pair of grains, increasing as pairs are listed."""
        return i.astype(np.int64) * self._motion.bodies.count + j
