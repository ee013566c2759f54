"""Sticking speed of two bodies, or of one and a wall, by bundles of speeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf, sqrt
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable, glue_wall
from dusttaichi.grains.grain_scene import GrainsScene
from dusttaichi.grains.impacts import beyond_model, hardest_impact
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.constants import ContactConstants
from dusttaichi.samples import Sample
from dusttaichi.samples.materials import Materials
from dusttaichi.scene import Scene, quantities
from dusttaichi.studies.points import read_result_keys
from dusttaichi.studies.requests import Request, count_cores, make_key
from dusttaichi.studies.scene_settings import make_portable, set_one_thread
from dusttaichi.studies.step_times import estimate_step_time
from dusttaichi.studies.sticking_task import NORMAL_UPDATES, make_moving_bodies
from dusttaichi.studies.study_types import PointResult

TOGETHER = 16  # speeds of a round
ROUNDS = 12  # most of a search
WIDER = 10.0  # growth of a bracket without the sticking speed
JUMPS = 0.77224  # energy lost on forming and breaking, over F_c delta0: 0.69886 + 0.07338
# A contact is found up to v dt too late, which raises the sticking speed by up to
# 0.58 v dt/delta0, a quarter of the tolerance.
LATEST = 0.4
TASK = "dusttaichi.studies.sticking_task:run"
GAP = 2e-3  # initial distance over the radius, where the scene sets none


def compute_closed_form(scene: GrainsScene, sample: Sample | None = None) -> float:
    """Sticking speed of two single grains, or of one and a wall, head-on without damping [m/s].

    sqrt(2 x 0.77224 F_c delta0/m) with the reduced mass: the loss of the potential of S12 when a
    contact forms and breaks. For samples of more grains, of the first and the last.
    """
    contact = find_contact(scene, samples.make(scene) if sample is None else sample)
    return sqrt(2.0 * JUMPS * contact.F_c * contact.delta0 / contact.mass)


def find_contact(scene: GrainsScene, sample: Sample) -> ContactConstants:
    """ContactConstants of the first grain and the last, or of the first and a wall."""
    materials, interaction = scene.all_materials, scene.interaction
    number = np.zeros(len(sample), int) if sample.materials is None else sample.materials
    a, b = (materials[number[n]] for n in (0, -1))
    r1, r2 = (a.radius, b.radius) if sample.radii is None else sample.radii[[0, -1]]
    contact: ContactConstants
    if scene.boundary.walls:
        wall = constants.wall_constants(a, interaction, r1, materials[0])
        contact = glue_wall(wall, scene.boundary)
    else:
        contact = constants.mixed_constants(a, r1, b, r2, interaction)
    return contact


class Collision:
    """The collision of a scene at any speed.

    The time step of single grains is shortened for the tolerance. file: of the rows of its
    requests, see Request. start: remark on the initial positions, or "".
    """

    def __init__(self, scene: GrainsScene, tolerance: float, file: Path | None = None) -> None:
        if not 0.0 < tolerance < 1.0:
            raise DustError(f"--tolerance {tolerance:g}; allowed: a number between 0 and 1.")
        self._file, (scene, self.start) = file, _separate_pair(scene)
        self.sample, _, _ = make_moving_bodies(scene)
        self.closed = compute_closed_form(scene, self.sample)
        time_step = chosen_step(ContactTable.for_sample(scene, self.sample), self.sample).dt
        self.time = _find_stop_time(scene, time_step)
        if len(self.sample) <= 2:
            overlap = find_contact(scene, self.sample).delta0
            time_step = min(time_step, LATEST * tolerance * overlap / self.closed)
            step_text = f"{time_step:.17g} s"
            scene = cast(GrainsScene, scene.with_value("numerics.time_step", step_text))
        data = set_one_thread(scene.plain)
        self._expected = estimate_step_time(scene, len(self.sample))[1] * self.time / time_step
        self._inputs, self.scene = tuple(make_portable(data)), scene
        self._small = Scene.from_dict(data, title=f"the scene of {scene.name}")
        self._text = self._small.to_yaml()
        self._core = read_result_keys(self._text) | {"name": ""}

    @property
    def is_closed(self) -> bool:
        """True where the closed form is valid."""
        head_on = not self.sample.info.get("impact_parameter")
        undamped = self.scene.interaction.damping.model == "none"
        return len(self.sample) <= 2 and undamped and head_on and not self.sample.spins.any()

    def describe_excess(self, speeds: NDArray[np.float64]) -> str:
        """Sentence about the `speeds` [m/s], ascending, beyond the contact model, or ""."""
        table = ContactTable.for_sample(self.scene, self.sample)
        contacts = table.extreme_walls if self.scene.boundary.walls else table.extreme_pairs
        return str(beyond_model(speeds, hardest_impact(contacts, speeds[-1])))

    def make_request(self, speed: float, normal_updates: int = NORMAL_UPDATES) -> Request:
        """The Request of the outcome at a relative speed of the bodies [m/s]."""
        arguments = {"scene": self._text, "speed": float(speed), "time": self.time}
        arguments["normal_updates"] = normal_updates
        return Request(
            label=make_key(self._core, float(speed), self.time),
            task=TASK,
            arguments=arguments,
            file=self._file,
            inputs=self._inputs,
            cores=count_cores(self._small),
            expected=self._expected,
        )


def _separate_pair(scene: GrainsScene) -> tuple[GrainsScene, str]:
    """(scene, with an initial distance of a pair that has none; remark on it)."""
    pair: Any = scene.sample
    if pair.kind != "pair":
        return scene, ""
    if pair.gap is pair.distance is None:
        gap = quantities.format(GAP * scene.material.radius, "length", digits=3)
        text = f"{gap} apart (set sample.gap or distance for another start)"
        return cast(GrainsScene, scene.with_value("sample.gap", gap)), text
    sample = samples.make(scene)
    radii = Materials(scene).radii_of(sample) * np.ones(2)
    if np.linalg.norm(np.subtract(*sample.positions)) < radii.sum():
        return scene, "in contact: the speed is that of an escape, not of a collision"
    return scene, ""


def _find_stop_time(scene: Scene, dt: float) -> float:
    """Simulated time after the first contact [s]."""
    stop: Any = scene.stop
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
    speeds: NDArray[np.float64]
    bound: NDArray[np.bool_]
    time_step: float
    start: str = ""

    @property
    def speed(self) -> float:
        """Middle of the bracket [m/s]."""
        return 0.5 * (self.low + self.high)

    @property
    def sticking_above(self) -> NDArray[np.float64]:
        """Simulated speeds above the bracket that lead to sticking, too [m/s]."""
        return self.speeds[(self.speeds > self.high) & self.bound]


class Search:
    """Study of the sticking speed of a scene, by bundles of speeds.

    The sample is a pair, a collision, or explicit grains at a wall; its stop is relative to the
    first contact. tolerance: largest width of the bracket over its lower end. low, high [m/s]:
    first bracket, by default about the closed form. directory: of the file of the simulated speeds,
    from which an interrupted search continues; None: they are not stored. log: called with a line
    before and after each round.
    `points` and the constructor raise DustError for a scene without two bodies, without a time of
    the stop, or without a sticking speed.
    """

    timed = False

    def __init__(
        self,
        scene: GrainsScene,
        tolerance: float = 1e-3,
        low: float | None = None,
        high: float | None = None,
        *,
        directory: str | Path | None = None,
        log: Callable[[str], None] = lambda text: None,
    ) -> None:
        self.scene, self.tolerance, self.log = scene, tolerance, log
        self.directory = None if directory is None else Path(directory)
        self.file = None if self.directory is None else self.directory / "search.jsonl"
        self.collision = collision = Collision(scene, tolerance, self.file)
        few = len(collision.sample) <= 2
        low = collision.closed * (0.25 if few else 1.0) if low is None else low
        high = max(collision.closed * (4.0 if few else 100.0), 4.0 * low) if high is None else high
        if not 0.0 < low < high:
            text = "both must be above 0, and the second above the first."
            raise DustError(f"--low {low:g} m/s, --high {high:g} m/s: {text}")
        self.bracket, self._rounds, self._speeds = (low, high), 0, np.geomspace(low, high, TOGETHER)

    @property
    def beyond(self) -> str:
        """Sentence about speeds of the next round beyond the contact model, or ""."""
        return self.collision.describe_excess(self._speeds)

    def points(self, results: Mapping[str, PointResult]) -> list[Request]:
        """The next round, none where the bracket is narrow enough."""
        requests = self._make_requests()
        if not all(point.label in results for point in requests):
            ends = f"{self._speeds[0]:.5g} to {self._speeds[-1]:.5g} m/s"
            self.log(f"round {self._rounds + 1}: {len(requests)} speeds from {ends}")
            return requests
        for failed in (result for result in results.values() if not result.ok):
            raise DustError(failed.text)
        self._rounds += 1
        speeds, bound = _sort_speeds(results)
        bound_count = sum(results[point.label].measured["bound"] for point in requests)
        self.log(f"round {self._rounds}: {bound_count} of {len(requests)} bound")
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
        self._speeds = np.geomspace(*self.bracket, count)[inside]
        return self.points(results)

    def _make_requests(self) -> list[Request]:
        # whether they stick is seen at the end
        return [self.collision.make_request(speed, normal_updates=1) for speed in self._speeds]

    def build_result(self, results: Mapping[str, PointResult]) -> Sticking:
        """The Sticking, once all points are found."""
        low, high = self.bracket
        speeds, bound = _sort_speeds(results)
        return Sticking(
            low,
            high,
            self.collision.closed,
            speeds,
            bound,
            time_step=min(result.measured["time_step"] for result in results.values()),
            start=self.collision.start,
        )


def _sort_speeds(
    results: Mapping[str, PointResult],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(speeds [m/s], bound), in ascending order."""
    bound_by_speed = {
        cast(Request, result.point).arguments["speed"]: result.measured["bound"]
        for result in results.values()
    }
    speeds = np.array(sorted(bound_by_speed))
    return speeds, np.array([bound_by_speed[speed] for speed in speeds])


def list_rows(sticking: Sticking) -> list[tuple[str, str]]:
    """Rows (name, value) of text of a Sticking."""
    lines = [
        (
            "sticking speed",
            f"{sticking.speed:.6g} ± {0.5 * (sticking.high - sticking.low):.1g} m/s",
        ),
        ("the same without damping, for two grains", f"{sticking.closed:.6g} m/s"),
        ("time step", f"{sticking.time_step * 1e12:.4g} ps"),
        ("simulated speeds", str(len(sticking.speeds))),
    ]
    if sticking.start:
        lines.append(("initial positions", sticking.start))
    if len(sticking.sticking_above):
        lines.append(("sticking also at", ", ".join(f"{v:.4g}" for v in sticking.sticking_above)))
    return lines


def parse_speed(name: str, text: str | None) -> float | None:
    """The speed [m/s] of an option; None without it. Raises DustError."""
    return None if text is None else quantities.parse(text, "speed", name)
