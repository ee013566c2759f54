"""State of a simulation: the used part of its fields."""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from dusttaichi.compute.memory import FieldState
from dusttaichi.grains.kernels.contact_numbers import list_numbers
from dusttaichi.grains.kernels.declare import SUMS
from dusttaichi.grains.kernels.store import (
    FIRST_SPHERE,
    FIRST_WALL,
    LOADS,
    ON_SPHERE,
    OPPOSITE,
    OVERFLOW,
    PAIRS,
    SPHERE,
    WALL_BLOCKS,
)
from dusttaichi.grains.order import rank_of
from dusttaichi.grains.pointers import pair_displacements, unit, wall_displacements
from dusttaichi.method import ArraysOnRequest
from dusttaichi.units import GRAINS, LENGTH


def _by_contact(a):
    """(blocks, components, lanes) as (contacts, components)."""
    return np.ascontiguousarray(a.transpose(0, 2, 1)).reshape(-1, a.shape[1])


# fields with a row for each block of contacts
OF_BLOCKS = ("contact", "load", "pair_i", "pair_j", "shift", "touch")
FAR = 1e6  # of the grains that fill empty lanes [um]


@dataclass(frozen=True)
class GrainProperties:
    """Radius [m], mass [kg], moment of inertia [kg m^2] and material of every grain.

    Arrays are (N,), in the sample's order; the material is its number. Of equal grains one number
    each, and no material.
    """

    radius: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    material: np.ndarray | None = None


class WallLanes(NamedTuple):
    """Lanes of the wall contacts: their blocks, and grain and wall of each lane."""

    blocks: slice
    grain: np.ndarray
    wall: np.ndarray


