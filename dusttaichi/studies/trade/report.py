"""Report of a trade: its dataset, and the rows and sentences of the command."""

import math

import numpy as np
import xarray as xr

from dusttaichi.analysis.observables import about
from dusttaichi.results.provenance import of_study
from dusttaichi.studies.trade.trade import yaml_of

# variables of trade.nc by point: name -> (long name, units or None for a text, from row and Judge)
POINTS = {
    "parameter": ("the varied parameter, or default, preset, combined", None,
                  lambda row, judge: row.point.parameter),
    "label": ("the point", None, lambda row, judge: row.point.label),
    "kind": ("numerical, physical or sample: what the parameter changes", None,
             lambda row, judge: row.point.kind),
    "status": ("how the run ended, or why it was refused", None,
               lambda row, judge: row.result.status),
    "value": ("value of the parameter, not a number for a word", "1",
              lambda row, judge: row.point.value),
    "cost": ("core-seconds of the time steps, without start, compilation and writing", "s",
             lambda row, judge: row.result.cost),
    "cost_ratio": ("cost over that of the default", "1",
                   lambda row, judge: row.result.ratio),
    "error": ("relative error of the attribute `observable` against the converged reference", "1",
              lambda row, judge: judge.error(row.result)),
    "ledger_worst": ("worst relative residual of the energy ledger", "1",
                     lambda row, judge: row.result.ledger),
    "steps": ("time steps", "1", lambda row, judge: row.result.steps),
    "time_step": ("time step", "s", lambda row, judge: row.result.time_step),
}  # fmt: skip
FLAGS = {
    "free": ("the error is below the scatter of seeds (without seeds: the reference's own)",
             lambda row, judge: judge.free(row.result)),
    "accepted": ("the error is within the tolerance, or free where the kind is numerical",
                 lambda row, judge: judge.accepts(row)),
}  # fmt: skip


def dataset(trade, given_scene, numbers):
    """The xr.Dataset of a Trade. given_scene: that of the user; numbers: further attributes."""
    rows, judge = trade.rows, trade.judge
    found = [judge.errors(row.result) for row in rows]
    names = list(found[0])
    data = xr.Dataset(attrs=_attributes(trade, given_scene, numbers))
    data = data.assign_coords(observable=names)

    def put(name, over, values, text, units=None, *, dtype=float):
        about = {"long_name": text} if units is None else {"units": units, "long_name": text}
        values = [math.nan if value is None else value for value in values]
        data[name] = (over, np.array(values, dtype=dtype), about)

    for name, (text, units, of) in POINTS.items():
        dtype = str if units is None else float
        put(name, "point", [of(row, judge) for row in rows], text, units, dtype=dtype)
    for name, (text, of) in FLAGS.items():
        put(name, "point", [of(row, judge) for row in rows], text, dtype=np.int8)
    for name in names:
        text, unit = about(name)
        values, errors = zip(*(one[name] for one in found), strict=True)
        put(name, "point", values, text, unit)
        put(f"error_{name}", "point", errors, f"relative error of: {text}", "1")
        seeds = [seed.values.get(name) for seed in trade.seeds]
        if any(value is not None for value in seeds):
            put(f"seed_{name}", "seed", seeds, f"with each seed: {text}", unit)
    for name, text, known in (
        ("reference", "value of the reference, SI", judge.reference.values),
        ("scatter", "standard deviation between seeds, as an error", judge.scatter),
        ("convergence", "difference of the reference from that at `check`, as an error",
         judge.convergence),
    ):  # fmt: skip
        put(name, "observable", [known.get(n) for n in names], text)
    return data


def _attributes(trade, given_scene, numbers):
    """Global attributes of the dataset."""
    return of_study(
        given_scene,
        trade.scene,
        observable=trade.judge.name,
        tolerance=trade.judge.tolerance,
        cost_noise=trade.noise,
        cheapest_numerical=_label(trade.numerical),
        cheapest=_label(trade.anything),
        cheapest_numerical_yaml=paste(trade, trade.numerical, given_scene) or None,
        cheapest_yaml=paste(trade, trade.anything, given_scene) or None,
        check=trade.check.point.text,
        left_out="; ".join(f"{k}: {v}" for k, v in trade.left_out.items()) or None,
        **numbers,
    )


