"""The trade of a scene: default, reference, seeds, levels of parameters, presets, combinations."""

import math
import re
from dataclasses import dataclass

import yaml

from dusttaichi.analysis.observables import Measured
from dusttaichi.errors import DustError
from dusttaichi.studies.trade import parameters, scenes
from dusttaichi.studies.trade.judge import Judge, Row, cheapest, offers, refuse_unknown, walk
from dusttaichi.studies.trade.point import KINDS, NUMERICAL, Point

LEAST_NOISE = 0.02  # of a cost
QUICK_SEEDS, SEEDS = 2, 4
AGAIN = Point("default again", "default", "", math.nan, NUMERICAL, again=True)
DEFAULT = Point("default", "default", "", math.nan, NUMERICAL)


@dataclass(frozen=True)
class Trade:
    """Result of a trade.

    rows: default first, then presets (that of the reference last), single changes, combinations.
    seeds: Measured of the default with each seed, its own first. numerical, anything: cheapest
    accepted Row of numerical parameters, and of all, or None. left_out: parameter -> reason. noise:
    of a cost. check: Row that gives the error of the reference, such as that at half its step.
    """

    scene: object
    judge: Judge
    rows: tuple[Row, ...]
    seeds: tuple[Measured, ...]
    check: Row
    numerical: Row | None
    anything: Row | None
    left_out: dict[str, str]
    noise: float


@dataclass(frozen=True)
class Wanted:
    """Plan of a trade.

    names: of the parameters. quick: three levels of each. seeds: how many in all. tolerance:
    largest accepted error, a share. observable: name of the number whose error decides, or None for
    the first.
    """

    names: tuple[str, ...] = parameters.NAMES
    quick: bool = False
    seeds: int = SEEDS
    tolerance: float = 0.05
    observable: str | None = None

    @classmethod
    def of(cls, names, quick, *, seeds, tolerance, name):
        """The plan from texts of the command line; None: the default. Raises DustError."""
        if seeds is None:
            seeds = QUICK_SEEDS if quick else SEEDS
        return cls(parameters.chosen(names), quick, seeds, share_of(tolerance), name)

    def plan(self, scene):
        """(points beside the default, check of the reference and seeds, left out) of a scene."""
        own = parameters.parameters_of(scene)
        singles, left_out = parameters.ladder(scene, self.names, self.quick)
        behind = [own.check(scene), *parameters.seeds(scene, self.seeds)]
        return [*own.presets(scene), *singles], behind, left_out


def share_of(text):
    """A share from "5%", "5 %" or "0.05". Raises DustError."""
    match = re.fullmatch(r"\s*([\d.eE+-]+)\s*(%?)\s*", text)
    try:
        value = float(match[1]) / (100.0 if match[2] else 1.0)
    except (TypeError, ValueError):
        value = 0.0
    if not 0.0 < value <= 1.0:
        raise DustError(f"--tolerance {text}: must be a share above 0 and up to 1, such as 5%")
    return value


def trade(scene, run, wanted, *, log=lambda text: None):
    """The Trade of a base scene (`scenes.base`), as Wanted.

    run: list of Points -> label -> PointResult. The default runs twice, which gives the noise of a
    cost. Raises DustError where the scene or its reference fails, or has no such observable.
    """
    front, behind, left_out = wanted.plan(scene)
    default = run([DEFAULT])[DEFAULT.label]
    _needed(default, "the unchanged scene")
    refuse_unknown(wanted.observable, default.measured.names)  # before the other runs
    results = run([*behind, *front])
    reference, check = results["reference"], results[behind[0].label]
    _needed(reference, "the reference")
    others = [results[point.label] for point in behind[1:]]
    measured = [default.measured, *(o.measured for o in others if o.ok)]
    judge = Judge.of(
        reference.measured,
        check.measured if check.ok else None,
        default.measured,
        measured,
        tolerance=wanted.tolerance,
        name=wanted.observable,
    )
    if not math.isfinite(judge.error(default)):
        raise DustError(
            f"{judge.name} of the default and of its reference cannot be compared; choose another "
            f"--observable ({', '.join(reference.measured.names)})"
        )
    rows = [Row(DEFAULT, default), *(Row(p, results[p.label]) for p in front)]
    noise = _noise(run([AGAIN])[AGAIN.label])
    rows += _combined(rows, judge, noise, run, log)
    return Trade(
        scene,
        judge,
        tuple(rows),
        tuple(measured),
        Row(behind[0], check),
        cheapest(rows, judge, (NUMERICAL,), noise),
        cheapest(rows, judge, KINDS, noise),
        left_out,
        noise,
    )


def _combined(rows, judge, noise, run, log):
    """Rows of all combinations that were run; the default is the first of `rows`."""
    singles, start = [row for row in rows if row.point.parameter in parameters.NAMES], None
    most = None if judge.accepts(rows[0]) else judge.error(rows[0].result) + judge.tolerance
    tried = []
    for kinds in ((NUMERICAL,), KINDS[1:]):
        some = [r for r in singles if r.point.kind in kinds]
        if most is not None and start is None:
            # begin at a more expensive row; combine it with those cheaper than the default
            start = cheapest(some, judge, kinds, noise)
            if start is None:
                continue
        others = [r for r in some if start is None or r.point.parameter != start.point.parameter]
        found = offers(others, judge, noise, most)
        if found:
            log(f"combining {', '.join(o[0].point.parameter for o in found)}")
        more, start = walk(start, found, lambda p: run([p])[p.label], judge)
        tried += more
    return tried


def _noise(repeated):
    """Noise of a cost, from a second run of the default."""
    return max(abs((repeated.ratio or 1.0) - 1.0), LEAST_NOISE)


def _needed(result, what):
    if not result.ok:
        raise DustError(f"{what} does not run, and nothing can be compared: {result.status}")
    if result.ratio is None:
        raise DustError(f"{what} computes no steps ({result.status}): no cost to compare")


def yaml_of(trade, row, given):
    """YAML text to paste for a Row: all blocks of the scene with a change, in full.

    given: plain data of the scene of the user, whose threads stay.
    """
    found = scenes.changed(trade.scene, row.point.changes).given
    if "threads" not in (given.get("numerics") or {}):
        found["numerics"].pop("threads", None)
    blocks = dict.fromkeys(path.split(".")[0] for path in row.point.changes)
    text = yaml.safe_dump(
        {block: found[block] for block in blocks},
        sort_keys=False,
        default_flow_style=None,
        allow_unicode=True,
        width=90,
    )
    return text.rstrip()
