"""All collisions of a study: what is there already, what is left to do."""

import json
import math
import os
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from typing import ClassVar

from dusttaichi import files
from dusttaichi.errors import DustError
from dusttaichi.processes import usable_cores
from dusttaichi.run.interrupts import noted_signals
from dusttaichi.studies.ensemble.pool import open_pool
from dusttaichi.studies.ensemble.runs import PlanProgress, content_of, drain, shares
from dusttaichi.studies.workers import INTERRUPTED

TOGETHER = 16  # collisions of a job at most: what is lost with a machine, and what shares a start
ROUNDS = 2  # jobs of each worker at least, of which the last ones even out


@dataclass(frozen=True)
class Batch:
    """Some collisions, as they are handed to a thread or to a worker of a Dask cluster.

    See studies.ensemble.jobs.Job. They are made in a temporary directory: rows come back.
    """

    number: int
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
            raise DustError(
                f"{path} exists already. Use --force to overwrite it, --resume to continue with "
                "the missing ones, or choose another output directory."
            )
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
    progress = PlanProgress(len(study.collisions), len(known))
    lock, ended = threading.Lock(), set()

    def heard(number, share):
        with lock:
            if number not in ended:
                progress.running[f"batch {number + 1}"] = share
                report(progress)

    def take(result):
        rows = result.found.get("rows", [])
        _append(study.rows_file, rows)
        with lock:
            known.update({row["key"]: row for row in rows})
            ended.add(result.number)
            progress.done += len(rows)
            progress.running.pop(f"batch {result.number + 1}", None)
            report(progress)
        if result.code not in (0, INTERRUPTED):
            log(f"a batch of {len(batches[result.number].collisions)} was lost: {result.text}")

    def interrupted():
        if signals:
            log("stopping: finished collisions are stored")
        return bool(signals)

    report(progress)
    with noted_signals() as signals, open_pool(scheduler, workers, heard) as pool:
        shared = pool.share({path: content_of(path) for path in study.inputs})
        futures = {pool.submit(batch, shared): batch.number for batch in batches}
        if drain(pool, futures, take, interrupted):
            raise KeyboardInterrupt


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
        found.append(Batch(len(found), text, own, study.phases))
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