class GrainState(FieldState):
    """The state of a scene of `grains` grains, in internal units and order.

    fields: memory.Table by name, see kernels.declare. order: the sample's number of each
    grain, rank: the internal number of each grain of the sample.
    """

    def __init__(self, fields, layout, order):
        super().__init__(fields, layout)
        self.order = order
        self.grains, self.rank = len(order), rank_of(order)

    def of_grains(self, name):
        """A copy of a field without the two grains that fill empty lanes, (N, ...)."""
        return self.fields[name].to_numpy(self.grains)

    def row(self, name, row):
        """A copy of one row of a field."""
        return self.fields[name].copy_rows(row, row + 1)[0]

    def put_grains(self, name, values, far=False):
        """Fill a field of all grains; the two beyond them are at rest and far away."""
        ghosts = np.array([[FAR, 0, 0], [-FAR, 0, 0]]) if far else np.zeros((2, 3))
        self[name] = np.concatenate([values, ghosts])

    def clear_sums(self):
        """Begin all sums over steps at zero."""
        for name in SUMS:
            if name in self.fields:
                self.fields[name].fill(0.0)
        rows = [self.layout.rows[name] for name in ("lost", "recent") if name in self.layout.rows]
        if rows:
            for blocks in self.used_blocks():
                history = self.rows("history", blocks)
                for first, width in rows:
                    history[:, first : first + width] = 0.0
                self.put_rows("history", history, blocks)

    def carried_impulse(self):
        """Time integral of the contact forces on carried grains [nN us], None without them."""
        return self["carried_impulse"] if "carried_impulse" in self else None

    # -- contacts --------------------------------------------------------------------------------

    @property
    def pair_count(self):
        """Pairs that are listed, those that do not touch included."""
        return int(self["counts"][PAIRS])

    @property
    def wall_blocks(self):
        """Blocks of lanes that wall contacts take."""
        return int(self["counts"][WALL_BLOCKS])

    @property
    def overflow(self):
        """Overflow of a search: 0 none, 1 of pairs, 2 of wall contacts."""
        return int(self["counts"][OVERFLOW])

    def pairs(self):
        """First and second grain of every listed pair: rows of `lanes` from 0 on."""
        pairs = self.pair_count
        return self["pair_i"].reshape(-1)[:pairs], self["pair_j"].reshape(-1)[:pairs]

    def on_sphere(self):
        """(rows in `lanes`, grain, number of the sphere) of the listed contacts with the sphere."""
        counts, width = self["counts"], self.layout.width
        first, contacts = int(counts[FIRST_SPHERE]) * width, int(counts[ON_SPHERE])
        rows = np.arange(first, first + contacts)
        return rows, self["pair_i"].reshape(-1)[rows], self.grains + SPHERE

    def wall_lanes(self):
        """WallLanes of the listed wall contacts, empty lanes included; None without walls."""
        if "wall_grain" not in self:
            return None
        first, blocks = int(self["counts"][FIRST_WALL]), self.wall_blocks
        grain = self.fields["wall_grain"].to_numpy(blocks).reshape(-1)
        return WallLanes(slice(first, first + blocks), grain, self.walls_of_lanes())

    def walls_of_lanes(self):
        """Wall of every lane of `wall_lanes`, (blocks times lanes,)."""
        return np.repeat(self.fields["wall_of"].to_numpy(self.wall_blocks), self.layout.width)

    def used_blocks(self):
        """Slices of the blocks that have contacts: pairs, those with the sphere, with walls.

        No kernel reads others.
        """
        counts, width = self["counts"], self.layout.width
        numbers = -(-counts[PAIRS] // width), -(-counts[ON_SPHERE] // width), counts[WALL_BLOCKS]
        starts = 0, counts[FIRST_SPHERE], counts[FIRST_WALL]
        return [slice(int(a), int(a + n)) for a, n in zip(starts, numbers, strict=True)]

    def lanes(self, name, blocks=slice(None)):
        """A field (blocks, components, lanes) as an array (contacts, components)."""
        first, end, _ = blocks.indices(self.fields[name].rows)
        return _by_contact(self.fields[name].copy_rows(first, end))

    def rows(self, table, blocks):
        """History ("history") or loads ("load") of the contacts of these blocks.

        (contacts, rows). blocks: a slice.
        """
        name, rows = self._place_of(table)
        return _by_contact(self.fields[name].copy_rows(blocks.start, blocks.stop, rows))

    def rows_of(self, table, contacts):
        """`rows` of the contacts with these numbers, which rise without gaps."""
        if len(contacts) == 0:
            return self.rows(table, slice(0, 0))
        blocks = self.blocks_of(contacts)
        first = int(contacts[0]) - blocks.start * self.layout.width
        return self.rows(table, blocks)[first : first + len(contacts)]

    def blocks_of(self, contacts):
        """Slice of the blocks around the contacts with these numbers, of which there are some."""
        width = self.layout.width
        return slice(int(np.min(contacts)) // width, int(np.max(contacts)) // width + 1)

    def put_rows(self, table, values, blocks):
        """The reverse of `rows`."""
        name, rows = self._place_of(table)
        numbers = self.fields[name].copy_rows(blocks.start, blocks.stop)
        shape = (-1, self.layout.width, values.shape[1])
        numbers[:, rows] = values.reshape(shape).transpose(0, 2, 1)
        if table == "load" and self.layout.opposite:
            numbers[:, OPPOSITE : OPPOSITE + 3] = -numbers[:, :3]
        self.fields[name].from_numpy(numbers, blocks.start)

    def _place_of(self, table):
        """Name of the field of a table and its rows there."""
        history = table == "history"
        return ("contact", slice(self.layout.state_rows)) if history else ("load", slice(LOADS))

    def put_numbers(self, pair, wall, on_sphere, surfaces):
        """Numbers of the kinds of contacts (kernels.contact_numbers); on_sphere: or None."""
        contact_types = pair, wall, on_sphere or pair, *surfaces
        names = list_numbers(self.layout.model)
        self["numbers"] = np.array(
            [[getattr(constants, name) for name in names] for constants in contact_types]
        )
        self["touches"] = np.array([constants.touch for constants in contact_types])

    def take_contacts(self, contacts, d, radii):
        """Put the pointers and twist of contacts of a sample.

        d: distance vectors of all listed pairs, (pairs, 3); radii [um]: of all grains, (N,), in the
        sample's order.
        """
        i, j = self.rank[contacts["i"]], self.rank[contacts["j"]]
        swap = i > j
        low, high = np.minimum(i, j), np.maximum(i, j)
        first = np.where(swap[:, None], contacts["pointer_j"], contacts["pointer_i"])
        second = np.where(swap[:, None], contacts["pointer_i"], contacts["pointer_j"])
        own_i, own_j = self.pairs()
        key = own_i.astype(np.int64) * self.grains + own_j
        if len(key) == 0:
            return
        keys = low.astype(np.int64) * self.grains + high
        slots = np.minimum(np.searchsorted(key, keys), len(key) - 1)
        is_stored = key[slots] == keys
        rows = slots[is_stored]
        swapped = swap[is_stored, None]
        r_i, r_j = radii[contacts["i"][is_stored], None], radii[contacts["j"][is_stored], None]
        radii_pair = np.where(swapped, r_j, r_i), np.where(swapped, r_i, r_j)
        displacements = pair_displacements(
            first[is_stored], second[is_stored], unit(d[rows]), radii_pair
        )
        brought = {name: values[is_stored] for name, values in contacts.items()}
        self._put_springs(rows, brought, displacements, np.where(swapped, -1.0, 1.0))

    def take_wall_contacts(self, contacts, radii, geometry):
        """Put the pointers, foot points and twist of wall contacts of a sample.

        radii [um]: of all grains, (N,), in the sample's order; geometry(wall, x, radius): normals
        (n, 3) and reduced radii (n,) of contacts of grains at x (n, 3) with walls (n,).
        """
        lanes = self.wall_lanes()
        key = lanes.wall.astype(np.int64) * (self.grains + 1) + lanes.grain
        if len(key) == 0:
            return
        keys = contacts["wall"] * (self.grains + 1) + self.rank[contacts["grain"]]
        order = np.argsort(key, kind="stable")
        slots = order[np.minimum(np.searchsorted(key[order], keys), len(key) - 1)]
        is_stored = key[slots] == keys
        rows = slots[is_stored] + lanes.blocks.start * self.layout.width
        grain, wall = contacts["grain"][is_stored], contacts["wall"][is_stored]
        x = self["x"][self.rank[grain]]
        normal, reduced = geometry(wall, x, radii[grain])
        wall_geometry = x, radii[grain, None], normal, reduced[:, None]
        pointer, foot = contacts["pointer"][is_stored], contacts["foot"][is_stored] / LENGTH
        brought = {name: values[is_stored] for name, values in contacts.items()}
        self._put_springs(rows, brought, wall_displacements(pointer, foot, wall_geometry))

    def stiffen(self, ratio):
        """Change sliding displacements so that their force stays.

        ratio: previous over current stiffness, in moduli, to whose power 2/3 springs go.
        """
        first, width = self.layout.rows["zeta"]
        for blocks in self.used_blocks():
            history = self.rows("history", blocks)
            history[:, first : first + width] *= ratio ** (2.0 / 3.0)
            self.put_rows("history", history, blocks)

    def _put_springs(self, rows, contacts, displacements, order=1.0):
        """Put the displacements of contacts into these rows.

        Displacements xi, zeta (rows, 3), and what else of the history they have, by the names of
        the result. order: -1 where the sample has the two bodies of a contact the other way round,
        (rows, 1).
        """
        if len(rows) == 0:
            return
        blocks, layout = self.blocks_of(rows), self.layout
        history, rows = self.rows("history", blocks), rows - blocks.start * layout.width
        springs = (*displacements, np.ones((len(rows), 1)))
        for name, values in zip(("xi", "zeta", "touched"), springs, strict=True):
            first, width = layout.rows[name]
            history[rows, first : first + width] = values
        for name, variable in layout.model.history.items():
            if variable.result in contacts:
                first, width = layout.rows[name]
                values = contacts[variable.result].reshape(len(rows), -1)
                if values.shape[1] == width:  # another effect may have used the name otherwise
                    values = variable.sign * values / GRAINS(variable.unit)
                    history[rows, first : first + width] = values * (order if variable.odd else 1.0)
        self.put_rows("history", history, blocks)

    # -- checkpoint ------------------------------------------------------------------------------

    def arrays(self):
        """All state, for a checkpoint: the used part of what `kernels.declare` lists.

        An array is copied as it is read. Blocks without contacts are left out.
        """
        return ArraysOnRequest({name: partial(self._copy_used, name) for name in self.fields})

    def _copy_used(self, name):
        table = self.fields[name]
        if name not in OF_BLOCKS:
            return table.to_numpy(self["entry_start"][-1] if name == "entry" else None)
        columns = (slice(LOADS),) if name == "load" else ()
        used = [b for b in _select_blocks(self.used_blocks(), table.rows) if b.stop > b.start]
        blocks = [table.copy_rows(b.start, b.stop, *columns) for b in used or [slice(0, 0)]]
        return blocks[0] if len(blocks) == 1 else np.concatenate(blocks)

    def restore(self, arrays):
        """Go back to the arrays of a checkpoint of the same scene and sample."""
        self["counts"] = arrays["counts"]
        used = self.used_blocks()
        for name, table in self.fields.items():
            if name not in OF_BLOCKS:
                table.from_numpy(arrays[name])
                continue
            first = 0
            for blocks in _select_blocks(used, table.rows):
                values = arrays[name][first : first + blocks.stop - blocks.start]
                first += len(values)
                if name == "load":
                    self.put_rows("load", _by_contact(values), blocks)
                else:
                    table.from_numpy(values, blocks.start)


def _select_blocks(slices, rows):
    """The slices of blocks that a field of `rows` rows has."""
    return [s for s in slices if s.stop <= rows]
