"""The search for neighbours: particles put in the order of blocks, ghosts made, lists written.

The host lays the grids of cells and launches the kernels (kernels.search_kernels), on a CPU and on
a device. All depends on the present positions alone. A resumed run rebuilds the lists of the last
search from the positions of that search.
"""

from itertools import pairwise, product

import numpy as np

from dusttaichi.compute.host_threads import share_out
from dusttaichi.continuum.kernels.block_lists import COUNT, ORDER, PLANES
from dusttaichi.continuum.kernels.search_kernels import FARTHEST, FURTHER_CELLS, MOST_CELLS
from dusttaichi.continuum.kernels.store import COLUMN
from dusttaichi.errors import GuardStop
from dusttaichi.method import moment
from dusttaichi.particles.cells import NOWHERE, Bounds, lay_grid

SUPPORT = 2.0  # reach of the kernels in smoothing lengths
# extra reach of the lists in smoothing lengths, by dimension: a compromise between the run time of
# steps with longer lists and of more searches
SKIN = {2: 0.6, 3: 0.3}
WIDER = 1.3  # of the cells of the lists where they would be more than their capacity
SORTED_AT_ONCE = 2**13  # particles of columns that are sorted together, about

# what is wrong where the entries of a list exceed its capacity
EXCEEDED = {
    "ghost_sign": (
        "there are {count} images of particles beyond periodic faces and mirrors, more than the "
        "capacity of {capacity}: the sample is narrower than the reach of a particle. Try a wider "
        "sample, or a smaller numerics.spacing."
    ),
    "entry": (
        "the particles have {each:.0f} neighbours each, more than the capacity: they have come "
        "together without limit. Try a smaller numerics.cfl, a larger numerics.viscosity.grid or a "
        "lower speed."
    ),
    "touch_row": (
        "{count} contacts of particles with rigid surfaces exceed the capacity of {capacity}: the "
        "gaps between them are narrower than the reach of a particle. Try a smaller "
        "numerics.spacing."
    ),
}


def skin_of(dimension, h):
    """Extra reach of the lists [m]."""
    return SKIN[dimension] * h


def way2_of(dimension, h):
    """Square of the displacement after which a search is due [m^2]."""
    return (0.5 * skin_of(dimension, h)) ** 2


