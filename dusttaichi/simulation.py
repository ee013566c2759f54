"""A built scene in motion: advances by whole steps, searches when due, measures. Internal units."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dusttaichi import units
from dusttaichi.errors import GuardStop
from dusttaichi.kernels.lanes import CHANNELS
from dusttaichi.kernels.measure import (
    ANGULAR,
    CONTACTS,
    DEEPEST,
    FASTEST,
    FASTEST_SPIN,
    LINEAR,
    NORMAL,
    PENDING,
    TWISTING,
)
from dusttaichi.kernels.search import CELLS_PER_GRAIN, Grid
from dusttaichi.kernels.walls import Walls
from dusttaichi.physics.constants import PULL_OFF
from dusttaichi.step import DONE, Motion

NEVER = 2**62
SKIN = (0.01, 0.4)  # least and most, of the radius


@dataclass(frozen=True)
class Kernels:
    """The compiled kernels of a scene."""

    advance: Callable
    bounds: Callable
    find: Callable
    relist: Callable
    list_entries: Callable
    relist_walls: Callable | None
    measure: tuple


class Simulation:
    """State and kernels of one scene. `step` counts steps; `time` = step dt."""

    def __init__(self, *, fields, scratch, sums, kernels, layout, sample, order, box, pair, wall,
                 mass, inertia, radius, skin, dt, threads):  # fmt: skip
        self.fields, self.scratch, self.sums, self.kernels = fields, scratch, sums, kernels
        self.layout, self.order, self.box = layout, order, box
        self.pair, self.wall = pair, wall
        self.mass, self.inertia, self.radius = mass, inertia, radius
        self.fixed_skin, self.skin = skin, skin or 0.0
        self.dt, self.threads = dt, threads
        self.grains = len(order)
        self.step = 0
        self.searched_at = 0
        self.searches = 0
        self.first_wall_force = np.zeros((6, 3))
        # half of the damping work of step 0 would belong to a time before it
        self.first_damping = [0.0, 0.0]
        self._search_asked = False
        self._no_walls = Walls()
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
        self._search()
        if sample.contacts is not None:
            self._take_contacts(sample.contacts)
        self._advance_once(0.0)
        self._clear_ledger()
        force, torque = self.loads()
        half = 0.5 * self.dt
        v, w = self.fields["v"].to_numpy(), self.fields["w"].to_numpy()
        v[:n] -= half / self.mass * force
        w[:n] -= half / self.inertia * torque
        self.fields["v"].from_numpy(v)
        self.fields["w"].from_numpy(w)
        self.first_wall_force = self._wall_force()
        begin = self.measure()
        self.first_damping = [float(begin["loss"][2]), float(begin["loss_wall"][2])]

    def _put_grains(self, name, values, far=False):
        ghosts = np.array([[1e6, 0, 0], [-1e6, 0, 0]]) if far else np.zeros((2, 3))
        self.fields[name].from_numpy(np.ascontiguousarray(np.concatenate([values, ghosts])))

    def _clear_ledger(self):
        for name in ("loss", "wall_loss", "impulse", "impulse_total"):
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

    # -- steps -----------------------------------------------------------------------------------

    def advance(self, steps):
        """Make `steps` steps, searching for neighbours whenever it is due."""
        end = self.step + steps
        pending = 0
        while self.step < end:
            done, due = self._call(end - self.step, pending, self.dt)
            self.step += done
            pending = 0
            if due:
                self._search(self.step + 1)
                pending = 1

    def _call(self, steps, pending, dt):
        # every grain has gone further than the root of -1: a search asked for is due at once
        reach2 = -1.0 if self._search_asked else (0.5 * self.skin) ** 2
        motion = self._motion(dt, self._wall_due(), reach2)
        self.kernels.advance(steps, self.step, pending, self.threads, motion, self.pair, self.wall,
                             self._walls())  # fmt: skip
        sync = self.fields["sync"].to_numpy()
        return int(sync[DONE]), sync[DONE] < steps

    @lru_cache(maxsize=1)  # noqa: B019 (a simulation lives as long as its process)
    def _motion(self, dt, wall_due, reach2):
        return Motion(
            dt=dt,
            kick=dt / self.mass,
            turn=dt / self.inertia,
            reach2=reach2,
            wall_due=wall_due,
        )

    def _advance_once(self, dt):
        """Contacts and loads at the present positions, without moving anything."""
        step, self.step = self.step, self.step - 1
        self._call(1, 1, dt)
        self.step = step

    def _walls(self):
        return self._no_walls if self.box is None else self.box.kernel_argument

    def _wall_due(self):
        """Step at which the fastest wall has moved half the skin since the last search."""
        speed = 0.0 if self.box is None else float(np.max(np.abs(self.box.speed)))
        if speed == 0.0:
            return NEVER
        return self.searched_at + max(1, int(0.5 * self.skin / (speed * self.dt)))

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
        reach = 2.0 * self.radius + self.skin + PULL_OFF / self.pair.inv_delta0
        extent = bounds[3:6] - bounds[:3]
        edge = reach * 1.000001
        while np.prod(np.floor(extent / edge) + 1.0) > CELLS_PER_GRAIN * self.grains + 60:
            edge *= 1.1
        cells = (np.floor(extent / edge) + 1).astype(int)
        grid = Grid(origin=bounds[:3].tolist(), inv_edge=[1.0 / edge] * 3, cells=cells.tolist())
        self.kernels.find(grid, int(np.prod(cells)), reach**2)
        self._check_room()
        self.kernels.relist()
        if self.box is not None:
            wall_reach = self.radius + self.skin + PULL_OFF / self.wall.inv_delta0
            self.kernels.relist_walls(self._walls(), step * self.dt, wall_reach,
                                      self.box.present.tolist())  # fmt: skip
            self._check_room()
        self.kernels.list_entries()
        self.searched_at = step
        self.searches += 1
        self._search_asked = False

    def _best_skin(self, speed):
        """Skin [um] that costs least at the speed of the fastest grain [um/us].

        A search costs some eight steps, of small samples more (its launches cost as much as 5000
        grains), and is due every skin/(2 speed dt) steps; the pairs that are listed but do not
        touch make a step dearer by about five times skin/radius.
        """
        walls = 0.0 if self.box is None else float(np.max(np.abs(self.box.speed)))
        way = max(speed, 2.0 * walls) * self.dt
        search = 8.0 * (1.0 + 5000.0 / self.grains)
        best = np.sqrt(0.4 * search * way * self.radius)
        return float(np.clip(best, SKIN[0] * self.radius, SKIN[1] * self.radius))

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

    # -- measuring -------------------------------------------------------------------------------

    def loads(self):
        """Force [nN] and torque [nN um] on every grain, (N, 3) each, in internal order."""
        start = self.fields["entry_start"].to_numpy()
        entry = self.fields["entry"].to_numpy()[: start[-1]]
        load = self._lanes("load")[entry >> 1]
        side = (entry & 1)[:, None]
        force = load[:, :3] * (1 - 2 * side)
        torque = np.where(side == 0, load[:, 3:6], load[:, 6:9])
        owner = np.repeat(np.arange(self.grains), np.diff(start))
        out = np.zeros((2, self.grains, 3))
        np.add.at(out[0], owner, force)
        np.add.at(out[1], owner, torque)
        return out

    def _wall_force(self):
        """Force of each wall on the grains now [nN], (6, 3)."""
        if self.box is None:
            return np.zeros((6, 3))
        self.kernels.measure[2](self._walls(), self.time, self.wall, self.dt)
        return self.sums["wall_force"].to_numpy()

    def impulses(self):
        """Time integral of the wall forces since the start [nN us], (6, 3)."""
        total = self.fields["impulse_total"].to_numpy()
        blocks = int(self.fields["counts"].to_numpy()[1])
        lanes = self.fields["impulse"].to_numpy()[:blocks].reshape(blocks, 3, -1)
        of = self.fields["wall_of"].to_numpy()[:blocks]
        np.add.at(total, of, lanes.sum(axis=2))
        return total

    def measure(self):
        """Energies [fJ], counts and extremes of the present moment, as a dict of numbers."""
        half = 0.5 * self.dt
        measure_grains, measure_pairs, measure_walls = self.kernels.measure
        measure_grains(self.mass, self.inertia, half / self.mass, half / self.inertia)
        measure_pairs(self.pair, self.dt)
        grains = self.sums["grain_sum"].to_numpy()
        counts = self.fields["counts"].to_numpy()
        per_tile = self.layout.width * self.layout.tile
        pairs = self.sums["pair_sum"].to_numpy()[: -(-counts[0] // per_tile)]
        out = {
            "kinetic_translation": grains[:, LINEAR].sum(),
            "kinetic_rotation": grains[:, ANGULAR].sum(),
            "largest_speed": grains[:, FASTEST].max(),
            "largest_spin": grains[:, FASTEST_SPIN].max(),
            "contacts": int(round(pairs[:, CONTACTS].sum())),
            "potential": pairs[:, NORMAL : TWISTING + 1].sum(axis=0),
            "loss": self._losses("loss"),
            "largest_overlap": pairs[:, DEEPEST].max(initial=0.0),
            "wall_contacts": 0,
            "potential_wall": np.zeros(4),
            "loss_wall": np.zeros(len(CHANNELS)),
            "wall_work": 0.0,
        }
        out["loss"][2] += pairs[:, PENDING].sum() - self.first_damping[0]
        if self.box is not None:
            force = self._wall_force()
            walls = self.sums["wall_sum"].to_numpy()[: -(-counts[1] // self.layout.tile)]
            out["wall_contacts"] = int(round(walls[:, CONTACTS].sum()))
            out["potential_wall"] = walls[:, NORMAL : TWISTING + 1].sum(axis=0)
            out["loss_wall"] = self._losses("wall_loss")
            out["loss_wall"][2] += walls[:, PENDING].sum() - self.first_damping[1]
            out["largest_overlap"] = max(out["largest_overlap"], walls[:, DEEPEST].max(initial=0.0))
            velocity = self.box.speed[:, None] * self.box.normal
            # the force of a step acts half before and half after it
            impulse = self.impulses() + half * (self.first_wall_force - force)
            out["wall_work"] = float(np.sum(velocity * impulse))
        return out

    def _losses(self, name):
        table = self.fields[name].to_numpy()
        return table.reshape(len(table), len(CHANNELS), -1).sum(axis=(0, 2))

    # -- arrays ----------------------------------------------------------------------------------

    def _pair_arrays(self):
        pairs = int(self.fields["counts"].to_numpy()[0])
        return (self.fields["pair_i"].to_numpy().reshape(-1)[:pairs],
                self.fields["pair_j"].to_numpy().reshape(-1)[:pairs])  # fmt: skip

    def _lanes(self, name):
        """A lane field (blocks, components) as an array (contacts, components)."""
        a = self.fields[name].to_numpy()
        a = a.reshape(a.shape[0], a.shape[1], -1)
        return np.ascontiguousarray(a.transpose(0, 2, 1)).reshape(-1, a.shape[1])

    def _put_lanes(self, name, contacts):
        W = self.layout.width
        a = contacts.reshape(-1, W, contacts.shape[1]).transpose(0, 2, 1)
        self.fields[name].from_numpy(np.ascontiguousarray(a))

    def grain_state(self):
        """Positions [um], velocities [um/us], spins [rad/us] now, (N, 3), in the sample's order."""
        n = self.grains
        force, torque = self.loads()
        half = 0.5 * self.dt
        x = self.fields["x"].to_numpy()[:n]
        v = self.fields["v"].to_numpy()[:n] + half / self.mass * force
        w = self.fields["w"].to_numpy()[:n] + half / self.inertia * torque
        out = np.empty((3, n, 3))
        out[:, self.order] = x, v, w
        return out

    def contact_state(self):
        """Contacts between grains now, a dict of arrays; grains by the sample's numbers."""
        i, j = self._pair_arrays()
        state = self._lanes("state")[: len(i)]
        layout = self.layout
        first, second = layout.pointer, layout.second
        on = np.sum(state[:, first : first + 3] ** 2, axis=1) > 0.5
        i, j, state = i[on], j[on], state[on]
        x = self.fields["x"].to_numpy()
        distance = np.linalg.norm(x[i] - x[j], axis=1)
        return {
            "grain_i": self.order[i],
            "grain_j": self.order[j],
            "pointer_i": state[:, first : first + 3],
            "pointer_j": state[:, second : second + 3],
            "overlap": 2.0 * self.radius - distance,
        } | self._twist_and_approach(state)

    def _twist_and_approach(self, state):
        zero = np.zeros(len(state))
        twist, approach = self.layout.twist, self.layout.approach
        return {
            "twist": state[:, twist] if twist >= 0 else zero,
            # stored as speed of separation
            "approach": -state[:, approach] if approach >= 0 else zero,
        }

    def wall_contact_state(self):
        """Contacts with walls now, a dict of arrays; feet and overlaps in um."""
        blocks = int(self.fields["counts"].to_numpy()[1])
        W = self.layout.width
        first = len(self.fields["pair_i"].to_numpy())
        state = self._lanes("state")[first * W : (first + blocks) * W]
        grain = self.fields["wall_grain"].to_numpy().reshape(-1)[: blocks * W]
        wall = np.repeat(self.fields["wall_of"].to_numpy()[:blocks], W)
        p, f = self.layout.pointer, self.layout.second
        on = np.sum(state[:, p : p + 3] ** 2, axis=1) > 0.5
        grain, wall, state = grain[on], wall[on], state[on]
        x = self.fields["x"].to_numpy()[grain]
        offset = self.box.offset + self.box.speed * self.time
        distance = np.sum(x * self.box.normal[wall], axis=1) - offset[wall]
        return {
            "grain": self.order[grain],
            "wall": wall,
            "pointer": state[:, p : p + 3],
            "foot": state[:, f : f + 3],
            "overlap": self.radius - distance,
        } | self._twist_and_approach(state)

    def wall_distances(self):
        """Distance of every centre from every wall [um], (N, 6), in the sample's order."""
        x = self.fields["x"].to_numpy()[: self.grains]
        offset = self.box.offset + self.box.speed * self.time
        out = np.empty((self.grains, 6))
        out[self.order] = x @ self.box.normal.T - offset
        return out

    # -- checkpoint ------------------------------------------------------------------------------

    def arrays(self):
        """All state, for a checkpoint: what `kernels.store.declare` lists."""
        return {name: field.to_numpy() for name, field in self.fields.items()}

    def numbers(self):
        """The plain numbers that belong to `arrays`."""
        return {
            "step": self.step,
            "searched_at": self.searched_at,
            "searches": self.searches,
            "skin": self.skin,
            "first_wall_force": self.first_wall_force.tolist(),
            "first_damping": self.first_damping,
        }

    def restore(self, arrays, numbers):
        """Go back to a checkpoint of the same scene and sample."""
        for name, field in self.fields.items():
            field.from_numpy(arrays[name])
        self.step = numbers["step"]
        self.searched_at = numbers["searched_at"]
        self.searches = numbers["searches"]
        self.skin = numbers["skin"]
        self.first_wall_force = np.array(numbers["first_wall_force"])
        self.first_damping = numbers["first_damping"]
