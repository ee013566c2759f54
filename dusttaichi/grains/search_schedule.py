"""The search for neighbours: when it is due, how far it reaches, arguments of its kernels."""

from contextlib import nullcontext
from math import hypot, isfinite, sqrt

import numpy as np
import scipy

from dusttaichi.domain.clock import NEVER
from dusttaichi.errors import GuardStop
from dusttaichi.grains.kernels.grain_cells import CELLS_PER_GRAIN, FARTHEST, FURTHER_CELLS
from dusttaichi.grains.validity import LARGEST_OVERLAP
from dusttaichi.particles.cells import Bounds, lay_grid

LIGHT = 299792458.0  # um/us
FARTHEST_WAY = 0.5  # of the smallest radius, by which a grain may move in a step
SKIN = (0.01, 0.4)  # least and most, of the radius
# parts of the skin that each grain of a pair may go, and that faces between them may move
STILL, DRIVEN = (0.5, 0.0), (0.3, 0.4)
DEEP_AMONG = 13  # grains examined for deep overlaps: itself, and twelve that may touch it
NOWHERE = -1e30  # reach of a wall that is not there [um]


class Search:
    """The neighbour lists of a GrainState: every pair closer than touch + skin.

    kernels: those of a Compiled, by name. scratch: memory.Table of the search, by name. numbers:
    ledger.ContactNumbers. sphere: MovingSphere, or None. members: number of them (grains.members),
    1 without. skin [um], chosen at every search without `fixed_skin`. searched_at, wall_due: steps
    of the last search, and at which walls or faces ask for the next. count: searches so far.
    stopwatch: context of every search, so that a benchmark can time it.
    """

    def __init__(
        self, kernels, scratch, state, bodies, environment, *, numbers, sphere, members, fixed_skin
    ):
        self._kernels, self._scratch, self._state = kernels, scratch, state
        self._bodies, self._environment = bodies, environment
        self._numbers, self._sphere, self._members = numbers, sphere, members
        self.fixed_skin, self.skin = fixed_skin, fixed_skin or 0.0
        self.searched_at, self.wall_due, self.count = 0, NEVER, 0
        self.requested, self.stopwatch = False, nullcontext()

    def ask(self):
        """Have the next step search for neighbours, whether it is due or not."""
        self.requested = True

    @property
    def reach2(self):
        """Square of the distance that a grain may move before the next search is due [um^2]."""
        # below 0, so that every grain has moved further: a requested search is due at once
        return -1.0 if self.requested else (self._skin_shares()[0] * self.skin) ** 2

    def numbers(self):
        """Numbers for a checkpoint beside the lists."""
        return {
            "searched_at": self.searched_at,
            "wall_due": self.wall_due,
            "searches": self.count,
            "skin": self.skin,
            "search_requested": self.requested,
        }

    def restore(self, numbers):
        """Restore these numbers."""
        self.searched_at, self.wall_due = numbers["searched_at"], numbers["wall_due"]
        self.count, self.skin = numbers["searches"], numbers["skin"]
        self.requested = numbers["search_requested"]

    # -- searching -------------------------------------------------------------------------------

    def update(self, step):
        """New neighbour lists for the present positions; contacts keep their history exactly.

        Loads are not valid until the next pass over the contacts. Raises GuardStop when positions
        are no longer numbers, grains overlap without limit, or something moves so fast that grains
        pass through each other.
        """
        environment = self._environment
        self._kernels.bounds()
        low, high, lost, speed = Bounds.read(self._scratch["bounds"])
        if lost or not isfinite(speed):
            self._stop_not_a_number()
        walls, faces = environment.domain.fastest_wall, environment.closing_speed()
        if self._sphere is not None:
            speed = max(speed, self._sphere.speed_in_memory())
        self._check_speed(max(speed, walls, faces))
        if self.fixed_skin is None:
            self.skin = self._best_skin(max(speed, 2.0 * walls, 2.0 * faces))
        # contacts hold beyond first touch
        touch = 2.0 * self._bodies.radius + self._numbers.pair.far
        extent, edges = high - low, np.zeros(3)
        if environment.cell is not None:
            edges = self._wrap(step, touch)
            low = np.where(edges > 0.0, environment.cell.low(step * environment.dt), low)
            extent = np.where(edges > 0.0, edges, extent)
        self._list(step, low, extent, edges, touch + self.skin)
        self.searched_at = step
        self.wall_due = self._next_wall_due(walls)
        self.count += 1
        self.requested = False

    def _list(self, step, low, extent, edges, reach):
        """Pairs within `reach` of their centres (of the largest grains), and grains near walls."""
        environment, bodies, numbers = self._environment, self._bodies, self._numbers
        time = step * environment.dt
        tilt = 0.0 if environment.cell is None else environment.cell.offset(time)
        # grains of their own radius are listed by the distance of their surfaces
        near = reach**2 if bodies.are_equal else reach - 2.0 * bodies.radius
        radius = bodies.radius if bodies.are_equal else 0.0
        grid = self._lay_grid(low, extent, edges, reach, tilt)
        wall_reaches, sphere_reach = [NOWHERE] * self._state.layout.surfaces, 0.0
        if environment.box is not None:
            wall_reach = self.skin + numbers.wall.far + radius
            wall_reaches = [wall_reach if there else NOWHERE for there in environment.box.present]
            wall_reaches += [self.skin + c.far + radius for c in numbers.surfaces]
        if self._sphere is not None:
            sphere_reach = self._sphere.radius + self.skin + numbers.sphere.far + radius
        reaches = near, time, sphere_reach, 3.0, *wall_reaches
        self._scratch["grid"].from_numpy(np.array([*grid, *reaches]))
        if self._state.layout.grain_loss:
            self._kernels.add_grain_losses()
        self._kernels.list_neighbours(environment.walls_argument)
        self._check_room()

    def _lay_grid(self, low, extent, edges, reach, tilt):
        """The numbers of the grid.

        No cell is narrower than `reach`, and whole numbers of them fill a periodic edge. Where
        cells are tilted, that is their width across. Raises GuardStop where no grid covers the
        grains.
        """
        # in Python's own numbers: NumPy takes as long for three as for a hundred
        extent, edges = extent.tolist(), edges.tolist()
        if not all(map(isfinite, (*extent, reach, tilt))):
            raise GuardStop(
                f"At {self._environment.time:.6g} µs the extent of the sample is not a number any "
                "more. Try a smaller numerics.time_step, or walls and faces that move more slowly."
            )
        width = [reach * 1.000001] * 3
        width[0] *= hypot(1.0, tilt / edges[2]) if tilt else 1.0
        room = CELLS_PER_GRAIN * self._bodies.count + FURTHER_CELLS
        return lay_grid(low, extent, width, room, edges=edges, growth=1.1, tilt=tilt)

    def _wrap(self, step, touch):
        """Grains back into the cell; returns its edges. No pair may meet across two faces."""
        environment = self._environment
        time = step * environment.dt
        environment.set_upright(time)
        cell = environment.cell
        with np.errstate(over="ignore"):  # an edge that has grown without limit is refused below
            edges = cell.edges(time)
        if not edges.max() < FARTHEST:
            raise GuardStop(
                f"At {environment.time:.6g} µs the periodic cell is {edges.max():.3g} µm long: "
                "its faces move apart without limit. Try a lower boundary.strain_rate or an "
                "earlier stop."
            )
        shortest = edges[list(cell.axes)].min()
        largest_skin = 0.5 * shortest - touch
        if largest_skin < SKIN[0] * self._bodies.smallest:
            raise GuardStop(
                f"At {environment.time:.6g} µs the periodic cell has shrunk to {shortest:.4g} "
                "µm, four radii: a grain would touch another twice, across both faces. Stop "
                "earlier, or take a larger sample."
            )
        self.skin = min(self.skin, largest_skin)
        # v stands half a step back
        speeds = cell.speeds(time - 0.5 * environment.dt)
        self._kernels.wrap(
            cell.low(time).tolist(),
            np.where(edges > 0, edges, 1.0).tolist(),
            speeds.tolist(),
            [cell.offset(time), cell.tilt_rate],
            self._bodies.unit_mass,
        )
        return edges

    # -- when it is due --------------------------------------------------------------------------

    def _skin_shares(self):
        return DRIVEN if self._environment.closing_speed() > 0.0 else STILL

    def _next_wall_due(self, walls):
        """Step at which a wall or face has moved its part of the skin since this search.

        walls: speed of the fastest wall [um/us]. Found at the search, not later: faces may change
        speed, and the moment when a grain is wrapped must not depend on how a run is cut into
        calls.
        """
        of_grains, of_faces = self._skin_shares()
        closing_speed, due_step = self._environment.closing_speed(), NEVER
        for speed, fraction in ((walls, 1.0 - of_grains), (closing_speed, of_faces)):
            if speed > 0.0:
                steps = max(1, int(fraction * self.skin / (speed * self._environment.dt)))
                due_step = min(due_step, self.searched_at + steps)
        return due_step

    def _best_skin(self, speed):
        """Skin [um] of the shortest run time where grains approach at twice this speed [um/us].

        A search costs some eight steps, of small samples more (its launches cost as much as 5000
        grains), and is due every skin/(2 speed dt) steps; the pairs that are listed but do not
        touch make a step longer by about three times skin/radius.
        """
        smallest, way = self._bodies.smallest, speed * self._environment.dt
        # members whose fragments fly apart are searched as slowly as alone: most cells are empty
        search = 8.0 * (1.0 + 5000.0 / (self._bodies.count / self._members))
        best = sqrt(2.0 / 3.0 * search * way * smallest)
        return min(max(best, SKIN[0] * smallest), SKIN[1] * smallest)

    # -- what can go wrong -----------------------------------------------------------------------

    def _check_room(self):
        problem, time = self._state.overflow, self._environment.time
        if not problem:
            return
        skin = (self.fixed_skin or 0.0) / self._bodies.smallest
        shorter = "a smaller numerics.skin"
        if skin > SKIN[1]:
            shorter = f"numerics.skin: auto, which is at most {SKIN[1]:g}"
        if problem == 2:
            raise GuardStop(
                f"At {time:.6g} µs more grains are near walls than their capacity. Try "
                f"{shorter + ', or ' if skin else ''}a sample that is higher than two grains."
            )
        # members of a simulation may lie in each other
        if skin > SKIN[1] and (self._members > 1 or not self._find_deep_overlap()):
            raise GuardStop(
                f"At {time:.6g} µs the grains have more neighbours within numerics.skin = "
                f"{skin:.3g} radii than the lists hold. Try {shorter}."
            )
        raise GuardStop(
            f"At {time:.6g} µs some grain has more neighbours than fit around it: grains overlap "
            "without limit. Try a smaller numerics.time_step or a lower speed"
            f"{', or ' + shorter if skin else ''}."
        )

    def _find_deep_overlap(self):
        """True where a grain overlaps with one of those nearest to it beyond the contact model."""
        x, bodies = self._state.of_grains("x"), self._bodies
        radii = bodies.grain_radii[self._state.order]
        count = min(DEEP_AMONG, len(x))
        distance, near = scipy.spatial.cKDTree(x).query(x, k=range(1, count + 1))
        smaller = np.minimum(radii[:, None], radii[near])
        overlap = radii[:, None] + radii[near] - distance
        return bool((overlap[:, 1:] > LARGEST_OVERLAP * smaller[:, 1:]).any())

    def _check_speed(self, speed):
        """Stop before a grain passes through another within a step; speed: the fastest [um/us]."""
        environment, smallest = self._environment, self._bodies.smallest
        dt, way = environment.dt, speed * environment.dt
        if speed > LIGHT:
            raise GuardStop(
                f"At {environment.time:.6g} µs grains or faces move at {speed:.3g} m/s, faster "
                "than light. Try a lower speed or strain rate."
            )
        if way > FARTHEST_WAY * smallest:
            raise GuardStop(
                f"At {environment.time:.6g} µs grains, walls or faces move at {speed:.4g} m/s, "
                f"{way:.3g} µm in a step of {1e3 * dt:.4g} ns: {way / smallest:.3g} radii; "
                f"beyond {FARTHEST_WAY:g} grains pass through each other. Try numerics.time_step: "
                f"auto, one below {0.1e3 * smallest / speed:.2g} ns, or a lower speed."
            )

    def _stop_not_a_number(self):
        x = self._state.of_grains("x")
        grain = int(np.flatnonzero(~np.all(np.abs(x) < FARTHEST, axis=1))[0])
        number = self._state.order[grain]
        raise GuardStop(
            f"At {self._environment.time:.6g} µs the position of grain {number} is not a "
            "number any more: the step is too long. Try a smaller "
            "numerics.time_step or a lower speed."
        )