class DustSearch:
    """The neighbour lists of a DustState.

    kernels: those of the search. scratch: memory.Table of the lists, by name. state: DustState.
    environment: Environment. h: smoothing length [m]. surfaces: Surfaces. threads: that put the
    particles in order on a CPU. count: searches so far.
    """

    def __init__(self, kernels, scratch, state, environment, *, h, surfaces, threads):
        self._kernels, self._scratch = kernels, scratch
        self.state, self._environment, self.surfaces = state, environment, surfaces
        self._threads = threads
        self.skin = skin_of(state.dimension, h)
        self.reach, self.count = SUPPORT * h + self.skin, 0
        self._write_surroundings(h)

    def _write_surroundings(self, smoothing_length):
        """Write axes, reaches, images and surfaces, which stay, into fields."""
        scratch, axes = self._scratch, np.zeros((self.state.dimension, 5))
        axes[:, PLANES:] = -NOWHERE, NOWHERE
        for axis, low, high in self.surfaces.edges:
            axes[axis] = low, high - low, 1.0 / (high - low), low, high
        for axis, side, plane in self.surfaces.mirrors:
            axes[axis, PLANES + side] = plane
        scratch["axes"].from_numpy(axes)
        scratch["known"].from_numpy([self.state.count])
        # particle and surface may each move by half of the skin, and the lists may be outdated by
        # as much
        scratch["reaches"].from_numpy([self.reach, self.reach + self.skin, smoothing_length])
        rigid = [(1, row) for row in self.surfaces.rigid]
        for name, rows in (("images", self.images()), ("surfaces", rigid)):
            ends = np.zeros((len(rows) + 1, scratch[name].field.shape[1]))
            ends[:-1] = np.reshape(rows, ends[:-1].shape)
            scratch[name].from_numpy(ends)

    def update(self):
        """Write new lists for the present positions; particles are sorted by place."""
        self._find_bounds()
        if self.state.layout.lanes > 1:
            self._reorder()
        else:
            self._lay_grid(ORDER)
            self._kernels.sort()
            self._kernels.reorder()
        self._write_lists()
        self.count += 1

    def again(self):
        """Rebuild the lists of the last search after a checkpoint is restored."""
        positions = self.state.of_particles("x")
        self.state["x"] = self.state.of_particles("x_search")
        self._find_bounds()
        self._write_lists()
        self.state["x"] = positions  # the next step moves the images

    # -- its parts -------------------------------------------------------------------------------

    def _find_bounds(self):
        """Lowest and highest coordinates; particles go back into the periodic cell.

        Raises GuardStop where positions are not numbers.
        """
        self._kernels.find_bounds()
        self.low, self.high, any_lost, _ = Bounds.read(self._scratch["bounds"])
        if any_lost:
            lost = ~(np.abs(self.state.of_particles("x")) < FARTHEST).all(axis=1)
            raise GuardStop(
                f"{moment(self._environment)} {lost.sum()} particles have a position that is not a "
                "number: the time step is too long. Try a smaller numerics.cfl or a lower speed."
            )

    def _lay_grid(self, phase):
        """Lay the grid around particles and their images; phase: of the search."""
        n, d = self.state.count, self.state.dimension
        margin = self.reach if self.state.layout.ghosts else 0.0
        low, none = self.low - margin, [0.0] * d
        extent, room = (self.high + margin - low).tolist(), MOST_CELLS * n + FURTHER_CELLS
        grid = lay_grid(low, extent, [self.reach] * d, room, edges=none, growth=WIDER)
        self._scratch["grid"].from_numpy([*grid, phase])

    def _reorder(self):
        """Put the particles in the order of blocks, and note the places of this search."""
        self.state.reorder(self._in_blocks(), self._threads)
        self.state["x_search"] = self.state.of_particles("x")
        rows = self.state["rigid"]
        rows[:, COLUMN["searched"]] = rows[:, COLUMN["centre"]]
        self.state["rigid"] = rows

    def _in_blocks(self):
        """The order in which blocks of particles (kernels.particle_blocks) are about square.

        Columns as wide as a block, one beside the other, up and down in turn.
        """
        lanes, d = self.state.layout.lanes, self.state.dimension
        x, volume = self.state.of_particles("x"), self.state.of_particles("volume")
        width = (lanes * np.median(volume[volume > 0.0])) ** (1.0 / d)
        cells = np.floor((x[:, :-1] - self.low[:-1]) / width).astype(np.int64)
        turn = cells.sum(axis=1) % 2 == 1
        column = cells[:, 0]
        if d == 3:
            across = cells[:, 1].max() + 1
            back = column % 2 == 1
            column = across * column + np.where(back, across - 1 - cells[:, 1], cells[:, 1])
        along = np.where(turn, -x[:, -1], x[:, -1])
        return _sort_columns(column, along, self._threads)

    def _write_lists(self):
        """Write images and lists. Raises GuardStop where they are too long."""
        scratch, n, layout = self._scratch, self.state.count, self.state.layout
        if layout.lanes > 1:
            self._lay_grid(COUNT)
        if layout.ghosts or layout.rigid:
            self._kernels.look_around()
        self._kernels.sort()
        if self._kernels.visit():
            blocks = -(-n // layout.lanes)
            if layout.ghosts:
                self._check_capacity("ghost_sign", scratch["ghost_first"].copy_rows(n, n + 1))
            self._check_capacity("entry", scratch["first"].copy_rows(blocks, blocks + 1))
            if layout.rigid:
                self._check_capacity("touch_row", scratch["touch_first"].copy_rows(n, n + 1))
        self._kernels.visit()

    def images(self):
        """(signs, shifts [m]) along all axes of the images of a particle, without itself."""
        along = [[(1.0, 0.0)] for _ in range(self.state.dimension)]
        for axis, low, high in self.surfaces.edges:
            along[axis] += [(1.0, high - low), (1.0, low - high)]
        for axis, _, plane in self.surfaces.mirrors:
            along[axis].append((-1.0, 2.0 * plane))
        return [tuple(np.array(combination).T) for combination in product(*along)][1:]

    def _check_capacity(self, name, end):
        """Raises GuardStop where entries, up to `end` (1,), exceed the capacity of EXCEEDED."""
        capacity, count = self._scratch[name].field.shape[0], int(end[0])
        if count > capacity:
            text = EXCEEDED[name].format(
                count=count, capacity=capacity, each=count / self.state.count
            )
            raise GuardStop(f"{moment(self._environment)} {text}")


def _sort_columns(column, along, threads):
    """Order by column, in each by the place along it, then by number: as np.lexsort, but faster.

    The order of columns has hardly changed since the last search. Few columns at a time stay in the
    cache of a thread.
    """
    order = np.argsort(column, kind="stable")
    column, along = column[order], along[order]
    starts = np.flatnonzero(np.diff(column)) + 1
    ends = np.arange(SORTED_AT_ONCE, len(order), SORTED_AT_ONCE)
    ends = np.append(starts, len(order))[np.searchsorted(starts, ends)]
    ends = np.unique(np.append(ends, len(order)))

    def sort(part):
        order[part] = order[part][np.lexsort((along[part], column[part]))]

    slices = [slice(*ends_of_part) for ends_of_part in pairwise([0, *ends])]
    share_out(sort, slices, threads)
    return order
