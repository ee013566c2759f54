"""The trade between speed and accuracy of a scene, measured: `dust trade`.

A point is a changed scene, which the engine runs; errors are relative to a converged reference, and
changes that pay are combined.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from dusttaichi import analysis
from dusttaichi.analysis import observables
from dusttaichi.analysis.observables import ObservableValues
from dusttaichi.errors import DustError
from dusttaichi.method.trade import KINDS, NUMERICAL, Point, changed
from dusttaichi.scene import Scene
from dusttaichi.studies import points
from dusttaichi.studies import trade_points as wanted_points
from dusttaichi.studies.trade_judge import Judge, Row, cheapest, offers, refuse_unknown, walk

LEAST_NOISE = 0.02  # of a cost
QUICK_SEEDS, SEEDS = 2, 4
LONGEST = 120  # characters of a directory's name
DEFAULT = Point("default", "default")
AGAIN = Point("default again", "default", again=True)


@dataclass(frozen=True)
class Trade:
    """Result of a trade.

    rows: default first, then presets (that of the reference last), single changes, combinations.
    seeds: Measured of the default with each seed, its own first. numerical, anything: cheapest
    accepted Row of numerical parameters, and of all, or None. left_out: parameter -> reason. noise:
    of a cost. check: Row that gives the error of the reference, such as that at half its step.
    """

    scene: Scene
    judge: Judge
    rows: tuple[Row, ...]
    seeds: tuple[ObservableValues, ...]
    check: Row
    numerical: Row | None
    anything: Row | None
    left_out: dict[str, str]
    noise: float


@dataclass(frozen=True)
class Wanted:
    """Plan of a trade.

    names: of the parameters. quick: three levels of each. seeds: how many in all, None: 4, quick 2.
    tolerance: largest accepted error, a share. observable: name of the number whose error decides,
    or None for the first.
    """

    names: tuple[str, ...] = wanted_points.NAMES
    quick: bool = False
    seeds: int | None = None
    tolerance: float = 0.05
    observable: str | None = None

    def plan(self, scene):
        """(points beside the default, check of the reference and seeds, left out) of a scene."""
        own = wanted_points.parameters_of(scene)
        singles, left_out = wanted_points.ladder(scene, self.names, self.quick)
        seeds = self.seeds or (QUICK_SEEDS if self.quick else SEEDS)
        behind = [own.check(scene), *wanted_points.seeds(scene, seeds)]
        return [*own.presets(scene), *singles], behind, left_out


class Missing(Exception):
    """Points (engine) that have not been found yet."""


class TradeStudy:
    """Study of the points of a trade.

    The trade is computed from the results that are there, until one is missing: what it asks for
    depends on the errors and costs of all points before. found: the Trade, once all are there.
    """

    timed = True  # costs are those of this code

    def __init__(self, scene, directory, plan, *, threads=1, log=lambda text: None):
        self.given, self.scene, self.wanted = scene, wanted_points.base(scene, threads), plan
        self.directory, self.log = Path(directory), log
        self.found, self._labels, self._said = None, {}, set()

    @property
    def file(self):
        """File of the dataset."""
        return self.directory / "trade.nc"

    def points(self, results_by_label):
        """The points whose results are missing."""

        def run(some):
            return self._results(some, results_by_label)

        try:
            self.found = trade(self.scene, run, self.wanted, log=self._say)
        except Missing as missing:
            return missing.args[0]
        return []

    def measure(self, run):
        """The numbers of a Row of a run, without its cost."""
        return {
            "status": run.status,
            "steps": int(run.series.step[-1]),
            "time_step": float(run.attrs["time_step"]),
            "ledger": analysis.compute_ledger(run).worst,
            "measured": observables.measure_observables(run),
        }

    def dataset(self, results_by_label):
        """The dataset of the trade."""
        from dusttaichi.studies.trade_report import dataset

        return dataset(self.found, self.given)

    def _results(self, requested, results_by_label):
        """label -> Row of points; equal scenes run once. Raises Missing."""
        rows, missing = {}, {}
        for point in requested:
            try:
                scene = changed(self.scene, point.changes)
            except DustError as error:
                rows[point.label] = Row(point, 2, _one_line(error))
                continue
            label = self._first_of(point, scene)
            if label in results_by_label:
                rows[point.label] = self._row(point, results_by_label[label], results_by_label)
            elif label not in missing:
                missing[label] = points.Point.of(scene, self.directory, label, snapshots=True)
        if missing:
            raise Missing(list(missing.values()))
        return rows

    def _first_of(self, point, scene):
        """Label of the run of a point: that of the first one with the same scene."""
        label = re.sub(r"[^\w.+,=-]+", "_", point.label)[:LONGEST]
        return label if point.again else self._labels.setdefault(scene.to_yaml(), label)

    def _row(self, point, result, results_by_label):
        """The Row of a Found, with its cost over that of the default."""
        if not result.ok:
            return Row(point, result.code, _one_line(result.text))
        default = results_by_label[DEFAULT.label].cost
        ratio = result.cost / default if default else None
        return Row(point, 0, cost=result.cost, ratio=ratio, **result.measured)

    def _say(self, text):
        """Log a line once, as the trade is computed several times."""
        if text not in self._said:
            self._said.add(text)
            self.log(text)


def trade(scene, run, plan, *, log=lambda text: None):
    """The Trade of a base scene (`trade_points.base`), as Wanted.

    run: list of Points -> label -> Row. The default runs twice, which gives the noise of a cost.
    Raises DustError where the scene or its reference fails, or has no such observable.
    """
    front, behind, left_out = plan.plan(scene)
    default = run([DEFAULT])[DEFAULT.label]
    _needed(default, "the unchanged scene")
    refuse_unknown(plan.observable, default.measured.names)  # before the other runs
    results = run([*behind, *front])
    reference, check = results["reference"], results[behind[0].label]
    _needed(reference, "the reference")
    seed_rows = [results[point.label] for point in behind[1:]]
    measured = [default.measured, *(row.measured for row in seed_rows if row.ok)]
    judge = Judge.of(
        reference.measured,
        check.measured if check.ok else None,
        default.measured,
        measured,
        tolerance=plan.tolerance,
        name=plan.observable,
    )
    rows = [default, *(results[point.label] for point in front)]
    # a second run of the default has its noise
    noise = max(abs((run([AGAIN])[AGAIN.label].ratio or 1.0) - 1.0), LEAST_NOISE)
    rows += _combined(rows, judge, noise, run, log)
    return Trade(
        scene,
        judge,
        tuple(rows),
        tuple(measured),
        check,
        cheapest(rows, judge, (NUMERICAL,), noise),
        cheapest(rows, judge, KINDS, noise),
        left_out,
        noise,
    )


def _combined(rows, judge, noise, run, log):
    """Rows of all combinations that were run; the default is the first of `rows`."""
    singles, start = [r for r in rows if r.point.parameter in wanted_points.NAMES], None
    largest_error = None if judge.accepts(rows[0]) else judge.error(rows[0]) + judge.tolerance
    combinations = []
    for kinds in ((NUMERICAL,), KINDS[1:]):
        candidates = [r for r in singles if r.point.kind in kinds]
        if largest_error is not None and start is None:
            # begin at a more expensive row; combine it with those cheaper than the default
            start = cheapest(candidates, judge, kinds, noise)
            if start is None:
                continue
        other_candidates = [
            r for r in candidates if start is None or r.point.parameter != start.point.parameter
        ]
        ranked_rows = offers(other_candidates, judge, noise, largest_error)
        if ranked_rows:
            log(f"combining {', '.join(o[0].point.parameter for o in ranked_rows)}")
        new_combinations, start = walk(start, ranked_rows, lambda p: run([p])[p.label], judge)
        combinations += new_combinations
    return combinations


def _needed(row, description):
    if not row.ok:
        raise DustError(f"{description} does not run, and nothing can be compared: {row.status}")
    if row.ratio is None:
        raise DustError(f"{description} computes no steps ({row.status}): no cost to compare")


def _one_line(text):
    return " ".join(str(text).split())
