"""All collisions of a study: what is there, what is left to do, further speeds, the files."""

import json
import math
import os
from contextlib import suppress
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dusttaichi import files
from dusttaichi.analysis.collisions import collisions_dataset, table_text
from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.analysis.thresholds import growth_bracket, threshold_text, thresholds
from dusttaichi.errors import DustError
from dusttaichi.processes import usable_cores
from dusttaichi.results import provenance
from dusttaichi.results.pieces import already_there
from dusttaichi.run.interrupts import noted_signals
from dusttaichi.studies.collide.plan import make_study
from dusttaichi.studies.engine import Progress, content_of, drain, shares
from dusttaichi.studies.pool import idle_workers, open_pool
from dusttaichi.studies.workers import INTERRUPTED

TOGETHER = 16  # collisions of a job at most: what is lost with a machine, and what shares a start
ROUNDS = 2  # jobs of each worker at least, of which the last ones even out
NARROW = 1.02  # ratio of two speeds below which an interval is not halved any more


@dataclass(frozen=True)
class Batch:
    """Some collisions, as they are handed to a thread or to a worker of a Dask cluster.

    See studies.jobs.Job. They are made in a temporary directory: rows come back.
    """

    label: str
    scene: str
    collisions: tuple
    phases: bool = False
    directory: None = None
    files: dict = field(default_factory=dict)

    task: ClassVar[str] = "dusttaichi.studies.collide.task:run"

    def request(self, directory):
        """Arguments of the task."""
        return {"scene": self.scene, "collisions": self.collisions, "phases": self.phases}


def collide(
    study,
    *,
    force=False,
    resume=False,
    scheduler=None,
    jobs=None,
    report=lambda progress: None,
    log=lambda text: None,
):
    """Make all collisions of a Study; returns their rows (see `task.make_collision`), in its order.

    Rows go to study.rows_file as they come. resume: those that are there and belong to the study
    are not made again. jobs: collisions at a time on this machine, at most; None: as many as its
    cores allow. A row with `error` is one that could not be made.
    Raises DustError (existing rows, no scheduler), KeyboardInterrupt; finished rows are stored.
    """
    with files.RunLock(study.directory):
        path = study.rows_file
        if path.exists() and not force and not resume:
            raise already_there(path, "with the missing ones")
        known = _known(path) if resume else {}
        left = [c for c in study.collisions if c.key not in known]
        if len(left) < len(study.collisions):
            done = len(study.collisions) - len(left)
            log(f"{done} of {len(study.collisions)} collisions are done already")
        # also those of further speeds (collisions.refine)
        files.write_whole(path, "".join(map(_line, known.values())).encode())
        if left:
            how = {"scheduler": scheduler, "jobs": jobs, "report": report, "log": log}
            _do(study, left, known, **how)
        lost = sum(c.key not in known for c in study.collisions)
        if lost:
            raise DustError(
                f"{lost} collisions were lost with their process; continue with --resume."
            )
    return [known[c.key] for c in study.collisions]


def _known(path):
    """key -> row of the lines that are whole; rows of failed collisions are made again."""
    rows = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            with suppress(ValueError, KeyError, TypeError):  # the last may have been cut off
                row = json.loads(line)
                if "error" not in row:
                    rows[row["key"]] = row
    return rows


def _line(row):
    return json.dumps(row) + "\n"


def _do(study, left, known, *, scheduler, jobs, report, log):
    """Make the collisions that are left; their rows go into `known`."""
    workers = shares(study.scene, len(left), usable_cores())[0]
    workers = min(workers, jobs or workers)
    batches = _batches(study, left, workers)
    sizes = {batch.label: len(batch.collisions) for batch in batches}
    progress = Progress(len(study.collisions), len(known), report)

    def take(result):
        rows = result.found.get("rows", [])
        _append(study.rows_file, rows)
        known.update({row["key"]: row for row in rows})
        progress.ended(result.label, len(rows))
        if result.code not in (0, INTERRUPTED):
            log(f"a batch of {sizes[result.label]} was lost: {result.text}")

    with (
        noted_signals() as signals,
        idle_workers() as idle,
        open_pool(scheduler, workers, progress.heard, idle) as pool,
    ):
        shared = pool.share({path: content_of(path) for path in study.inputs})
        futures = {pool.submit(batch, shared): batch.label for batch in batches}
        drain(pool, futures, take, signals, lambda: log("stopping: finished collisions are stored"))


