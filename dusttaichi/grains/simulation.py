"""A built scene in motion: advances by whole steps, searches when due, measures. Internal units.

The box (walls) and the cell (periodic faces) of `surroundings` move as the drive of the moment
says; `drive` changes it between two steps, and the ledger goes on.
"""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field, fields, replace
from functools import lru_cache

import numpy as np

from dusttaichi import units
from dusttaichi.domain.domain import Domain
from dusttaichi.errors import GuardStop
from dusttaichi.grains.kernels.search import CELLS_PER_GRAIN, Grid
from dusttaichi.grains.kernels.walls import Walls
from dusttaichi.grains.readout import Readout
from dusttaichi.grains.step import DONE, Motion
from dusttaichi.names import NEVER
from dusttaichi.physics.contact.constants import PULL_OFF, characteristic_time

SKIN = (0.01, 0.4)  # least and most, of the radius
# parts of the skin that each grain of a pair may go, and that faces between them may move
STILL, DRIVEN = (0.5, 0.0), (0.3, 0.4)


@dataclass(frozen=True)
class Kernels:
    """The compiled kernels of a scene."""

    advance: Callable
    bounds: Callable
    find: Callable
    relist: Callable
    list_entries: Callable
    relist_walls: Callable | None
    wrap: Callable | None
    measure: tuple

    @property
    def names(self):
        """Names of those that the scene has."""
        on_their_own = [f.name for f in fields(self) if f.name != "measure"]
        measures = ("measure_grains", "measure_pairs", "measure_walls")
        there = [name for name in on_their_own if getattr(self, name) is not None]
        return there + [n for n, k in zip(measures, self.measure, strict=True) if k is not None]


@dataclass
class Books:
    """Ends of the sums over steps: the force of a step acts half before and half after it.

    wall_force (6, 3), face_power: at the start of the present drive and of the run. wall_work,
    impulse (6, 3): of earlier drives. face_jumps: what changes of the drive leave over. damping:
    half of the work of step 0, which would belong to a time before it (pairs, walls). push_work: of
    pushes that have ended.
    """

    wall_force: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))
    impulse: np.ndarray = field(default_factory=lambda: np.zeros((6, 3)))
    push_work: float = 0.0
    wall_work: float = 0.0
    face_power: float = 0.0
    face_jumps: float = 0.0
    damping: list = field(default_factory=lambda: [0.0, 0.0])

    def to_numbers(self):
        return asdict(self) | {
            "wall_force": self.wall_force.tolist(),
            "impulse": self.impulse.tolist(),
        }

    @classmethod
    def from_numbers(cls, numbers):
        arrays = {key: np.array(numbers[key]) for key in ("wall_force", "impulse")}
        return cls(**(numbers | arrays))


@dataclass(frozen=True)
class Bodies:
    """Grains of their own radius [um], mass [pg], moment of inertia [pg um^2] and material (its
    number), each (N,), in the sample's order."""

    radius: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    material: np.ndarray


@lru_cache(maxsize=4)
def walls_argument(box):
    """The walls of a Box as kernels take them."""
    return Walls(
        normal=box.normal.tolist(),
        offset=box.offset.tolist(),
        speed=box.speed.tolist(),
        strength=box.strength.tolist(),
    )


