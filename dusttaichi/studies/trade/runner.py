"""The runs of a trade: what is kept of them already, two by two, as many as there are cores."""

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
from dusttaichi.studies.ensemble.jobs import INTERRUPTED
from dusttaichi.studies.ensemble.runs import core_of, noted_signals
from dusttaichi.studies.trade.child import LEAST
from dusttaichi.studies.trade.point import Outcome
from dusttaichi.studies.trade.process import Process
from dusttaichi.studies.trade.scenes import changed

POINTS, FILE = "points", "point.json"
LOST = 1  # the process was, which may not happen again


class Runner:
    """Runs points of a base scene, each in a process of its own with one thread.

    Beside each point whose cost is wanted goes a run of the base scene, which begins at the same
    moment: both meet the same noise of the machine. What it has cost by the end of the point, over
    what the base cost by the same step in its own run, tells how much slower the machine was
    meanwhile; the ratio of the point is its cost over that of the base, less this. With one job the
    one goes after the other; with pairs=False there is none, and the ratio is that of the two own
    costs.

    directory: of the trade; each point is kept below it and not run again, unless the scene or the
    code that computes it has changed. say, watch(label, share): tell of progress, from any thread.
    """

    def __init__(self, scene, directory, jobs=1, pairs=True, watch=lambda label, share: None):
        self.scene, self.directory = scene, Path(directory)
        self.jobs, self.pairs, self.watch = jobs, pairs, watch
        self.known, self.default = {}, None
        self.stopped = threading.Event()

    def run(self, points, done=lambda point, outcome: None):
        """label -> Outcome of all points; the first call must be that of the base scene alone.

        done: called after each. Raises KeyboardInterrupt; what had ended until then is kept.
        """
        outcomes, left = {}, []
        for point in points:
            try:
                scene = changed(self.scene, point.changes)
            except DustError as error:
                outcomes[point.label] = Outcome(2, _one_line(error))
                done(point, outcomes[point.label])
                continue
            left.append((point, scene))
        for paired in (False, True):
            some = [(p, s) for p, s in left if (p.paired and self.pairs) == paired]
            side = 2 if paired and self.jobs > 1 else 1
            self._several(some, max(1, self.jobs // side), outcomes, done)
        return outcomes

    def _several(self, some, workers, outcomes, done):
        """Run (point, scene)s; equal scenes once."""
        waiting, alike = {}, []
        with noted_signals() as signals, ThreadPoolExecutor(workers) as pool:
            for point, scene in some:
                key = self._key(point, scene)
                if key in self.known or key in waiting.values():
                    alike.append((point, key))
                    continue
                waiting[pool.submit(self._one, point, scene)] = key
                outcomes[point.label] = None
            of = {key: point for point, key in ((p, self._key(p, s)) for p, s in reversed(some))}
            left = dict(waiting)
            try:
                while left:
                    ended, _ = wait(left, timeout=0.2, return_when=FIRST_COMPLETED)
                    for future in ended:
                        key = left.pop(future)
                        if future.result() is not None:
                            self.known[key] = outcomes[of[key].label] = future.result()
                            done(of[key], future.result())
                    if signals:
                        self.stopped.set()
            except BaseException:
                self.stopped.set()
                raise
        if signals:
            raise KeyboardInterrupt
        for point, key in alike:
            outcomes[point.label] = self.known[key]
            done(point, self.known[key])

    def _key(self, point, scene):
        """What makes a point another one."""
        core = core_of(scene.to_yaml())
        core.pop("name", None)
        paired = point.paired and self.pairs
        return json.dumps([core, paired, stages.code_hash()], sort_keys=True, default=str)

    def folder(self, point):
        return self.directory / POINTS / re.sub(r"[^\w.+,=-]+", "_", point.label)[:120]

    # -- one point -------------------------------------------------------------------------------

    def _one(self, point, scene):
        """The Outcome of a point, kept or now; None where it was stopped."""
        if self.stopped.is_set():
            return None
        folder, key = self.folder(point), self._key(point, scene)
        kept = _kept(folder / FILE, key)
        if kept is not None:
            return self._compared(kept)
        shutil.rmtree(folder, ignore_errors=True)
        try:
            folder.mkdir(parents=True)
            self.watch(point.label, 0.0)
            outcome = self._measure(point, scene, folder)
            if outcome is not None and outcome.code != LOST:
                _keep(folder / FILE, key, outcome)
        except OSError as error:
            reason = files.explain(error, folder / FILE)
            raise DustError(f"Cannot write {folder}: {reason}.") from error
        finally:
            self.watch(point.label, None)
            shutil.rmtree(folder / stages.FOLDER, ignore_errors=True)
        return outcome and self._compared(outcome)

    def _compared(self, outcome):
        """The outcome with a ratio; the first is that of the base, which all are compared with."""
        if self.default is None:
            self.default = outcome
        if outcome.ratio is None and outcome.cost is not None and self.default.cost:
            outcome = replace(outcome, ratio=outcome.cost / self.default.cost)
        return outcome

    def _measure(self, point, scene, folder):
        with tempfile.TemporaryDirectory(dir=folder, prefix=".beside-") as scratch:
            beside = Path(scratch) / "run"
            with Process(scene, folder / "run") as run:
                if not (point.paired and self.pairs):
                    return self._finished(point, run)
                if self.jobs > 1:
                    with Process(self.scene, beside, measure=False) as other:
                        return self._side_by_side(point, run, other)
                outcome = self._finished(point, run)
            if outcome is None or not outcome.ok:
                return outcome
            with Process(self.scene, beside, measure=False) as other:
                most = outcome.cost if self._long else np.inf
                said = self._finished(point, other, most, raw=True)
            return said and replace(outcome, ratio=self._ratio(outcome, said))

    @property
    def _long(self):
        """True where the base may be stopped on its way: a moment's run must be whole."""
        return self.default is not None and self.default.cost > LEAST

    def _side_by_side(self, point, run, other):
        for process in (run, other):
            while not process.wait("ready"):
                if self.stopped.is_set():
                    return None
        other.begin()
        outcome = self._finished(point, run)
        if outcome is None or not outcome.ok:
            return outcome
        if self._long:  # the rest of it would be beside nothing
            other.stop()
        said = self._finished(point, other, raw=True)
        return said and replace(outcome, ratio=self._ratio(outcome, said))

    def _finished(self, point, process, most=np.inf, raw=False):
        """Outcome of a process, which begins now if it has not; None where all are stopped.

        most [s]: core-seconds after which it is stopped. raw: what it said in place of an Outcome.
        """
        while not process.wait("ready"):
            if self.stopped.is_set():
                return None
        process.begin()
        while not process.wait("code"):
            if self.stopped.is_set():
                return None
            if process.said.get("cost", 0.0) > most:
                process.stop()
            if not raw:
                self.watch(point.label, process.said.get("share", 0.0))
        said = process.end()
        if raw:
            return said
        if said["code"] == INTERRUPTED:
            return None
        return Outcome(
            code=said["code"],
            status=said.get("status") or _one_line(said["text"]),
            cost=said.get("cost") if said["code"] == 0 else None,
            steps=said.get("steps"),
            time_step=said.get("time_step"),
            ledger=said.get("ledger"),
            measured=Measured.from_json(said.get("measured", {"values": {}, "curve": None})),
            costs=tuple(map(tuple, said.get("costs", ((), ())))),
        )

    def _ratio(self, outcome, said):
        """Cost of a point over that of the base at the noise that both met; None where that was
        not heard."""
        if not said.get("cost"):
            return None
        if self.default is None:  # this is the base, beside itself
            return outcome.cost / said["cost"]
        if said["code"] == 0:
            return outcome.cost / said["cost"]
        by_then = np.interp(said["costs"][0][-1], *self.default.costs)
        slower = said["cost"] / by_then if by_then > 0.0 else 1.0
        return outcome.cost / (slower * self.default.cost)


def _one_line(text):
    return " ".join(str(text).split())


def _kept(path, key):
    """The Outcome in a file, if it is there and of this key."""
    try:
        data = json.loads(path.read_text())
        return Outcome.from_json(data["outcome"]) if data["key"] == key else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _keep(path, key, outcome):
    temporary = path.with_suffix(".tmp")
    temporary.write_text(json.dumps({"key": key, "outcome": outcome.to_json()}))
    files.replace_atomically(temporary, path)