def _batches(study, left, workers):
    """Collisions by their number of grains, whose kernels are the same; slow ones first.

    Large enough to share a start, and enough of them for a number of workers.
    """
    text = study.scene.to_yaml()
    names = list(study.axes)
    body, ratio, speed = (names.index(name) for name in ("body", "mass_ratio", "speed"))
    order = sorted(left, key=lambda c: (c.index[body], c.index[ratio], c.index[speed]))
    size, found = min(TOGETHER, math.ceil(len(order) / (ROUNDS * workers))), []
    for first in range(0, len(order), size):
        own = tuple((c.key, c.sample) for c in order[first : first + size])
        found.append(Batch(f"batch {len(found) + 1}", text, own, study.phases))
    return found


def _append(path, rows):
    """Add lines to the file, whole on the disk when this returns."""
    try:
        with path.open("a", encoding="utf-8") as file:
            file.write("".join(map(_line, rows)))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise DustError(f"Cannot write {path}: {files.explain(error, path)}.") from error


def collide_and_refine(scene, directory, *, force=False, resume=False, **how):
    """The Study of a scene with its refined speeds, and the rows of all of its collisions.

    A further speed halves the interval in which the growth efficiency falls below 0. how: as
    `collide` takes it, which raises what this raises.
    """
    study, added = make_study(scene, directory), ()
    rows = collide(study, force=force, resume=resume, **how)
    for _ in range(scene.collisions.refine):
        speed = next_speed(collisions_dataset(rows, study.axes))
        if speed is None:
            break
        added = (*added, speed)
        study = make_study(scene, directory, added)
        rows = collide(study, resume=True, **how)
    return study, rows


def next_speed(data):
    """Speed [m/s] that halves the widest interval in which a growth efficiency falls below 0.

    It considers all bodies and mass ratios; None where none is left to halve. Three digits.
    """
    brackets = [
        growth_bracket(data, body, ratio)
        for body, ratio in np.ndindex(data.sizes["body"], data.sizes["mass_ratio"])
    ]
    brackets = [b for b in brackets if b is not None and b[1] > NARROW * b[0]]
    if not brackets:
        return None
    low, high = max(brackets, key=lambda b: b[1] / b[0])
    return float(f"{np.sqrt(low * high):.3g}")


def write(study, rows, *, figures=True):
    """Write collisions.nc, collisions.csv and, where wanted, the figures of a Study.

    Returns the dataset, its thresholds and the paths. Raises DustError where writing fails.
    """
    scene = study.source
    attrs = provenance(scene.source, scene.to_yaml(), title=scene.name, by_area=int(study.by_area))
    data = collisions_dataset(rows, study.axes, {k: v for k, v in attrs.items() if v is not None})
    found = thresholds(data)
    save_ensemble(data, study.file)
    paths = [study.file, study.file.with_suffix(".csv")]
    files.write_whole(paths[1], table_text(data).encode())
    paths.append(study.directory / "thresholds.csv")
    files.write_whole(paths[2], threshold_text(found).encode())
    if figures:
        paths += _draw(data, found, study.directory)
    return data, found, paths


def _draw(data, found, directory):
    from dusttaichi import plots

    drawn = {"outcomes": plots.outcome_map(data)}
    if data.sizes["mass_ratio"] > 1:
        drawn["outcomes_mass_ratio"] = plots.outcome_map(data, "mass_ratio")
    if data.sizes["body"] > 1:
        drawn["thresholds"] = plots.threshold_speeds(data, found)
    drawn |= {"growth": plots.growth(data), "spectrum": plots.fragment_spectrum(data)}
    drawn["phases"] = plots.phases(data)
    there = {name: figure for name, figure in drawn.items() if figure is not None}
    return [plots.save(figure, directory / f"{name}.png") for name, figure in there.items()]
