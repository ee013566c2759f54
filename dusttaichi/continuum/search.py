"""The search for neighbours: particles sorted by cell, ghosts made, lists written.

It depends on the present positions alone. A resumed run rebuilds the lists of the last search from
the positions of that search.
"""

from itertools import product

import numpy as np

from dusttaichi.continuum.kernels.lists import FARTHEST, FURTHER_CELLS, MOST_CELLS, WIDER
from dusttaichi.continuum.kernels.store import COLUMN
from dusttaichi.errors import GuardStop
from dusttaichi.method import moment
from dusttaichi.samples.continuum.particles import DUST, ELASTIC

SUPPORT = 2.0  # reach of the kernels in smoothing lengths
# extra reach of the lists in smoothing lengths, by dimension: a compromise between the run time of
# steps with longer lists and of more searches
SKIN = {2: 0.6, 3: 0.3}
YIELD = (DUST, ELASTIC)  # roles of what has neighbours

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
        self.sim, self.h, self.mirrors, self.edges = sim, h, mirrors, edges
        self.rigid, self.skin = rigid, SKIN[sim.dimension] * h
        self.reach, self.count = SUPPORT * h + self.skin, 0

    @property
    def way2(self):
        """Square of the displacement after which a search is due [m^2]."""
        return (0.5 * self.skin) ** 2

    @property
    def near_surface(self):
        """Distance within which a surface is listed [m].

        Particle and surface may each move by half of the skin, and the lists may be outdated by as
        much.
        """
        return SUPPORT * self.h + 2.0 * self.skin

    def now(self):
        """Write new lists for the present positions; particles are sorted by place."""
        x = self.sim.of_particles("x")
        self.check_places(x)
        wrapped = self._wrap(x)
        if wrapped is not x:
            self.sim.put("x", wrapped)
        grid = self._grid(wrapped)
        if self.sim.layout.lanes > 1:
            order = self._in_blocks(wrapped)
        else:
            order = np.argsort(self._cells(wrapped, *grid), kind="stable")
        self.sim.reorder(order)
        self.sim.put("x_search", wrapped[order])
        rows = self.sim.tables["rigid"].to_numpy()
        rows[:, COLUMN["searched"]] = rows[:, COLUMN["centre"]]
        self.sim.tables["rigid"].from_numpy(rows)
        self._list(wrapped[order], grid)
        self.count += 1

    def again(self):
        """Rebuild the lists of the last search after a checkpoint is restored."""
        now, then = self.sim.of_particles("x"), self.sim.of_particles("x_search")
        self.sim.put("x", then)
        self._list(then, self._grid(then))
        self.sim.put("x", now)
        self._place_ghosts(now)

    # -- its parts -------------------------------------------------------------------------------

    def _wrap(self, x):
        """Particles back into the periodic cell."""
        for axis, low, high in self.edges:
            out = np.floor((x[:, axis] - low) / (high - low))
            if out.any():
                x = x.copy()
                x[:, axis] -= out * (high - low)
        return x

    def _grid(self, x):
        """Origin, width and numbers of the cells around particles and their ghosts."""
        margin = self.reach if self.mirrors or self.edges else 0.0
        low, high = x.min(axis=0) - margin, x.max(axis=0) + margin
        width, room = self.reach, MOST_CELLS * len(x) + FURTHER_CELLS
        while np.prod(cells := np.floor((high - low) / width).astype(np.int64) + 1) > room:
            width *= WIDER
        return low, width, cells

    @staticmethod
    def _cells(x, low, width, cells):
        place = np.floor((x - low) * (1.0 / width)).astype(np.int64)
        return np.ravel_multi_index(tuple(np.clip(place, 0, cells - 1).T), tuple(cells))

    def _in_blocks(self, x):
        """The order in which the blocks of particles (kernels.blocks) are about as wide as high.

        Columns as wide as a block, one beside the other, up and down in turn.
        """
        lanes, d = self.sim.layout.lanes, self.sim.dimension
        volume = self.sim.of_particles("volume")
        width = (lanes * np.median(volume[volume > 0.0])) ** (1.0 / d)
        place = np.floor((x[:, :-1] - x[:, :-1].min(axis=0)) / width).astype(np.int64)
        turn = place.sum(axis=1) % 2 == 1
        if d == 3:
            place[:, 1] = np.where(place[:, 0] % 2 == 1, -place[:, 1], place[:, 1])
        along = np.where(turn, -x[:, -1], x[:, -1])
        return np.lexsort((along, *place.T[::-1]))

    def _list(self, x, grid):
        """Ghosts and lists for particles at positions x, sorted by cell."""
        sim, n = self.sim, len(x)
        seen = np.concatenate([x, self._ghosts(x)])
        low, width, cells = grid
        # rigid and fixed particles are not neighbours: their body or face acts by its surface
        yields = np.ones(len(seen), bool)
        yields[:n] = np.isin(sim.of_particles("role"), YIELD)
        yields = np.flatnonzero(yields)
        cell = self._cells(seen[yields], *grid)
        first = np.searchsorted(np.sort(cell), np.arange(np.prod(cells) + 1)).astype(np.int32)
        sim.lists["cell_first"].from_numpy(first)
        in_cell = yields[np.argsort(cell, kind="stable")]
        sim.lists["in_cell"].from_numpy(in_cell.astype(np.int32))
        self._place_ghosts(x)
        sim.lists["grid_origin"].from_numpy(low)
        sim.lists["grid_cells"].from_numpy(cells)
        sim.kernels.count(n, self.reach**2, 1.0 / width)
        self.check_capacity("entry", int(sim.lists["first"].to_numpy()[-(-n // sim.layout.lanes)]))
        sim.kernels.write(n, self.reach**2, 1.0 / width)
        self._touches(n)

    def _touches(self, n):
        """List the pairs of particle and rigid surface that may touch before the next search."""
        sim = self.sim
        if not sim.layout.rigid:
            return
        yields = np.isin(sim.of_particles("role"), YIELD)
        own, rows = [], []
        for row in self.rigid:
            sim.kernels.measure(row, sim.step_numbers())
            near = sim.lists["distance"].to_numpy(n) < self.near_surface
            own.append(np.flatnonzero(near & yields))
            rows.append(np.full(len(own[-1]), row))
        own, rows = np.concatenate(own), np.concatenate(rows)
        order = np.argsort(own, kind="stable")
        self.check_capacity("touch_row", len(own))
        first = np.searchsorted(own[order], np.arange(n + 1)).astype(np.int32)
        sim.lists["touch_first"].from_numpy(first)
        sim.lists["touch_row"].from_numpy(rows[order].astype(np.int32))

    def _ghosts(self, x):
        """Positions of all images within reach of the box.

        Their originals, signs and shifts are written to `lists`.
        """
        sim, n = self.sim, len(x)
        if not sim.layout.ghosts:
            return np.zeros((0, sim.dimension))
        source, sign, shift = [], [], []
        yields = np.isin(sim.of_particles("role"), YIELD)
        for signs, shifts in self.images():
            image = x * signs + shifts
            inside = np.flatnonzero(self._near(image) & yields)
            source.append(inside)
            sign.append(np.broadcast_to(signs, (len(inside), sim.dimension)))
            shift.append(np.broadcast_to(shifts, (len(inside), sim.dimension)))
        source = np.concatenate(source)
        order = np.argsort(source, kind="stable")
        source = source[order]
        sign, shift = np.concatenate(sign)[order], np.concatenate(shift)[order]
        self.check_capacity("ghost_sign", len(source))
        sim.lists["ghost_sign"].from_numpy(sign)
        sim.lists["ghost_shift"].from_numpy(shift)
        first = np.searchsorted(source, np.arange(n + 1)).astype(np.int32)
        sim.lists["ghost_first"].from_numpy(first)
        self.source = source, sign, shift
        return x[source] * sign + shift

    def images(self):
        """(signs, shifts [m]) along all axes of the images of a particle, without itself."""
        along = [[(1.0, 0.0)] for _ in range(self.sim.dimension)]
        for axis, low, high in self.edges:
            along[axis] += [(1.0, high - low), (1.0, low - high)]
        for axis, _, plane in self.mirrors:
            along[axis].append((-1.0, 2.0 * plane))
        return [tuple(np.array(chosen).T) for chosen in product(*along)][1:]

    def _near(self, image):
        """True for images within reach of the box of their originals."""
        inside = np.ones(len(image), bool)
        for axis, low, high in self.edges:
            inside &= image[:, axis] > low - self.reach
            inside &= image[:, axis] < high + self.reach
        for axis, side, plane in self.mirrors:
            beyond = (image[:, axis] - plane) * (1.0 if side else -1.0)
            inside &= beyond < self.reach
        return inside

    def _place_ghosts(self, x):
        """Write the variables of the ghosts that neighbours read, from their originals at x."""
        sim = self.sim
        if not sim.layout.ghosts:
            return
        source, sign, shift = self.source
        n, d = len(x), sim.dimension
        sim.put_ghosts("x", n, x[source] * sign + shift)
        for name in ("v", "hourglass"):
            if name in sim.tables:
                sim.put_ghosts(name, n, sim.of_particles(name)[source] * sign)
        both = (sign[:, :, None] * sign[:, None, :]).reshape(-1, d * d)
        for name in ("load", "flux", "drag", "tension"):
            if name in sim.tables:
                sim.put_ghosts(name, n, sim.of_particles(name)[source] * both)
        for name in ("volume", "density", "impedance", "damping", "alpha", "beta", "side", "gap"):
            if name in sim.tables:
                sim.put_ghosts(name, n, sim.of_particles(name)[source])

    # -- checks ---------------------------------------------------------------------------------

    def check_places(self, x):
        """Raises GuardStop where positions are not numbers."""
        lost = ~(np.abs(x) < FARTHEST).all(axis=1)
        if lost.any():
            raise GuardStop(
                f"{moment(self.sim)} {lost.sum()} particles have a position that is not a number: "
                "the time step is too long. Try a smaller numerics.cfl or a lower speed."
            )

    def check_capacity(self, name, count):
        """Raises GuardStop where `count` entries exceed the capacity of a list of EXCEEDED."""
        capacity = self.sim.lists[name].field.shape[0]
        if count > capacity:
            text = EXCEEDED[name].format(count=count, capacity=capacity, each=count / self.sim.n)
            raise GuardStop(f"{moment(self.sim)} {text}")
