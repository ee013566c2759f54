"""Runs of a trade in parallel, beside runs of the base scene; finished points are stored."""

import json
import re
import shutil
import tempfile
import threading
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path

import numpy as np

from dusttaichi import files
from dusttaichi.analysis.observables import Measured
from dusttaichi.errors import DustError
from dusttaichi.run import stages
from dusttaichi.run.identity import package_hash
from dusttaichi.run.interrupts import noted_signals
from dusttaichi.studies.ensemble.runs import core_of
from dusttaichi.studies.trade.point import PointResult
from dusttaichi.studies.trade.scenes import changed
from dusttaichi.studies.trade.task import LEAST
from dusttaichi.studies.workers import INTERRUPTED, LOST, POLL, Worker, wait_all

POINTS, FILE = "points", "point.json"
TASK = "dusttaichi.studies.trade.task:run"


class Runner:
    """Runs points of a base scene, each in a process of its own with one thread.

    A paired point and a run of the base scene begin at the same time, so that other load of the
    machine slows down both. The cost of this run up to the end of the point, over the cost of the
    base's own run up to the same step, is the slowdown; the ratio of the point is its cost over
    that of the base, divided by the slowdown. With one job the two run one after the other; with
    pairs=False there is no second run, and the ratio is that of the two costs.

    directory: of the trade, where each finished point is stored, and not run again unless the scene
    or the code has changed. jobs: simultaneous processes. report(label, share): called from any
    thread with the share of a running point that is done, None at its end.
    """

    def __init__(self, scene, directory, jobs=1, pairs=True, report=lambda label, share: None):
        self.scene, self.directory = scene, Path(directory)
        self.jobs, self.pairs, self.report = jobs, pairs, report
        self.known, self.default = {}, None
        self.stopped = threading.Event()

    def run(self, points, done=lambda point, result: None):
        """label -> PointResult of all points; the first call must be that of the base scene alone.

        done: called after each. Raises KeyboardInterrupt; points finished before are stored.
        """
        results, left = {}, []
        for point in points:
            try:
                scene = changed(self.scene, point.changes)
            except DustError as error:
                results[point.label] = PointResult(2, _one_line(error))
                done(point, results[point.label])
                continue
            left.append((point, scene))
        for paired in (False, True):
            some = [(p, s) for p, s in left if (p.paired and self.pairs) == paired]
            side = 2 if paired and self.jobs > 1 else 1
            self._several(some, max(1, self.jobs // side), results, done)
        return results

    def _several(self, some, workers, results, done):
        """Run (point, scene)s; equal scenes once."""
        waiting, alike = {}, []
        with noted_signals() as signals, ThreadPoolExecutor(workers) as pool:
            for point, scene in some:
                key = self._key(point, scene)
                if key in self.known or key in waiting.values():
                    alike.append((point, key))
                    continue
                waiting[pool.submit(self._one, point, scene)] = key
                results[point.label] = None
            of = {key: point for point, key in ((p, self._key(p, s)) for p, s in reversed(some))}
            left = dict(waiting)
            try:
                while left:
                    ended, _ = wait(left, timeout=POLL, return_when=FIRST_COMPLETED)
                    for future in ended:
                        key = left.pop(future)
                        if future.result() is not None:
                            self.known[key] = results[of[key].label] = future.result()
                            done(of[key], future.result())
                    if signals:
                        self.stopped.set()
            except BaseException:
                self.stopped.set()
                raise
        if signals:
            raise KeyboardInterrupt
        for point, key in alike:
            results[point.label] = self.known[key]
            done(point, self.known[key])

    def _key(self, point, scene):
        """Identity of a point."""
        core = core_of(scene.to_yaml())
        core.pop("name", None)
        paired = point.paired and self.pairs
        code = [package_hash(), *scene.imported_texts]
        return json.dumps(
            [core, paired, code, *["again"] * point.again], sort_keys=True, default=str
        )

    def folder(self, point):
        """Folder of the run and the result of a point."""
        return self.directory / POINTS / re.sub(r"[^\w.+,=-]+", "_", point.label)[:120]

    # -- one point -------------------------------------------------------------------------------

    def _one(self, point, scene):
        """The PointResult of a point, stored or from a run; None where it was stopped."""
        if self.stopped.is_set():
            return None
        folder, key = self.folder(point), self._key(point, scene)
        stored = _stored(folder / FILE, key)
        if stored is not None:
            return self._compared(stored)
        shutil.rmtree(folder, ignore_errors=True)
        try:
            folder.mkdir(parents=True)
            self.report(point.label, 0.0)
            result = self._measure(point, scene, folder)
            if result is not None and result.code != LOST:
                text = json.dumps({"key": key, "result": result.to_json()})
                files.write_whole(folder / FILE, text.encode())
        except OSError as error:
            reason = files.explain(error, folder / FILE)
            raise DustError(f"Cannot write {folder}: {reason}.") from error
        finally:
            self.report(point.label, None)
            shutil.rmtree(folder / stages.FOLDER, ignore_errors=True)
        return result and self._compared(result)

    def _compared(self, result):
        """The result with a ratio of costs; the first result is that of the base."""
        if self.default is None:
            self.default = result
        if result.ratio is None and result.cost is not None and self.default.cost:
            result = replace(result, ratio=result.cost / self.default.cost)
        return result

    def _measure(self, point, scene, folder):
        """The PointResult of a run, with its ratio where the point is paired; None if stopped."""
        with tempfile.TemporaryDirectory(dir=folder, prefix=".beside-") as scratch:
            beside = Path(scratch) / "run"
            with _started(scene, folder / "run") as run:
                if not (point.paired and self.pairs):
                    return self._finished(point, run)
                if self.jobs > 1:
                    with _started(self.scene, beside, measure=False) as base:
                        return self._side_by_side(point, run, base)
                result = self._finished(point, run)
            if result is None or not result.ok:
                return result
            with _started(self.scene, beside, measure=False) as base:
                answer = self._answer(base, most=result.cost if self._long else np.inf)
                return answer and replace(result, ratio=self._ratio(result, answer))

    @property
    def _long(self):
        """True where the run of the base may be stopped early: a very short one runs to its end."""
        return self.default is not None and self.default.cost > LEAST

    def _side_by_side(self, point, run, base):
        if not wait_all((run, base), "ready", self.stopped.is_set):
            return None
        base.go()
        result = self._finished(point, run)
        if result is None or not result.ok:
            return result
        if self._long:  # the rest would not be compared
            base.stop()
        answer = self._answer(base)
        return answer and replace(result, ratio=self._ratio(result, answer))

    def _answer(self, worker, report=lambda share: None, most=np.inf):
        """The Answer of a worker, started if necessary; None where all are stopped.

        report: called with the share that is done. most [s]: core-seconds after which the worker is
        stopped.
        """
        if not wait_all((worker,), "ready", self.stopped.is_set):
            return None
        worker.go()
        while not worker.answered():
            if self.stopped.is_set():
                return None
            if worker.reports.get("cost", 0.0) > most:
                worker.stop()
            report(worker.reports.get("share", 0.0))
        return worker.answer()

    def _finished(self, point, worker):
        """The PointResult of a worker's run; None where all are stopped."""
        answer = self._answer(worker, lambda share: self.report(point.label, share))
        if answer is None or answer.code == INTERRUPTED:
            return None
        found = answer.found
        return PointResult(
            code=answer.code,
            status=found.get("status") or _one_line(answer.text),
            cost=found.get("cost") if answer.code == 0 else None,
            steps=found.get("steps"),
            time_step=found.get("time_step"),
            ledger=found.get("ledger"),
            measured=Measured.from_json(found.get("measured", {"values": {}, "curve": None})),
            costs=tuple(map(tuple, found.get("costs", ((), ())))),
        )

    def _ratio(self, result, answer):
        """Cost of a point over that of the base, corrected for the slowdown; None where unknown.

        answer: of the run of the base beside it.
        """
        cost = answer.found.get("cost")
        if not cost:
            return None
        if self.default is None or answer.code == 0:  # the base is whole, or this is it
            return result.cost / cost
        by_then = np.interp(answer.found["costs"][0][-1], *self.default.costs)
        slower = cost / by_then if by_then > 0.0 else 1.0
        return result.cost / (slower * self.default.cost)


def _started(scene, directory, measure=True):
    """A Worker that has received the run of a scene."""
    worker = Worker(TASK)
    worker.send(scene=scene.to_yaml(), directory=str(directory), measure=measure)
    return worker


def _one_line(text):
    return " ".join(str(text).split())


def _stored(path, key):
    """The PointResult in a file, None without a valid file of this key."""
    try:
        data = json.loads(path.read_text())
        return PointResult.from_json(data["result"]) if data["key"] == key else None
    except (OSError, ValueError, KeyError, TypeError):
        return None