def _label(row):
    return None if row is None else row.point.label


def paste(trade, row, given_scene):
    """YAML text to paste; "" for the default."""
    return "" if row is None or not row.point.changes else yaml_of(trade, row, given_scene.given)


def percent(value):
    """A share as text, such as "2.5 %"; "-" for nan."""
    if not math.isfinite(value):
        return "-"
    if value >= 0.095:
        return f"{100 * value:.0f} %" if value < 100 else f"{100 * value:.0e} %"
    return f"{100 * value:.2g} %"


HEADINGS = tuple(
    {"header": header, "justify": justify, "no_wrap": header != "point"}
    for header, justify in (
        ("point", "left"),
        ("changes", "left"),
        ("cost/default", "right"),
        ("core-s", "right"),
        ("error", "right"),
        ("", "left"),
        ("ledger", "right"),
    )
)


def table(trade):
    """Title, headings and rows of text for all points that ran."""
    judge = trade.judge
    title = f"{trade.scene.name}: cost against error of the {about(judge.name)[0]}"
    rows = []
    for row in trade.rows:
        found = row.result
        if not found.ok:
            continue
        worth = ["free"] * judge.free(found) + ["too large"] * (not judge.accepts(row))
        rows.append(
            (
                row.point.label,
                row.point.kind,
                f"{found.ratio:.2f}",
                f"{found.cost:.3g}",
                percent(judge.error(found)),
                ", ".join(worth),
                f"{found.ledger:.0e}",
            )
        )
    return title, HEADINGS, rows


def refused(trade):
    """Lines on the points that did not run, with the reason."""
    return [f"{row.point.label}: {row.result.status}" for row in trade.rows if not row.result.ok]


def sentences(trade):
    """Lines on the accuracy of the numbers."""
    judge, name = trade.judge, trade.judge.name
    own, spread = judge.convergence[name], judge.scatter[name]
    lines = [f"reference: changes by {percent(own)} at {trade.check.point.text}"]
    if not judge.converged:
        lines[0] += (
            f", more than a third of the tolerance of {percent(judge.tolerance)}: errors of this "
            "size may be its own"
        )
    if math.isfinite(spread):
        lines.append(
            f"scatter between {len(trade.seeds)} seeds: {percent(spread)}; a smaller error is "
            "marked as free"
        )
        if spread > judge.tolerance:
            lines.append(
                "the scatter exceeds the tolerance: the error of a single run is partly random, "
                "even a small one. Use more grains"
            )
    else:
        lines.append(
            "the scatter between seeds is unknown (the sample has no seed, or --seeds is 1); an "
            "error below the change of the reference is marked as free"
        )
    lines.append(f"noise of a cost: {percent(trade.noise)}")
    lines += [f"not varied: {parameter} ({why})" for parameter, why in trade.left_out.items()]
    return lines


def advice(trade, given_scene):
    """(heading, YAML text) of the cheapest settings."""
    found = []
    for what, row in (
        ("numerical parameters only", trade.numerical),
        ("with changes of the physics or of the sample", trade.anything),
    ):
        start = f"cheapest within {percent(trade.judge.tolerance)}, {what}:"
        if row is None:
            found.append((f"{start} none, not even the unchanged scene", ""))
            continue
        known = math.isfinite(trade.judge.scatter[trade.judge.name])
        least = "the scatter" if known else "the change of the reference"
        free = f", within {least}" if trade.judge.free(row.result) else ""
        text = paste(trade, row, given_scene)
        name = row.point.label if text else "the unchanged scene"
        found.append(
            (
                f"{start} {name} (cost {row.result.ratio:.2f} of the default, error "
                f"{percent(trade.judge.error(row.result))}{free})",
                text,
            )
        )
    return found
