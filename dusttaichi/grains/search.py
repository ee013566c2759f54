"""The search for neighbours: when it is due, how far it reaches, arguments of its kernels."""

from contextlib import nullcontext
from math import hypot, isfinite, sqrt

import numpy as np

from dusttaichi.domain.clock import NEVER
from dusttaichi.errors import GuardStop
from dusttaichi.grains.kernels.search import CELLS_PER_GRAIN, FARTHEST, FURTHER_CELLS
from dusttaichi.particles.cells import Bounds, lay_grid

LIGHT = 299792458.0  # um/us
FARTHEST_WAY = 0.5  # of the smallest radius, that a grain may go in a step
SKIN = (0.01, 0.4)  # least and most, of the radius
# parts of the skin that each grain of a pair may go, and that faces between them may move
STILL, DRIVEN = (0.5, 0.0), (0.3, 0.4)
NOWHERE = -1e30  # reach of a wall that is not there [um]


class Search:
    """The neighbour lists of a Simulation: every pair closer than touch + skin.

    skin [um], chosen at every search unless `fixed_skin` is given. searched_at, wall_due:
    steps of the last search, and at which walls or faces ask for the next. count: searches so far.
    around: entered around every search on the way, so that a benchmark can time it.
    """

    def __init__(self, sim, fixed_skin):
        self.sim = sim
        self.fixed_skin, self.skin = fixed_skin, fixed_skin or 0.0
        self.searched_at, self.wall_due, self.count = 0, NEVER, 0
        self.requested, self.around = False, nullcontext()

    def ask(self):
        """Have the next step search for neighbours, whether it is due or not."""
        self.requested = True

    @property
    def reach2(self):
        """Square of the way that a grain may go before the next search is due [um^2]."""
        # every grain has gone further than the root of -1: a requested search is due at once
        return -1.0 if self.requested else (self._shares()[0] * self.skin) ** 2

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
        """Go back to these numbers."""
        self.searched_at, self.wall_due = numbers["searched_at"], numbers["wall_due"]
        self.count, self.skin = numbers["searches"], numbers["skin"]
        self.requested = numbers["search_requested"]

    # -- searching -------------------------------------------------------------------------------

    def now(self, step):
        """New neighbour lists for the present positions; contacts keep their history exactly.

        The loads are void until the next pass over the contacts.
        Raises GuardStop when positions are no longer numbers, grains overlap without limit, or
        something moves so fast that grains pass through each other.
        """
        sim = self.sim
        sim.kernels.bounds()
        low, high, lost, speed = Bounds.read(sim.scratch["bounds"])
        if lost or not isfinite(speed):
            self._stop_not_a_number()
        walls, faces = sim.domain.fastest_wall, self._closing_speed()
        if sim.sphere is not None:
            speed = max(speed, float(np.linalg.norm(sim.state.row("v", sim.sphere.row))))
        self._check_speed(max(speed, walls, faces))
        if self.fixed_skin is None:
            self.skin = self._best_skin(max(speed, 2.0 * walls, 2.0 * faces))
        # contacts hold beyond first touch
        touch = 2.0 * sim.radius + sim.pair.far
        extent, edges = high - low, np.zeros(3)
        if sim.cell is not None:
            edges = self._wrap(step, touch)
            low = np.where(edges > 0.0, sim.cell.low(step * sim.dt), low)
            extent = np.where(edges > 0.0, edges, extent)
        self._list(step, low, extent, edges, touch + self.skin)
        self.searched_at = step
        self.wall_due = self._next_wall_due(walls)
        self.count += 1
        self.requested = False

    def _list(self, step, low, extent, edges, reach):
        """Pairs within `reach` of their centres (of the largest grains), and grains near walls."""
        sim = self.sim
        tilt = 0.0 if sim.cell is None else sim.cell.offset(step * sim.dt)
        equal = sim.polydisperse is None
        # grains of their own radius are listed by the distance of their surfaces
        near = reach**2 if equal else reach - 2.0 * sim.radius
        numbers = self._grid(low, extent, edges, reach, tilt)
        walls, on_sphere = [NOWHERE] * 6, 0.0
        if sim.box is not None:
            wall_reach = self.skin + sim.wall.far + (sim.radius if equal else 0.0)
            walls = np.where(sim.box.present, wall_reach, NOWHERE)
        if sim.sphere is not None:
            on_sphere = sim.sphere.radius + self.skin + sim.sphere.contact.far
            on_sphere += sim.radius if equal else 0.0
        search_numbers = near, step * sim.dt, on_sphere, 3.0, *walls
        sim.scratch["grid"].from_numpy(np.array([*numbers, *search_numbers]))
        if sim.layout.grain_loss:
            sim.kernels.add_grain_losses()
        sim.kernels.list_neighbours(sim.walls_argument)
        self._check_room()

    def _grid(self, low, extent, edges, reach, tilt):
        """The numbers of the grid.

        No cell is narrower than `reach`, and whole numbers of them fill a periodic edge. Where
        cells are tilted, that is their width across. Raises GuardStop where no grid covers the
        grains.
        """
        # in Python's own numbers: NumPy takes as long for three as for a hundred
        extent, edges = extent.tolist(), edges.tolist()
        if not all(map(isfinite, (*extent, reach, tilt))):
            raise GuardStop(
                f"At {self.sim.time:.6g} µs the extent of the sample is not a number any more. "
                "Try a smaller numerics.time_step, or walls and faces that move more slowly."
            )
        width = [reach * 1.000001] * 3
        width[0] *= hypot(1.0, tilt / edges[2]) if tilt else 1.0
        room = CELLS_PER_GRAIN * self.sim.grains + FURTHER_CELLS
        return lay_grid(low, extent, width, room, edges=edges, growth=1.1, tilt=tilt)

    def _wrap(self, step, touch):
        """Grains back into the cell; returns its edges. No pair may meet across two faces."""
        sim = self.sim
        time = step * sim.dt
        sim.set_upright(time)
        with np.errstate(over="ignore"):  # an edge that has grown without limit is refused below
            edges = sim.cell.edges(time)
        if not edges.max() < FARTHEST:
            raise GuardStop(
                f"At {sim.time:.6g} µs the periodic cell is {edges.max():.3g} µm long: its faces "
                "move apart without limit. Try a lower boundary.strain_rate or an earlier stop."
            )
        shortest = edges[list(sim.cell.axes)].min()
        reach = 0.5 * shortest - touch
        if reach < SKIN[0] * sim.smallest:
            raise GuardStop(
                f"At {sim.time:.6g} µs the periodic cell has shrunk to {shortest:.4g} µm, four "
                "radii: a grain would touch another twice, across both faces. Stop earlier, or "
                "take a larger sample."
            )
        self.skin = min(self.skin, reach)
        # v stands half a step back
        speeds = sim.cell.speeds(time - 0.5 * sim.dt)
        sim.kernels.wrap(
            sim.cell.low(time).tolist(),
            np.where(edges > 0, edges, 1.0).tolist(),
            speeds.tolist(),
            [sim.cell.offset(time), sim.cell.tilt_rate],
            sim.unit_mass,
        )
        return edges

    # -- when it is due --------------------------------------------------------------------------

    def _shares(self):
        return DRIVEN if self._closing_speed() > 0.0 else STILL

    def _closing_speed(self):
        sim = self.sim
        return 0.0 if sim.cell is None else sim.domain.closing_speed(sim.step)

    def _next_wall_due(self, walls):
        """Step at which a wall or face has moved its part of the skin since this search.

        walls: speed of the fastest wall [um/us]. Found at the search, not later: faces may change
        speed, and the moment when a grain is wrapped must not depend on how a run is cut into
        calls.
        """
        grains, faces = self._shares()
        step_due = NEVER
        for speed, fraction in ((walls, 1.0 - grains), (self._closing_speed(), faces)):
            if speed > 0.0:
                steps = max(1, int(fraction * self.skin / (speed * self.sim.dt)))
                step_due = min(step_due, self.searched_at + steps)
        return step_due

    def _best_skin(self, speed):
        """Skin [um] that costs least where grains come together at twice this speed [um/us].

        A search costs some eight steps, of small samples more (its launches cost as much as 5000
        grains), and is due every skin/(2 speed dt) steps; the pairs that are listed but do not
        touch make a step longer by about three times skin/radius.
        """
        sim, way = self.sim, speed * self.sim.dt
        # members whose fragments fly apart are searched as slowly as alone: most cells are empty
        grains = sim.grains if sim.members is None else sim.grains / len(sim.members)
        search = 8.0 * (1.0 + 5000.0 / grains)
        best = sqrt(2.0 / 3.0 * search * way * sim.smallest)
        return min(max(best, SKIN[0] * sim.smallest), SKIN[1] * sim.smallest)

    # -- what can go wrong -----------------------------------------------------------------------

    def _check_room(self):
        problem, time = self.sim.state.overflow, self.sim.time
        if problem == 1:
            raise GuardStop(
                f"At {time:.6g} µs some grain has more neighbours than can stand around it: "
                "grains overlap without limit. Try a smaller numerics.time_step, a lower speed, "
                "or a smaller numerics.skin."
            )
        if problem == 2:
            raise GuardStop(
                f"At {time:.6g} µs more grains are near walls than their capacity. Try a "
                "smaller numerics.skin, or a sample that is higher than two grains."
            )

    def _check_speed(self, speed):
        """Stop before a grain passes through another within a step; speed: the fastest [um/us]."""
        sim, way = self.sim, speed * self.sim.dt
        if speed > LIGHT:
            raise GuardStop(
                f"At {sim.time:.6g} µs grains or faces move at {speed:.3g} m/s, faster than light. "
                "Try a lower speed or strain rate."
            )
        if way > FARTHEST_WAY * sim.smallest:
            raise GuardStop(
                f"At {sim.time:.6g} µs grains, walls or faces move at {speed:.4g} m/s, "
                f"{way:.3g} µm in a step of {1e3 * sim.dt:.4g} ns: {way / sim.smallest:.3g} radii; "
                f"beyond {FARTHEST_WAY:g} grains pass through each other. Try numerics.time_step: "
                f"auto, one below {0.1e3 * sim.smallest / speed:.2g} ns, or a lower speed."
            )

    def _stop_not_a_number(self):
        x = self.sim.state.of_grains("x")
        row = int(np.flatnonzero(~np.all(np.abs(x) < FARTHEST, axis=1))[0])
        raise GuardStop(
            f"At {self.sim.time:.6g} µs the position of grain {self.sim.order[row]} is not a "
            "number any more: the step is too long for what happens. Try a smaller "
            "numerics.time_step or a lower speed."
        )
