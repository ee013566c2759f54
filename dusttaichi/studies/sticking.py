"""Sticking speed of two bodies, or of one and a wall, by bundles of speeds."""

from dataclasses import dataclass
from math import inf, sqrt
from pathlib import Path

import numpy as np

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable, glue_wall
from dusttaichi.grains.impacts import beyond_model, hardest_impact
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.physics.contact import constants
from dusttaichi.samples.materials import Materials
from dusttaichi.scene import Scene, quantities
from dusttaichi.studies.points import core_of
from dusttaichi.studies.requests import Request, cores_of, key_of
from dusttaichi.studies.settings import data_of, one_thread, portable
from dusttaichi.studies.step_times import estimate_step_time
from dusttaichi.studies.sticking_task import LOOKS, moving_bodies

TOGETHER = 16  # speeds of a bundle
ROUNDS = 12  # most bundles of a search
WIDER = 10.0  # growth of a bracket without the sticking speed
JUMPS = 0.77224  # energy lost on forming and breaking, over F_c delta0: 0.69886 + 0.07338
# A contact is found up to v dt too late, which raises the sticking speed by up to
# 0.58 v dt/delta0, a quarter of the tolerance.
LATEST = 0.4
TASK = "dusttaichi.studies.sticking_task:run"
GAP = 2e-3  # initial distance over the radius, where the scene sets none


def closed_form(scene, sample=None):
    """Sticking speed of two single grains, or of one and a wall, head-on without damping [m/s].

    sqrt(2 x 0.77224 F_c delta0/m) with the reduced mass: the loss of the potential of S12 when a
    contact forms and breaks. For samples of more grains, of the first and the last.
    """
    contact = meeting(scene, samples.make(scene) if sample is None else sample)
    return sqrt(2.0 * JUMPS * contact.F_c * contact.delta0 / contact.mass)


def meeting(scene, sample):
    """ContactConstants of the first grain and the last, or of the first and a wall."""
    kinds, interaction = scene.all_materials, scene.interaction
    number = np.zeros(len(sample), int) if sample.materials is None else sample.materials
    ends = [
        (kinds[number[n]], kinds[number[n]].radius if sample.radii is None else sample.radii[n])
        for n in (0, -1)
    ]
    (a, r1), (b, r2) = ends
    if scene.boundary.walls:
        return glue_wall(constants.wall_constants(a, interaction, r1, kinds[0]), scene.boundary)
    return constants.mixed_constants(a, r1, b, r2, interaction)


class Collision:
    """The collision of a scene at any speed.

    The time step of single grains is shortened for the tolerance. file: of the rows of its
    requests, see Request. start: remark on the initial positions, or "".
    """

    def __init__(self, scene, tolerance, file=None):
        if not 0.0 < tolerance < 1.0:
            raise DustError(f"--tolerance {tolerance:g}; allowed: a number between 0 and 1.")
        self._file, (scene, self.start) = file, _apart(scene)
        self.sample, _, _ = moving_bodies(scene)
        self.closed = closed_form(scene, self.sample)
        time_step = chosen_step(ContactTable.for_sample(scene, self.sample), self.sample).dt
        self.time = _stop_time(scene, time_step)
        if len(self.sample) <= 2:
            overlap = meeting(scene, self.sample).delta0
            time_step = min(time_step, LATEST * tolerance * overlap / self.closed)
            scene = scene.with_value("numerics.time_step", f"{time_step:.17g} s")
        data = one_thread(data_of(scene))
        self._expected = estimate_step_time(scene, len(self.sample))[1] * self.time / time_step
        self._inputs, self.scene = tuple(portable(data)), scene
        self._small = Scene.from_dict(data, title=f"the scene of {scene.name}")
        self._text = self._small.to_yaml()
        self._core = core_of(self._text) | {"name": ""}

    @property
    def is_closed(self):
        """True where the closed form is valid."""
        head_on = not self.sample.info.get("impact_parameter")
        undamped = self.scene.interaction.damping.model == "none"
        return len(self.sample) <= 2 and undamped and head_on and not self.sample.spins.any()

    def beyond(self, speeds):
        """Sentence about the `speeds` [m/s], ascending, beyond the contact model, or ""."""
        table = ContactTable.for_sample(self.scene, self.sample)
        contacts = table.extreme_walls if self.scene.boundary.walls else table.extreme_pairs
        return beyond_model(speeds, hardest_impact(contacts, speeds[-1]))

    def request(self, speed, looks=LOOKS):
        """The Request of the outcome at a relative speed of the bodies [m/s]."""
        arguments = {"scene": self._text, "speed": float(speed), "time": self.time, "looks": looks}
        return Request(
            label=key_of(self._core, float(speed), self.time),
            task=TASK,
            arguments=arguments,
            file=self._file,
            inputs=self._inputs,
            cores=cores_of(self._small),
            expected=self._expected,
        )


