"""Runs of a trade in parallel; finished points are stored."""

import json
import re
import shutil
import threading
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path

from dusttaichi import files
from dusttaichi.analysis.observables import Measured
from dusttaichi.errors import DustError
from dusttaichi.run import stages
from dusttaichi.run.identity import package_hash
from dusttaichi.run.interrupts import noted_signals
from dusttaichi.studies.engine import core_of
from dusttaichi.studies.trade.point import PointResult
from dusttaichi.studies.trade.scenes import changed
from dusttaichi.studies.workers import INTERRUPTED, LOST, POLL, Worker

POINTS, FILE = "points", "point.json"
TASK = "dusttaichi.studies.trade.task:run"


class Runner:
    """Runs points of a base scene, each in a process of its own with one thread.

    The ratio of a point is its cost, in core-seconds of its steps, over that of the base.

    directory: of the trade, where each finished point is stored, and not run again unless the scene
    or the code has changed. jobs: simultaneous processes. report(label, share): called from any
    thread with the share of a running point that is done, None at its end.
    """

    def __init__(self, scene, directory, jobs=1, report=lambda label, share: None):
        self.scene, self.directory = scene, Path(directory)
        self.jobs, self.report = jobs, report
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
        self._several(left, self.jobs, results, done)
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
        code = [package_hash(), *scene.imported_texts]
        return json.dumps([core, code, *["again"] * point.again], sort_keys=True, default=str)

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
        """The PointResult of a run; None where all are stopped."""
        with Worker(TASK) as worker:
            worker.send(scene=scene.to_yaml(), directory=str(folder / "run"))
            while not worker.answered():
                if self.stopped.is_set():
                    return None
                self.report(point.label, worker.reports.get("share", 0.0))
            answer = worker.answer()
        if answer.code == INTERRUPTED:
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
        )


def _one_line(text):
    return " ".join(str(text).split())


def _stored(path, key):
    """The PointResult in a file, None without a valid file of this key."""
    try:
        data = json.loads(path.read_text())
        return PointResult.from_json(data["result"]) if data["key"] == key else None
    except (OSError, ValueError, KeyError, TypeError):
        return None
