"""The trade between speed and accuracy of a scene, measured: `dust trade`.

Each variant of the scene is a run of the engine; errors are relative to a converged reference, and
changes that pay are combined.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import xarray as xr

from dusttaichi import analysis
from dusttaichi.analysis import observables
from dusttaichi.errors import DustError
from dusttaichi.method.variants import KINDS, NUMERICAL, Variant, change_scene
from dusttaichi.scene import Scene
from dusttaichi.studies.points import Point
from dusttaichi.studies.study_types import PointResult, StagedStudy
from dusttaichi.studies.trade_judge import (
    Judge,
    Row,
    RunVariants,
    Stages,
    Trade,
    combine_offers,
    find_cheapest,
    rank_offers,
    refuse_unknown,
)
from dusttaichi.studies.trade_plan import NAMES, TradePlan, make_base_scene

LEAST_NOISE = 0.02  # of a cost
LONGEST_NAME = 120  # characters of a directory's name
DEFAULT = Variant("default", "default")
REPEATED_DEFAULT = Variant("default again", "default", repeats=True)


class TradeStudy(StagedStudy):
    """Study of the variants of a scene. trade: the Trade, once all stages are computed."""

    timed = True  # costs are those of this code

    def __init__(
        self,
        scene: Scene,
        directory: Path,
        plan: TradePlan,
        *,
        threads: int | str = 1,
        log: Callable[[str], None] = lambda text: None,
    ) -> None:
        self.user_scene, self.scene, self.plan = scene, make_base_scene(scene, threads), plan
        self.directory, self.log = Path(directory), log
        self.trade: Trade | None = None
        self._points: dict[str, Point] = {}  # text of a scene -> its run

    @property
    def file(self) -> Path:
        """File of the dataset."""
        return self.directory / "trade.nc"

    def stages(self) -> Stages[None]:
        """The stages of `measure_trade`."""
        self.trade = yield from measure_trade(self.scene, self.run, self.plan, log=self.log)

    def run(self, variants: Sequence[Variant]) -> Stages[list[Row]]:
        """Stage that runs variants, and returns their Rows. Equal scenes run once."""
        points: dict[str, Point] = {}
        refusals: dict[str, Row] = {}
        for variant in variants:
            try:
                scene = cast(Scene, change_scene(self.scene, variant.changes))
            except DustError as error:
                refusals[variant.label] = Row(variant, 2, _join_lines(error))
            else:
                points[variant.label] = self._find_point(variant, scene)
        yield list({point.label: point for point in points.values()}.values())
        return [
            refusals.get(variant.label) or self._make_row(variant, points[variant.label])
            for variant in variants
        ]

    def _find_point(self, variant: Variant, scene: Scene) -> Point:
        """Point of the first variant with an equal scene."""
        text = variant.label if variant.repeats else scene.to_yaml()
        if text not in self._points:
            label = re.sub(r"[^\w.+,=-]+", "_", variant.label)[:LONGEST_NAME]
            self._points[text] = Point.from_changes(scene, self.directory, label, snapshots=True)
        return self._points[text]

    def _make_row(self, variant: Variant, point: Point) -> Row:
        """The Row of a variant, with its cost over that of the default."""
        result = self.results[point.label]
        if not result.ok:
            return Row(variant, result.code, _join_lines(result.text))
        # a run without steps has no cost
        cost, default = (r.cost or math.nan for r in (result, self.results[DEFAULT.label]))
        return Row(variant, 0, cost=cost, ratio=cost / default, **result.measured)

    def measure(self, run: analysis.Run) -> dict[str, Any]:
        """The numbers of a Row of a run, without its cost."""
        return {
            "status": run.status,
            "steps": int(run.series.step[-1]),
            "time_step": float(run.attrs["time_step"]),
            "ledger": analysis.compute_ledger(run).worst,
            "measured": observables.measure_observables(run),
        }

    def dataset(self, results: Mapping[str, PointResult]) -> xr.Dataset:
        """The dataset of the trade."""
        from dusttaichi.studies.trade_report import build_dataset

        assert self.trade is not None  # all stages have run
        return build_dataset(self.trade, self.user_scene)


def measure_trade(
    scene: Scene,
    run: RunVariants,
    plan: TradePlan,
    *,
    log: Callable[[str], None] = lambda text: None,
) -> Stages[Trade]:
    """Stages of a trade of a base scene (`make_base_scene`), by a TradePlan; returns the Trade.

    run: generator of a stage (TradeStudy.run) that runs Variants and returns their Rows. The
    default runs twice, which gives the noise of a cost. Raises DustError where the scene or its
    reference fails, or has no such observable.
    """
    variants, check_variant, seeds, left_out = plan.list_variants(scene)
    (default,) = yield from run([DEFAULT])
    _require(default, "the unchanged scene")
    refuse_unknown(plan.observable, default.measured.names)  # before the other runs
    check, *rows = yield from run([check_variant, *seeds, *variants])
    seed_rows, rows = rows[: len(seeds)], [default, *rows[len(seeds) :]]
    reference = next(row for row in rows if row.variant.label == "reference")
    _require(reference, "the reference")
    measured = [default.measured, *(row.measured for row in seed_rows if row.ok)]
    judge = Judge.from_runs(
        reference.measured,
        check.measured if check.ok else None,
        default.measured,
        measured,
        tolerance=plan.tolerance,
        name=plan.observable,
    )
    (repeated,) = yield from run([REPEATED_DEFAULT])
    noise = max(LEAST_NOISE, abs(repeated.ratio - 1.0) if repeated.ok else 0.0)
    rows += yield from _combine(rows, judge, noise, run, log)
    return Trade(
        scene,
        judge,
        tuple(rows),
        tuple(measured),
        check,
        numerical=find_cheapest(rows, judge, (NUMERICAL,), noise),
        anything=find_cheapest(rows, judge, KINDS, noise),
        left_out=left_out,
        noise=noise,
    )


def _combine(
    rows: list[Row], judge: Judge, noise: float, run: RunVariants, log: Callable[[str], None]
) -> Stages[list[Row]]:
    """Stages of the combinations, whose Rows it returns; the default is the first of `rows`."""
    singles, start = [row for row in rows if row.variant.parameter in NAMES], None
    largest_error = None if judge.accepts(rows[0]) else judge.error(rows[0]) + judge.tolerance
    combinations: list[Row] = []
    for kinds in ((NUMERICAL,), KINDS[1:]):
        candidates = [row for row in singles if row.variant.kind in kinds]
        if largest_error is not None and start is None:
            # begin at a more expensive row; combine it with those cheaper than the default
            start = find_cheapest(candidates, judge, kinds, noise)
            if start is None:
                continue
        if start is not None:
            candidates = [r for r in candidates if r.variant.parameter != start.variant.parameter]
        offers = rank_offers(candidates, judge, noise, largest_error)
        if offers:
            names = ", ".join(levels[0].variant.parameter for levels in offers)
            log(f"combining the changes of {names}")
        rows_of_kinds, start = yield from combine_offers(start, offers, run, judge)
        combinations += rows_of_kinds
    return combinations


def _require(row: Row, description: str) -> None:
    if not row.ok:
        raise DustError(f"{description} does not run, and nothing can be compared: {row.status}")
    if math.isnan(row.ratio):
        raise DustError(f"{description} computes no steps ({row.status}): no cost to compare")


def _join_lines(text: object) -> str:
    return " ".join(str(text).split())
