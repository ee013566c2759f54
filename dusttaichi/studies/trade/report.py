"""Report of a trade: its dataset, and the rows and sentences of the command."""

import math

from dusttaichi.analysis.observables import about
from dusttaichi.analysis.trade import NUMBERS, trade_dataset
from dusttaichi.results import provenance
from dusttaichi.studies.trade.trade import yaml_of

NAMES = {"cost_ratio": "ratio", "ledger_worst": "ledger"}  # variable -> name in a PointResult


def dataset(trade, given_scene, source, numbers):
    """The xr.Dataset of a Trade. source: text of the YAML file; numbers: further attributes."""
    rows, judge = trade.rows, trade.judge
    results = [row.result for row in rows]
    columns = {
        name: [getattr(row.point, name) for row in rows] for name in ("parameter", "label", "kind")
    }
    columns["status"] = [o.status for o in results]
    found = [judge.errors(o) for o in results]
    column = {
        name: [getattr(o, NAMES.get(name, name), None) for o in results]
        for name in NUMBERS
        if name not in ("value", "error")
    }
    column["value"] = [row.point.value for row in rows]
    column["error"] = [f[judge.name][1] for f in found]
    names = list(found[0])
    seeds = {
        n: [s.values.get(n, math.nan) for s in trade.seeds]
        for n in names
        if any(n in s.values for s in trade.seeds)
    }
    about = {
        "reference": [judge.reference.values.get(n, math.nan) for n in names],
        "scatter": [judge.scatter[n] for n in names],
        "convergence": [judge.convergence[n] for n in names],
    }
    flags = {
        "free": [judge.free(o) for o in results],
        "accepted": [judge.accepts(row) for row in rows],
    }
    attrs = provenance(
        source,
        trade.scene.to_yaml(),
        title=trade.scene.name,
        observable=judge.name,
        tolerance=judge.tolerance,
        cost_noise=trade.noise,
        cheapest_numerical=_label(trade.numerical),
        cheapest=_label(trade.anything),
        cheapest_numerical_yaml=paste(trade, trade.numerical, given_scene) or None,
        cheapest_yaml=paste(trade, trade.anything, given_scene) or None,
        check=trade.check.point.text,
        left_out="; ".join(f"{k}: {v}" for k, v in trade.left_out.items()) or None,
        **numbers,
    )
    attrs = {k: [v] if k.startswith("scene_") else v for k, v in attrs.items() if v is not None}
    values, errors = ({n: [f[n][side] for f in found] for n in names} for side in (0, 1))
    return trade_dataset(
        columns=columns,
        numbers=column,
        flags=flags,
        values=values,
        errors=errors,
        observables=about,
        seeds=seeds,
        attrs=attrs,
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
