"""Report of a trade: its dataset, and the rows and sentences of the command."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, cast

import numpy as np
import xarray as xr
import yaml

from dusttaichi.analysis.observables import describe_observable
from dusttaichi.method.variants import change_scene
from dusttaichi.results.provenance import describe_study
from dusttaichi.scene import Scene
from dusttaichi.studies.trade_judge import Judge, Row, Trade

# variables of trade.nc by point: name -> (long name, type, units or None, from row and Judge)
POINTS: dict[str, tuple[str, type, str | None, Callable[[Row, Judge], Any]]] = {
    "parameter": ("the varied parameter, or default, preset, combined", str, None,
                  lambda row, judge: row.variant.parameter),
    "label": ("the point", str, None, lambda row, judge: row.variant.label),
    "kind": ("numerical, physical or sample: what the parameter changes", str, None,
             lambda row, judge: row.variant.kind),
    "status": ("how the run ended, or why it was refused", str, None,
               lambda row, judge: row.status),
    "value": ("value of the parameter, not a number for a word", float, "1",
              lambda row, judge: row.variant.value),
    "cost": ("core-seconds of the time steps, without start, compilation and writing", float, "s",
             lambda row, judge: row.cost),
    "cost_ratio": ("cost over that of the default", float, "1", lambda row, judge: row.ratio),
    "error": ("relative error of the attribute `observable` against the converged reference",
              float, "1", lambda row, judge: judge.error(row)),
    "ledger_worst": ("worst relative residual of the energy ledger", float, "1",
                     lambda row, judge: row.ledger),
    "steps": ("time steps", float, "1", lambda row, judge: row.steps),
    "time_step": ("time step", float, "s", lambda row, judge: row.time_step),
    "free": ("the error is below the scatter of seeds (without seeds: the reference's own)",
             np.int8, None, lambda row, judge: judge.is_free(row)),
    "accepted": ("the error is within the tolerance, or free where the kind is numerical",
                 np.int8, None, lambda row, judge: judge.accepts(row)),
}  # fmt: skip


def build_dataset(trade: Trade, user_scene: Scene) -> xr.Dataset:
    """The xr.Dataset of a Trade. user_scene: as the user wrote it."""
    rows, judge = trade.rows, trade.judge
    errors_by_row = [judge.errors(row) for row in rows]
    names = list(errors_by_row[0])
    data = xr.Dataset(attrs=_collect_attributes(trade, user_scene))
    data = data.assign_coords(observable=names)

    def put(
        name: str,
        dimension: str,
        values: Iterable[Any],
        text: str,
        units: str | None = None,
        *,
        dtype: type = float,
    ) -> None:
        attributes = {"long_name": text} if units is None else {"units": units, "long_name": text}
        values = [math.nan if value is None else value for value in values]
        data[name] = (dimension, np.array(values, dtype=dtype), attributes)

    for name, (text, dtype, units, read) in POINTS.items():
        put(name, "point", [read(row, judge) for row in rows], text, units, dtype=dtype)
    for name in names:
        text, unit = describe_observable(name)
        values, errors = zip(*(errors[name] for errors in errors_by_row), strict=True)
        put(name, "point", values, text, unit)
        put(f"error_{name}", "point", errors, f"relative error of: {text}", "1")
        seeds = [seed.values.get(name) for seed in trade.seeds]
        if any(value is not None for value in seeds):
            put(f"seed_{name}", "seed", seeds, f"with each seed: {text}", unit)
    for name, text, numbers in (
        ("reference", "value of the reference, SI", judge.reference.values),
        ("scatter", "standard deviation between seeds, as an error", judge.scatter),
        ("convergence", "difference of the reference from that at `check`, as an error",
         judge.convergence),
    ):  # fmt: skip
        put(name, "observable", [numbers.get(n) for n in names], text)
    return data


def _collect_attributes(trade: Trade, user_scene: Scene) -> dict[str, Any]:
    """Global attributes of the dataset."""
    best = {"cheapest_numerical": trade.numerical, "cheapest": trade.anything}
    labels = {name: None if row is None else row.variant.label for name, row in best.items()}
    texts = {f"{k}_yaml": write_yaml(trade, row, user_scene) or None for k, row in best.items()}
    return describe_study(
        user_scene,
        trade.scene,
        observable=trade.judge.name,
        tolerance=trade.judge.tolerance,
        cost_noise=trade.noise,
        check=trade.check.variant.text,
        left_out="; ".join(f"{k}: {v}" for k, v in trade.left_out.items()) or None,
        **labels,
        **texts,
    )


def write_yaml(trade: Trade, row: Row | None, user_scene: Scene) -> str:
    """YAML text to paste for a Row: all blocks of the scene with a change, in full.

    "" for the default and for None. user_scene: its threads stay.
    """
    if row is None or not row.variant.changes:
        return ""
    changed_scene = cast(Scene, change_scene(trade.scene, row.variant.changes))
    changed_blocks = changed_scene.input_data
    if "threads" not in (user_scene.input_data.get("numerics") or {}):
        changed_blocks["numerics"].pop("threads", None)
    blocks = dict.fromkeys(path.split(".")[0] for path in row.variant.changes)
    text = yaml.safe_dump(
        {block: changed_blocks[block] for block in blocks},
        sort_keys=False,
        default_flow_style=None,
        allow_unicode=True,
        width=90,
    )
    return str(text).rstrip()


def format_percent(value: float) -> str:
    """A share as text, such as "2.5 %"; "-" for nan."""
    if not math.isfinite(value):
        return "-"
    if value >= 0.095:
        return f"{100 * value:.0f} %" if value < 100 else f"{100 * value:.0e} %"
    return f"{100 * value:.2g} %"


TEXTS = ("point", "changes", "")  # headings of columns without numbers
HEADINGS = tuple(
    {"header": header, "justify": "left" if header in TEXTS else "right"}
    for header in ("point", "changes", "cost/default", "core-s", "error", "", "ledger")
)


def build_table(trade: Trade) -> tuple[str, list[tuple[str, ...]]]:
    """Title and rows of text, under HEADINGS, for all points that ran."""
    judge = trade.judge
    title = f"{trade.scene.name}: cost against error of the {describe_observable(judge.name)[0]}"
    rows: list[tuple[str, ...]] = []
    for row in (row for row in trade.rows if row.ok):
        worth = ["free"] * judge.is_free(row) + ["too large"] * (not judge.accepts(row))
        cost = f"{row.ratio:.2f}", f"{row.cost:.3g}"
        error = format_percent(judge.error(row)), ", ".join(worth), f"{row.ledger:.0e}"
        rows.append((row.variant.label, row.variant.kind, *cost, *error))
    return title, rows


def list_remarks(trade: Trade) -> list[str]:
    """Lines on the points that did not run, and on the accuracy of the numbers."""
    judge, name = trade.judge, trade.judge.name
    convergence, scatter = judge.convergence[name], judge.scatter[name]
    lines = [f"{row.variant.label}: {row.status}" for row in trade.rows if not row.ok]
    text = f"the reference changes by {format_percent(convergence)} at {trade.check.variant.text}"
    if not judge.converged:
        limit = format_percent(judge.tolerance)
        text += (
            f", more than a third of the tolerance of {limit}: errors of this size may be its own"
        )
    lines.append(text)
    if not math.isfinite(scatter):
        lines.append(
            "the scatter between seeds is unknown (the sample has no seed, or --seeds is 1); an "
            "error below the change of the reference is marked as free"
        )
    else:
        text = f"scatter between {len(trade.seeds)} seeds: {format_percent(scatter)}"
        lines.append(f"{text}; a smaller error is marked as free")
    if scatter > judge.tolerance:
        lines.append(
            "the scatter exceeds the tolerance: the error of a single run is partly random, even a "
            "small one. Use more grains"
        )
    lines.append(f"uncertainty of a cost: {format_percent(trade.noise)}")
    return lines + [f"not varied: {name} ({reason})" for name, reason in trade.left_out.items()]


def list_advice(trade: Trade, user_scene: Scene) -> list[tuple[str, str]]:
    """(heading, YAML text) of the cheapest settings. user_scene: as the user wrote it."""
    headings_and_texts, judge = [], trade.judge
    least = "the change of the reference"
    if math.isfinite(judge.scatter[judge.name]):
        least = "the scatter"
    for scope, row in (
        ("numerical parameters only", trade.numerical),
        ("with changes of the physics or of the sample", trade.anything),
    ):
        start = f"cheapest within {format_percent(judge.tolerance)}, {scope}:"
        if row is None:
            headings_and_texts.append((f"{start} none, not even the unchanged scene", ""))
            continue
        free = f", within {least}" if judge.is_free(row) else ""
        text = write_yaml(trade, row, user_scene)
        name = row.variant.label if text else "the unchanged scene"
        cost = (
            f"cost {row.ratio:.2f} of the default, error {format_percent(judge.error(row))}{free}"
        )
        headings_and_texts.append((f"{start} {name} ({cost})", text))
    return headings_and_texts
