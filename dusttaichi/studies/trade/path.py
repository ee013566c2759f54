"""Combination of the single changes that lower the cost within the accepted error."""

import math
from dataclasses import dataclass

from dusttaichi.studies.trade.point import KINDS, Point, PointResult

ATTEMPTS = 2  # levels of a parameter that are tried in a combination
LEAST_ERROR = 1e-6  # denominator of a gain over its error


@dataclass(frozen=True)
class Row:
    """A Point with its PointResult."""

    point: Point
    result: PointResult


def saves(row, noise):
    """True for a row that is cheaper than the default beyond the noise."""
    return row.result.ratio is not None and row.result.ratio < 1.0 - noise


def offers(rows, judge, noise, most=None):
    """Rows that are cheaper at an accepted error: a list for each parameter, cheapest first.

    The lists are sorted by the saving of their cheapest level over its error. most: where the error
    of the default is too large, the largest error of a row for combination with an accepted one.
    """
    parameters = {}
    for row in rows:
        able = judge.accepts(row) if most is None else judge.error(row.result) <= most
        if able and saves(row, noise):
            parameters.setdefault(row.point.parameter, []).append(row)

    def worth(found):
        best = found[0].result
        return (1.0 - best.ratio) / max(judge.error(best), LEAST_ERROR)

    found = [sorted(some, key=lambda row: row.result.ratio) for some in parameters.values()]
    return sorted(found, key=worth, reverse=True)


def combined(one, other):
    """The Point with the changes of both."""
    kinds = max(one.kind, other.kind, key=KINDS.index)
    label = f"{one.label} + {other.label}"
    return Point(label, "combined", label, math.nan, kinds, one.changes | other.changes)


def walk(start, parameters, run, judge):
    """(every combination that was run, last accepted Row) from `start` over the offers.

    start: a Row, None for the default. parameters: lists of `offers`. run: Point -> PointResult.
    A combination with a level is accepted where it is cheaper than without the level, at an
    accepted error; else the next cheapest level of the parameter is tried.
    """
    here, tried = start, []
    for levels in parameters:
        for level in levels[:ATTEMPTS]:
            if here is None:  # the single change has been run
                here = level
                break
            point = combined(here.point, level.point)
            row = Row(point, run(point))
            tried.append(row)
            better = row.result.ratio is not None and row.result.ratio < here.result.ratio
            if better and judge.accepts(row):
                here = row
                break
    return tried, here


def cheapest(rows, judge, kinds, noise):
    """The cheapest accepted Row of these kinds, or None.

    It is the default where that is accepted and none is cheaper by more than the noise of a cost.
    """
    able = [r for r in rows if r.point.kind in kinds and r.result.ratio is not None]
    able = [row for row in able if judge.accepts(row)]
    default = [row for row in able if row.point.parameter == "default"]
    if default:
        able = [row for row in able if saves(row, noise)] or default
    return min(able, key=lambda row: row.result.ratio, default=None)