def _apart(scene):
    """(scene, with an initial distance of a pair that has none; remark on it)."""
    pair = scene.sample
    if pair.kind != "pair":
        return scene, ""
    if pair.gap is pair.distance is None:
        gap = quantities.format(GAP * scene.material.radius, "length", digits=3)
        text = f"{gap} apart (set sample.gap or distance for another start)"
        return scene.with_value("sample.gap", gap), text
    sample = samples.make(scene)
    radii = Materials(scene).radii_of(sample) * np.ones(2)
    if np.linalg.norm(np.subtract(*sample.positions)) < radii.sum():
        return scene, "in contact: the speed is that of an escape, not of a collision"
    return scene, ""


def _stop_time(scene, dt):
    """Simulated time after the first contact [s]."""
    stop = scene.stop
    if stop is None or (stop.time is None and stop.steps is None):
        raise DustError("stop: must have a time or a number of steps, such as {time: 1 us}")
    return min(stop.time or inf, (stop.steps or inf) * dt)


@dataclass(frozen=True)
class Sticking:
    """The lowest speed at which the bodies of a collision do not stick.

    low, high [m/s]: two neighbouring speeds, of which only the first leads to sticking. closed
    [m/s]: `closed_form`. speeds [m/s], bound: all simulated ones, in ascending order. time_step
    [s]: of the fastest. start: remark on the initial positions, or "".
    """

    low: float
    high: float
    closed: float
    speeds: np.ndarray
    bound: np.ndarray
    time_step: float
    start: str = ""

    @property
    def speed(self):
        """Middle of the bracket [m/s]."""
        return 0.5 * (self.low + self.high)

    @property
    def again(self):
        """Simulated speeds above the bracket that lead to sticking, too [m/s]."""
        return self.speeds[(self.speeds > self.high) & self.bound]