class Simulation(Readout):
    """State and kernels of one scene. `step` counts steps; `time` = step dt.

    radii [um]: of all grains, one number, or (N,) in the sample's order; radius, smallest: the
    largest and the smallest of them. mass [pg], inertia [pg um^2]: one number, or (N, 1) in
    internal order. volume [um^3]: of all grains. pair, wall: ContactParams; where grains are not
    all alike those of the contact that reaches farthest.
    """

    form = None  # what its kernels are compiled for, see build

    def __init__(
        self,
        *,
        fields,
        scratch,
        sums,
        kernels,
        layout,
        sample,
        order,
        box,
        cell,
        push,
        material,
        drive,
        pair,
        wall,
        mass,
        inertia,
        radius,
        skin,
        dt,
        threads,
        scenes=1,
        bodies=None,
    ):
        self.scenes = scenes  # of a batch, the `scene` field filled
        self.fields, self.scratch, self.sums, self.kernels = fields, scratch, sums, kernels
        self.layout, self.order, self.box, self.cell = layout, order, box, cell
        self.push = push
        self.material = material
        self.pair, self.wall = pair, wall
        self.mass, self.inertia, self.radius = mass, inertia, radius
        self.bodies = bodies
        # what kernels are told: where grains have masses of their own these are their units
        self._unit_mass, self._unit_inertia = mass, inertia
        self.radii = self.smallest = radius
        self.volume = len(order) * 4.0 / 3.0 * np.pi * radius**3
        if bodies is not None:
            self.mass, self.inertia = bodies.mass[order][:, None], bodies.inertia[order][:, None]
            self._unit_mass = self._unit_inertia = 1.0
            self.radii = bodies.radius
            self.radius, self.smallest = float(self.radii.max()), float(self.radii.min())
            self.volume = float(np.sum(4.0 / 3.0 * np.pi * self.radii**3))
        self.fixed_skin, self.skin = skin, skin or 0.0
        self.dt, self.threads = dt, threads
        self.grains = len(order)
        self.step = 0
        self.searched_at = 0
        self.searches = 0
        self.searching = nullcontext()  # entered around every search: a benchmark times it
        self.wall_due = NEVER
        self.books = Books()
        self._search_asked = False
        self._no_walls = Walls()
        self._move(drive)
        self._start(sample)

    @property
    def time(self):
        return self.step * self.dt

    # -- start -----------------------------------------------------------------------------------

    def _start(self, sample):
        """Grains into their fields, contacts found, loads of time 0, v and w half a step back."""
        order, n = self.order, self.grains
        self._put_grains("x", sample.positions[order] / units.LENGTH, far=True)
        self._put_grains("v", sample.velocities[order] / units.SPEED)
        self._put_grains("w", sample.spins[order] / units.SPIN)
        self.push.place(self.fields)
        if self.bodies is not None:
            for name, values in vars(self.bodies).items():
                self.fields[name].from_numpy(np.ascontiguousarray(values[order]))
        self._search()
        if sample.contacts is not None:
            self._take_contacts(sample.contacts)
        self._advance_once(0.0)
        self._clear_ledger()
        self.push.begin(self.fields["x"].to_numpy(), self._contact_loads()[0])
        force, torque = self.loads()
        half = 0.5 * self.dt
        v, w = self.fields["v"].to_numpy(), self.fields["w"].to_numpy()
        v[:n] -= half / self.mass * force
        w[:n] -= half / self.inertia * torque
        self.fields["v"].from_numpy(v)
        self.fields["w"].from_numpy(w)
        self.books.wall_force = self._wall_force()
        begin = self.measure()
        self.books.damping = [float(begin["loss"][2]), float(begin["loss_wall"][2])]
        self.books.face_power = self._face_power()

    def _put_grains(self, name, values, far=False):
        ghosts = np.array([[1e6, 0, 0], [-1e6, 0, 0]]) if far else np.zeros((2, 3))
        self.fields[name].from_numpy(np.ascontiguousarray(np.concatenate([values, ghosts])))

    def _clear_ledger(self):
        for name in (
            "loss",
            "wall_loss",
            "impulse",
            "impulse_total",
            "face_work",
            "wrap_work",
            "virial",
            "wall_virial",
            "flux",
        ):
            if name in self.fields:
                self.fields[name].fill(0.0)

    def _take_contacts(self, contacts):
        """Pointers and twist of contacts that a sample brings along."""
        rank = np.empty(self.grains, np.int64)
        rank[self.order] = np.arange(self.grains)
        i, j = rank[contacts["i"]], rank[contacts["j"]]
        swap = i > j
        low, high = np.minimum(i, j), np.maximum(i, j)
        first = np.where(swap[:, None], contacts["pointer_j"], contacts["pointer_i"])
        second = np.where(swap[:, None], contacts["pointer_i"], contacts["pointer_j"])
        own_i, own_j = self._pair_arrays()
        key = own_i.astype(np.int64) * self.grains + own_j
        if len(key) == 0:
            return
        wanted = low.astype(np.int64) * self.grains + high
        place = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
        known = key[place] == wanted
        state = self._lanes("state")
        layout = self.layout
        p = place[known]
        state[p, layout.pointer : layout.pointer + 3] = first[known]
        state[p, layout.second : layout.second + 3] = second[known]
        if layout.twist >= 0:
            state[p, layout.twist] = contacts["twist"][known]
        if layout.approach >= 0:
            state[p, layout.approach] = -contacts["approach"][known]
        self._put_lanes("state", state)

    # -- drive -----------------------------------------------------------------------------------

    def drive(self, drive):
        """Move walls and faces as `drive` (scene.Drive) says from this step on."""
        force, power = self._wall_force(), self._face_power()
        impulse = self.impulses()
        self.books.wall_work = self._wall_work(force, impulse)
        self.books.wall_force, self.books.impulse = force, impulse
        self._move(drive)
        self.books.face_jumps += 0.5 * self.dt * (self._face_power() - power)
        self.search()

    @property
    def domain(self):
        """What surrounds the grains and how it moves, a Domain."""
        t_c = characteristic_time(self.material) / units.TIME
        return Domain(self.dt, self.volume, self.radius, self.box, self.cell, t_c)

    def _move(self, drive):
        domain = self.domain.driven(drive, self.step)
        self.box, self.cell = domain.box, domain.cell
        if self.cell is not None:
            self.fields["cell"].from_numpy(self.cell.rows)

    def _closing_speed(self):
        """Speed at which faces may bring grains together [um/us]."""
        return self.domain.closing_speed(self.step)

    def _wall_speed(self):
        return self.domain.fastest_wall

    # -- steps -----------------------------------------------------------------------------------

    def advance(self, steps):
        """Make `steps` steps, searching for neighbours whenever it is due."""
        end = self.step + steps
        pending = 0
        while self.step < end:
            until = self.push.next_end(self.step, end)
            done, due = self._call(until - self.step, pending, self.dt)
            self.step += done
            pending = 0
            if self.step == until and until < NEVER:
                self._end_pushes()
            if due:
                with self.searching:
                    self._search(self.step + 1)
                pending = 1

    def _call(self, steps, pending, dt):
        # every grain has gone further than the root of -1: a search asked for is due at once
        reach2 = -1.0 if self._search_asked else (self._shares()[0] * self.skin) ** 2
        motion = self._motion(dt, self.wall_due, reach2)
        self.kernels.advance(
            steps, self.step, pending, self.threads, motion, self.pair, self.wall, self._walls()
        )
        sync = self.fields["sync"].to_numpy()
        return int(sync[DONE]), sync[DONE] < steps

    @lru_cache(maxsize=1)  # noqa: B019 (a simulation lives as long as its process)
    def _motion(self, dt, wall_due, reach2):
        return Motion(
            dt=dt,
            kick=dt / self._unit_mass,
            turn=dt / self._unit_inertia,
            reach2=reach2,
            wall_due=wall_due,
        )

    def _advance_once(self, dt):
        """Contacts and loads at the present positions, without moving anything."""
        step, self.step = self.step, self.step - 1
        self._call(1, 1, dt)
        self.step = step

    def _walls(self):
        return self._no_walls if self.box is None else walls_argument(self.box)

    def _shares(self):
        return DRIVEN if self._closing_speed() > 0.0 else STILL

    def _next_wall_due(self):
        """Step at which a wall or face has moved its part of the skin since the search of now.

        Found at the search, not later: faces may change speed, and when a grain is wrapped must
        not depend on how a run is cut into calls.
        """
        grains, faces = self._shares()
        due = NEVER
        for speed, share in ((self._wall_speed(), 1.0 - grains), (self._closing_speed(), faces)):
            if speed > 0.0:
                due = min(
                    due, self.searched_at + max(1, int(share * self.skin / (speed * self.dt)))
                )
        return due

    # -- search ----------------------------------------------------------------------------------

    def search(self):
        """Have the next step search for neighbours, whether it is due or not."""
        self._search_asked = True

    def _search(self, step=None):
        """New neighbour lists for the present positions; the history of contacts is kept exactly.

        The loads are void until the next pass over the contacts.
        Raises GuardStop when positions are no longer numbers or grains overlap without limit.
        """
        step = self.step if step is None else step
        self.kernels.bounds()
        bounds = self.scratch["bounds"].to_numpy()
        if bounds[6] > 0 or not np.isfinite(bounds[7]):
            self._stop_not_a_number()
        if self.fixed_skin is None:
            self.skin = self._best_skin(bounds[7])
        # bonds hold beyond first touch, down to pull-off
        touch = 2.0 * self.radius + PULL_OFF / self.pair.inv_delta0
        low, extent, edges = bounds[:3], bounds[3:6] - bounds[:3], np.zeros(3)
        if self.cell is not None:
            edges = self._wrap(step, touch)
            low = np.where(edges > 0.0, self.cell.low(step * self.dt), low)
            extent = np.where(edges > 0.0, edges, extent)
        reach = touch + self.skin
        cells, width = self._cells(extent, edges, reach)
        grid = Grid(
            origin=low.tolist(),
            inv_edge=(1.0 / width).tolist(),
            cells=cells.tolist(),
            edges=edges.tolist(),
        )
        alike = self.bodies is None
        # grains of their own radius are listed by the distance of their surfaces
        self.kernels.find(
            grid,
            self.scenes * int(np.prod(cells)),
            reach**2 if alike else reach - 2.0 * self.radius,
        )
        self._check_room()
        self.kernels.relist(edges.tolist())
        if self.box is not None:
            wall_reach = self.radius + self.skin + PULL_OFF / self.wall.inv_delta0
            wall_reach -= 0.0 if alike else self.radius
            self.kernels.relist_walls(
                self._walls(), step * self.dt, wall_reach, self.box.present.tolist()
            )
            self._check_room()
        self.kernels.list_entries()
        self.searched_at = step
        self.wall_due = self._next_wall_due()
        self.searches += 1
        self._search_asked = False

    def _cells(self, extent, edges, reach):
        """Numbers and widths of the cells of the grid: no cell is narrower than `reach`, and whole
        numbers of them fill a periodic edge."""
        width = reach * 1.000001
        while True:
            cells = np.floor(extent / width) + np.where(edges > 0.0, 0.0, 1.0)
            if self.scenes * np.prod(cells) <= CELLS_PER_GRAIN * self.grains + 60:
                break
            width *= 1.1
        cells = np.maximum(cells, 1.0)
        return cells.astype(int), np.where(edges > 0.0, edges / cells, width)

    def _wrap(self, step, touch):
        """Grains back into the cell; returns its edges. No pair may meet across two faces."""
        time = step * self.dt
        edges = self.cell.edges(time)
        shortest = edges[list(self.cell.axes)].min()
        most = 0.5 * shortest - touch
        if most < SKIN[0] * self.smallest:
            raise GuardStop(
                f"At {self.time:.6g} us the periodic cell has shrunk to {shortest:.4g} um, four "
                "radii: a grain would touch another twice, across both faces. Stop earlier, or "
                "take a larger sample."
            )
        self.skin = min(self.skin, most)
        # v stands half a step back
        speeds = self.cell.speeds(time - 0.5 * self.dt)
        self.kernels.wrap(
            self.cell.low(time).tolist(),
            np.where(edges > 0, edges, 1.0).tolist(),
            speeds.tolist(),
            self._unit_mass,
        )
        return edges

    def _best_skin(self, speed):
        """Skin [um] that costs least at the speed of the fastest grain [um/us].

        A search costs some eight steps, of small samples more (its launches cost as much as 5000
        grains), and is due every skin/(2 speed dt) steps; the pairs that are listed but do not
        touch make a step dearer by about five times skin/radius.
        """
        way = max(speed, 2.0 * self._wall_speed(), 2.0 * self._closing_speed()) * self.dt
        search = 8.0 * (1.0 + 5000.0 / self.grains)
        best = np.sqrt(0.4 * search * way * self.smallest)
        return float(np.clip(best, SKIN[0] * self.smallest, SKIN[1] * self.smallest))

    def _check_room(self):
        problem = self.fields["counts"].to_numpy()[2]
        if problem == 1:
            raise GuardStop(
                f"At {self.time:.6g} us some grain has more neighbours than can stand around it: "
                "grains overlap without limit. Try a smaller numerics.time_step, a lower speed, "
                "or a smaller numerics.skin."
            )
        if problem == 2:
            raise GuardStop(
                f"At {self.time:.6g} us more grains touch walls than there is room for; the sample "
                "is too flat. Try a sample that is higher than two grains."
            )

    def _stop_not_a_number(self):
        x = self.fields["x"].to_numpy()[: self.grains]
        bad = int(np.flatnonzero(~np.all(np.abs(x) < 1e12, axis=1))[0])
        raise GuardStop(
            f"At {self.time:.6g} us the position of grain {self.order[bad]} is not a number any "
            "more: the step is too long for what happens. Try a smaller numerics.time_step or "
            "a lower speed."
        )

    # -- checkpoint ------------------------------------------------------------------------------

    def arrays(self):
        """All state, for a checkpoint: what `kernels.store.declare` lists."""
        return {name: field.to_numpy() for name, field in self.fields.items()}

    def numbers(self):
        """The plain numbers that belong to `arrays`."""
        return {
            "step": self.step,
            "searched_at": self.searched_at,
            "wall_due": self.wall_due,
            "searches": self.searches,
            "skin": self.skin,
            "search_asked": self._search_asked,
            "books": self.books.to_numbers(),
            "box": None
            if self.box is None
            else [self.box.offset.tolist(), self.box.speed.tolist()],
            "cell": None if self.cell is None else self.cell.rows.tolist(),
        }

    def restore(self, arrays, numbers):
        """Go back to a checkpoint of the same scene and sample."""
        for name, place in self.fields.items():
            place.from_numpy(arrays[name])
        self.step = numbers["step"]
        self.searched_at = numbers["searched_at"]
        self.wall_due = numbers["wall_due"]
        self.searches = numbers["searches"]
        self.skin = numbers["skin"]
        self._search_asked = numbers["search_asked"]
        self.books = Books.from_numbers(numbers["books"])
        if self.box is not None:
            offset, speed = (np.array(row) for row in numbers["box"])
            self.box = replace(self.box, offset=offset, speed=speed)
        if self.cell is not None:
            rows = dict(
                zip(("start", "rate", "growth", "centre"), np.array(numbers["cell"]), strict=True)
            )
            self.cell = replace(self.cell, **rows)
