"""The whole trade of a scene: default, reference, seeds, ladders, presets, combined path."""

import math
from dataclasses import dataclass

import yaml

from dusttaichi.analysis.observables import Measured
from dusttaichi.errors import DustError
from dusttaichi.studies.trade import knobs, scenes
from dusttaichi.studies.trade.judge import Judge
from dusttaichi.studies.trade.path import Row, cheapest, offers, walk
from dusttaichi.studies.trade.point import KINDS, NUMERICAL, Point

LEAST_NOISE = 0.02  # of a cost, that is always reckoned with
AGAIN = Point("default again", "default", "", math.nan, NUMERICAL, paired=False, again=True)
DEFAULT = Point("default", "default", "", math.nan, NUMERICAL)


@dataclass(frozen=True)
class Trade:
    """Everything measured.

    rows: default first, then presets (that of the reference last), ladders, combinations. seeds:
    Measured of the default with each seed, its own first. numerical, anything: the cheapest
    accepted Row of numerical knobs, and of all; None where none is. left_out: knob -> why. noise:
    of a cost. check: the reference at half its step, or what else tells its own error.
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


def plan(scene, names=knobs.NAMES, quick=False, seeds=4):
    """(points beside the default, check of the reference and seeds, left out) of a base scene."""
    singles, left_out = knobs.ladder(scene, names, quick)
    behind = [knobs.knobs_of(scene).check(scene), *knobs.seeds(scene, seeds)]
    return [*knobs.knobs_of(scene).presets(scene), *singles], behind, left_out


def trade(
    scene,
    run,
    *,
    names=knobs.NAMES,
    quick=False,
    seeds=4,
    tolerance=0.05,
    observable=None,
    paired=True,
    log=lambda text: None,
):
    """The Trade of a base scene (`scenes.base`).

    run: list of Points -> label -> PointResult. seeds: how many in all. paired: points run beside
    the default, which so tells the noise of a cost; else it runs again for that. Raises DustError
    where the scene or its reference does not run, or has no such observable.
    """
    front, behind, left_out = plan(scene, names, quick, seeds)
    default = run([DEFAULT])[DEFAULT.label]
    _needed(default, "the scene as it is")
    _known(observable, default.measured)
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
        tolerance=tolerance,
        name=observable,
    )
    if not math.isfinite(judge.error(default)):
        raise DustError(
            f"the default and its reference have no {judge.name} that can be compared; choose "
            f"another --observable ({', '.join(reference.measured.names)})"
        )
    rows = [Row(DEFAULT, default), *(Row(p, results[p.label]) for p in front)]
    noise = _noise(default if paired else run([AGAIN])[AGAIN.label])
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
    singles, start = [row for row in rows if row.point.knob in knobs.NAMES], None
    most = None if judge.accepts(rows[0]) else judge.error(rows[0].result) + judge.tolerance
    tried = []
    for kinds in ((NUMERICAL,), KINDS[1:]):
        some = [r for r in singles if r.point.kind in kinds]
        if most is not None and start is None:
            # the way begins at a dearer row, and what is cheaper than the default is tried upon it
            start = cheapest(some, judge, kinds, noise)
            if start is None:
                continue
        found = offers([r for r in some if r.point.knob != _knob(start)], judge, noise, most)
        if found:
            log(f"combining {', '.join(o[0].point.knob for o in found)}")
        more, start = walk(start, found, lambda p: run([p])[p.label], judge)
        tried += more
    return tried


def _knob(row):
    return None if row is None else row.point.knob


def _noise(repeated):
    """The noise of a cost from a run of the default that was compared with itself."""
    return max(abs((repeated.ratio or 1.0) - 1.0), LEAST_NOISE)


def _needed(result, what):
    if not result.ok:
        raise DustError(f"{what} does not run, so there is nothing to compare: {result.status}")
    if result.ratio is None:
        raise DustError(f"{what} makes no steps ({result.status}): there is no cost to compare")


def _known(name, measured):
    """Refuse an observable that there is not before all the rest is run."""
    if name is not None and name not in measured.names:
        raise DustError(
            f"--observable {name}: the scene gives no such number; allowed: "
            f"{', '.join(measured.names)}"
        )


def yaml_of(trade, row, given):
    """YAML text to paste for a Row: the blocks of the scene that it changes, whole.

    given: plain data of the scene as the user wrote it, whose threads stay.
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
