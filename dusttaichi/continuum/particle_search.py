"""The search for neighbours: particles put in the order of blocks, ghosts made, lists written.

The host lays the grids of cells and launches the kernels (kernels.search_kernels), on a CPU and on
a device. All depends on the present positions alone. A resumed run rebuilds the lists of the last
search from the positions of that search.
"""

from itertools import product

import numpy as np

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


class Search:
    """The neighbour lists of a Simulation.

    mirrors: (axis, side, plane [m]) of each mirror; edges: (axis, low, high) of each periodic axis,
    with the axes of the kernels. rigid: rows with a rigid surface. count: searches so far.
    """

    def __init__(self, sim, h, mirrors, edges, rigid):
        self.sim, self.mirrors, self.edges = sim, mirrors, edges
        self.skin, self.launches = SKIN[sim.dimension] * h, sim.kernels.search
        self.reach, self.count = SUPPORT * h + self.skin, 0
        images, axes = self.images(), np.zeros((sim.dimension, 5))
        axes[:, PLANES:] = -NOWHERE, NOWHERE
        for axis, low, high in edges:
            axes[axis] = low, high - low, 1.0 / (high - low), low, high
        for axis, side, plane in mirrors:
            axes[axis, PLANES + side] = plane
        sim.lists["axes"].from_numpy(axes)
        sim.lists["known"].from_numpy([sim.n])
        # particle and surface may each move by half of the skin, and the lists may be outdated by
        # as much
        sim.lists["reaches"].from_numpy([self.reach, self.reach + self.skin, h])
        for name, rows in (("images", images), ("surfaces", [(1, row) for row in rigid])):
            ends = np.zeros((len(rows) + 1, sim.lists[name].field.shape[1]))
            ends[:-1] = np.reshape(rows, ends[:-1].shape)
            sim.lists[name].from_numpy(ends)

    @property
    def way2(self):
        """Square of the displacement after which a search is due [m^2]."""
        return (0.5 * self.skin) ** 2

    def update(self):
        """Write new lists for the present positions; particles are sorted by place."""
        self._find_bounds()
        if self.sim.layout.lanes > 1:
            self._reorder()
        else:
            self._lay_grid(ORDER)
            self.launches.sort()
            self.launches.reorder()
        self._write_lists()
        self.count += 1

    def again(self):
        """Rebuild the lists of the last search after a checkpoint is restored."""
        positions = self.sim.of_particles("x")
        self.sim.put("x", self.sim.of_particles("x_search"))
        self._find_bounds()
        self._write_lists()
        self.sim.put("x", positions)  # the next step moves the images

    # -- its parts -------------------------------------------------------------------------------

    def _find_bounds(self):
        """Lowest and highest coordinates; particles go back into the periodic cell.

        Raises GuardStop where positions are not numbers.
        """
        self.launches.find_bounds()
        self.low, self.high, any_lost, _ = Bounds.read(self.sim.lists["bounds"])
        if any_lost:
            lost = ~(np.abs(self.sim.of_particles("x")) < FARTHEST).all(axis=1)
            raise GuardStop(
                f"{moment(self.sim)} {lost.sum()} particles have a position that is not a number: "
                "the time step is too long. Try a smaller numerics.cfl or a lower speed."
            )

    def _lay_grid(self, phase):
        """Lay the grid around particles and their images; phase: of the search."""
        n, d = self.sim.n, self.sim.dimension
        margin = self.reach if self.sim.layout.ghosts else 0.0
        low, none = self.low - margin, [0.0] * d
        extent, room = (self.high + margin - low).tolist(), MOST_CELLS * n + FURTHER_CELLS
        grid = lay_grid(low, extent, [self.reach] * d, room, edges=none, growth=WIDER)
        self.sim.lists["grid"].from_numpy([*grid, phase])

    def _reorder(self):
        """Put the particles in the order of blocks, and note the places of this search."""
        self.sim.reorder(self._in_blocks())
        self.sim.put("x_search", self.sim.of_particles("x"))
        rows = self.sim.tables["rigid"].to_numpy()
        rows[:, COLUMN["searched"]] = rows[:, COLUMN["centre"]]
        self.sim.tables["rigid"].from_numpy(rows)

    def _in_blocks(self):
        """The order in which blocks of particles (kernels.particle_blocks) are about square.

        Columns as wide as a block, one beside the other, up and down in turn.
        """
        lanes, d = self.sim.layout.lanes, self.sim.dimension
        x, volume = self.sim.of_particles("x"), self.sim.of_particles("volume")
        width = (lanes * np.median(volume[volume > 0.0])) ** (1.0 / d)
        cells = np.floor((x[:, :-1] - self.low[:-1]) / width).astype(np.int64)
        turn = cells.sum(axis=1) % 2 == 1
        if d == 3:
            cells[:, 1] = np.where(cells[:, 0] % 2 == 1, -cells[:, 1], cells[:, 1])
        along = np.where(turn, -x[:, -1], x[:, -1])
        return np.lexsort((along, *cells.T[::-1]))

    def _write_lists(self):
        """Write images and lists. Raises GuardStop where they are too long."""
        sim, n, layout = self.sim, self.sim.n, self.sim.layout
        if layout.lanes > 1:
            self._lay_grid(COUNT)
        if layout.ghosts or layout.rigid:
            self.launches.look_around()
        self.launches.sort()
        if self.launches.visit():
            blocks = -(-n // layout.lanes)
            if layout.ghosts:
                self._check_capacity("ghost_sign", sim.lists["ghost_first"].copy_rows(n, n + 1))
            self._check_capacity("entry", sim.lists["first"].copy_rows(blocks, blocks + 1))
            if layout.rigid:
                self._check_capacity("touch_row", sim.lists["touch_first"].copy_rows(n, n + 1))
        self.launches.visit()

    def images(self):
        """(signs, shifts [m]) along all axes of the images of a particle, without itself."""
        along = [[(1.0, 0.0)] for _ in range(self.sim.dimension)]
        for axis, low, high in self.edges:
            along[axis] += [(1.0, high - low), (1.0, low - high)]
        for axis, _, plane in self.mirrors:
            along[axis].append((-1.0, 2.0 * plane))
        return [tuple(np.array(combination).T) for combination in product(*along)][1:]

    def _check_capacity(self, name, end):
        """Raises GuardStop where entries, up to `end` (1,), exceed the capacity of EXCEEDED."""
        capacity, count = self.sim.lists[name].field.shape[0], int(end[0])
        if count > capacity:
            text = EXCEEDED[name].format(count=count, capacity=capacity, each=count / self.sim.n)
            raise GuardStop(f"{moment(self.sim)} {text}")