class Search:
    """Study of the sticking speed of a scene, by bundles of speeds.

    The sample is a pair, a collision, or explicit grains at a wall; its stop is relative to the
    first contact. tolerance: largest width of the bracket over its lower end. low, high [m/s]:
    first bracket, by default about the closed form. directory: of the file of the simulated speeds,
    from which an interrupted search continues; None: they are not stored. log: called with a line
    before and after each bundle.
    `points` and the constructor raise DustError for a scene without two bodies, without a time of
    the stop, or without a sticking speed.
    """

    timed = False

    def __init__(
        self, scene, tolerance=1e-3, low=None, high=None, *, directory=None, log=lambda text: None
    ):
        self.scene, self.tolerance, self.log = scene, tolerance, log
        self.directory = None if directory is None else Path(directory)
        self.file = None if directory is None else self.directory / "search.jsonl"
        self.collision = collision = Collision(scene, tolerance, self.file)
        few = len(collision.sample) <= 2
        low = collision.closed * (0.25 if few else 1.0) if low is None else low
        high = max(collision.closed * (4.0 if few else 100.0), 4.0 * low) if high is None else high
        if not 0.0 < low < high:
            text = "both must be above 0, and the second above the first."
            raise DustError(f"--low {low:g} m/s, --high {high:g} m/s: {text}")
        self.bracket, self._rounds, self._asked = (low, high), 0, np.geomspace(low, high, TOGETHER)

    @property
    def beyond(self):
        """Sentence about speeds of the next bundle beyond the contact model, or ""."""
        return self.collision.beyond(self._asked)

    def points(self, results_by_label):
        """The next bundle, none where the bracket is narrow enough."""
        requests = self._wanted()
        if not all(point.label in results_by_label for point in requests):
            ends = f"{self._asked[0]:.5g} to {self._asked[-1]:.5g} m/s"
            self.log(f"bundle {self._rounds + 1}: {len(requests)} speeds from {ends}")
            return requests
        for failed in (result for result in results_by_label.values() if not result.ok):
            raise DustError(failed.text)
        self._rounds += 1
        speeds, bound = _all_speeds(results_by_label)
        bound_count = sum(results_by_label[point.label].measured["bound"] for point in requests)
        self.log(f"bundle {self._rounds}: {bound_count} of {len(requests)} bound")
        low, high = self.bracket
        first = int(np.argmin(bound))
        if bound.all():
            self.bracket, count, inside = (high, high * WIDER), TOGETHER, slice(None)
        elif first == 0:
            self.bracket, count, inside = (low / WIDER, low), TOGETHER, slice(None)
        else:  # its ends are known
            self.bracket = float(speeds[first - 1]), float(speeds[first])
            if self.bracket[1] - self.bracket[0] <= self.tolerance * self.bracket[0]:
                return requests
            count, inside = TOGETHER + 2, slice(1, -1)
        if self._rounds == ROUNDS:
            fraction = "all" if bound.all() else "none" if not bound.any() else "some"
            raise DustError(
                f"No sticking speed was found: between {speeds[0]:.3g} and {speeds[-1]:.3g} m/s "
                f"{fraction} of the collisions lead to sticking. Try another --low and --high, or "
                "a longer stop.time."
            )
        self._asked = np.geomspace(*self.bracket, count)[inside]
        return self.points(results_by_label)

    def _wanted(self):
        # whether they stick is seen at the end
        return [self.collision.request(speed, looks=1) for speed in self._asked]

    def result(self, results_by_label):
        """The Sticking, once all points are found."""
        steps = [result.measured["time_step"] for result in results_by_label.values()]
        remaining = (
            self.collision.closed,
            *_all_speeds(results_by_label),
            min(steps),
            self.collision.start,
        )
        return Sticking(*self.bracket, *remaining)


def _all_speeds(results_by_label):
    """(speeds [m/s], bound), in ascending order."""
    bound_by_speed = {
        result.point.arguments["speed"]: result.measured["bound"]
        for result in results_by_label.values()
    }
    speeds = np.array(sorted(bound_by_speed))
    return speeds, np.array([bound_by_speed[speed] for speed in speeds])


def rows(sticking):
    """Rows (name, value) of text of a Sticking."""
    lines = [
        (
            "sticking speed",
            f"{sticking.speed:.6g} ± {0.5 * (sticking.high - sticking.low):.1g} m/s",
        ),
        ("two grains (or grain and wall), no damping", f"{sticking.closed:.6g} m/s"),
        ("time step", f"{sticking.time_step * 1e12:.4g} ps"),
        ("simulated speeds", str(len(sticking.speeds))),
    ]
    if sticking.start:
        lines.append(("initial positions", sticking.start))
    if len(sticking.again):
        lines.append(("sticking also at", ", ".join(f"{v:.4g}" for v in sticking.again)))
    return lines


def speed_of(name, text):
    """The speed [m/s] of an option; None without it. Raises DustError."""
    return None if text is None else quantities.parse(text, "speed", name)
