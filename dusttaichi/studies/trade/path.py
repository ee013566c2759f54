"""The best combined path: the single changes that pay, one upon another."""

import math
from dataclasses import dataclass

from dusttaichi.studies.trade.point import KINDS, Point, PointResult

ATTEMPTS = 2  # rungs of a knob that are tried in a combination
LEAST_ERROR = 1e-6  # that a gain is set against


@dataclass(frozen=True)
class Row:
    """A Point with its PointResult."""

    point: Point
    result: PointResult


def pays(row, judge, noise):
    """True for a row that is cheaper than the default beyond the noise, at an accepted error."""
    ratio = row.result.ratio
    return ratio is not None and ratio < 1.0 - noise and judge.accepts(row)


def saves(row, judge, noise, most):
    """True for a row that is cheaper than the default and errs by no more than `most`."""
    ratio = row.result.ratio
    return ratio is not None and ratio < 1.0 - noise and judge.error(row.result) <= most


def offers(rows, judge, noise, most=None):
    """Rows that pay, knob by knob, cheapest first in each: lists, in the order of what the
    cheapest rung saves for its error.

    most: where the default errs by too much, the error up to which a row is offered all the same,
    to be tried upon another that is accepted.
    """
    knobs = {}
    for row in rows:
        if pays(row, judge, noise) if most is None else saves(row, judge, noise, most):
            knobs.setdefault(row.point.knob, []).append(row)

    def worth(found):
        best = found[0].result
        return (1.0 - best.ratio) / max(judge.error(best), LEAST_ERROR)

    found = [sorted(some, key=lambda row: row.result.ratio) for some in knobs.values()]
    return sorted(found, key=worth, reverse=True)


def combined(one, other):
    """The Point with the changes of both."""
    kinds = max(one.kind, other.kind, key=KINDS.index)
    label = f"{one.label} + {other.label}"
    return Point(label, "combined", label, math.nan, kinds, one.changes | other.changes)


def walk(start, knobs, run, judge):
    """Rows of the way from a Row `start` over the offers of `knobs`: every combination that was
    run, and the last that was kept.

    start: None for the default. run: Point -> PointResult.
    A rung is kept where the combination is accepted and cheaper than without it; else the next
    cheapest of its knob is tried.
    """
    here, tried = start, []
    for rungs in knobs:
        for rung in rungs[:ATTEMPTS]:
            if here is None:  # the single change has been run
                here = rung
                break
            point = combined(here.point, rung.point)
            row = Row(point, run(point))
            tried.append(row)
            better = row.result.ratio is not None and row.result.ratio < here.result.ratio
            if better and judge.accepts(row):
                here = row
                break
    return tried, here


def cheapest(rows, judge, kinds, noise):
    """The cheapest accepted Row of these kinds, or None.

    The default where it is accepted and none is cheaper by more than the noise of a cost.
    """
    able = [
        row
        for row in rows
        if row.point.kind in kinds and row.result.ratio is not None and judge.accepts(row)
    ]
    default = [row for row in able if row.point.knob == "default"]
    if default:
        able = [row for row in able if row.result.ratio < 1.0 - noise] or default
    return min(able, key=lambda row: row.result.ratio, default=None)
