"""Runs of a plan: those still to do, their results, and the dataset of all."""

import os
import shutil
import threading
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr
import yaml

from dusttaichi import analysis, files
from dusttaichi.analysis.ensemble import gather
from dusttaichi.errors import DustError
from dusttaichi.files import CHECKPOINT, RESULT, run_files
from dusttaichi.processes import usable_cores
from dusttaichi.results.pieces import already_there
from dusttaichi.results.reading import open_tree
from dusttaichi.run import checkpoint
from dusttaichi.run.identity import without
from dusttaichi.run.interrupts import noted_signals
from dusttaichi.studies.ensemble.jobs import Job, JobResult
from dusttaichi.studies.ensemble.pool import open_pool
from dusttaichi.studies.ensemble.scenes import input_files
from dusttaichi.studies.workers import INTERRUPTED, POLL

# keys whose change does not invalidate a finished run
BESIDES = (("output", "directory"), ("output", "checkpoint"), ("numerics", "threads"))


@dataclass
class PlanProgress:
    """Progress of a plan: number of runs, of finished ones, and shares of the running ones.

    report: called with this object after each change, which may come from any thread.
    """

    total: int
    done: int
    report: Callable[["PlanProgress"], None]
    running: dict[str, float] = field(default_factory=dict)  # label -> share

    def __post_init__(self):
        self._lock, self._ended = threading.Lock(), set()
        self.report(self)

    def heard(self, label, share):
        """Set the share of a running job."""
        with self._lock:
            if label not in self._ended:  # a report of a cluster may come after the end of the run
                self.running[label] = share
                self.report(self)

    def ended(self, label, count):
        """Add the finished runs of a job that has ended."""
        with self._lock:
            self._ended.add(label)
            self.done += count
            self.running.pop(label, None)
            self.report(self)


def run_all(
    plan,
    *,
    force=False,
    resume=False,
    error_bar=False,
    scheduler=None,
    part=(1, 1),
    report=lambda progress: None,
    log=lambda text: None,
):
    """Run all members of a Plan; returns their JobResults, also of those that fail.

    part: (k, n), only every n-th run, from the k-th on, counted from 1, so that several jobs can
    share a sweep. scheduler: address of a Dask cluster, whose workers need no access to this disk.
    error_bar: each run that is not finished estimates the error of its time step. Raises DustError
    (existing results, no scheduler), KeyboardInterrupt (after all checkpoints are written).
    """
    chosen, whole = range(part[0] - 1, len(plan.members), part[1]), part == (1, 1)
    # with parts, each run has its own lock
    with files.RunLock(plan.directory) if whole else nullcontext():
        if not force and not resume:
            own = [plan.members[n].directory / RESULT for n in chosen]
            for path in [plan.file] * whole + own:
                if path.exists():
                    raise already_there(path, "with the missing runs")
        modes = {n: _mode(plan.members[n], force, resume) for n in chosen}
        left = {n: mode for n, mode in modes.items() if mode is not None}
        results = {n: JobResult(n, 0, "") for n in chosen}
        if len(left) < len(modes):
            log(f"{len(modes) - len(left)} of {len(modes)} runs are already finished")
        if left:
            how = {"error_bar": error_bar, "scheduler": scheduler, "report": report, "log": log}
            done = _do(plan, left, len(modes), **how)
            results |= {result.number: result for result in done}
    return list(results.values())


# -- what is there -------------------------------------------------------------------------------


def _mode(member, force, resume):
    """Mode of a run: "new", "force", "resume", or None where it is finished."""
    if force or not resume:
        return "force" if force else "new"
    if _finished(member):
        return None
    # without a checkpoint a run cannot continue, whatever other files there are
    return "resume" if (member.directory / CHECKPOINT).exists() else "force"


def _finished(member):
    """True for a finished result of the scene of the member."""
    try:
        with open_tree(member.directory / RESULT) as result:
            status, scene = result.attrs["status"], result.attrs["scene_resolved"]
            extensions = str(result.attrs.get("extensions", ""))
    except (DustError, OSError, RuntimeError, ValueError, KeyError):
        return False  # without a result, or with a damaged one
    if extensions != "\n".join(member.scene.imported_texts):
        return False
    return status.startswith("finished") and core_of(scene) == core_of(member.scene.to_yaml())


def core_of(text):
    """Scene of a YAML text as plain data, without the keys that do not change the result."""
    return without(yaml.safe_load(text), BESIDES)


# -- running ------------------------------------------------------------------------------------


def shares(scene, runs, cores):
    """(simultaneous runs, threads of each or "auto") for a number of runs and of cores.

    A GPU takes one run at a time.
    """
    threads = scene.numerics.threads
    if runs == 1 or scene.numerics.backend != "cpu":
        return 1, threads
    if threads == "auto":
        threads = max(1, cores // runs)
    return min(runs, max(1, cores // threads)), threads


def _do(plan, left, total, *, error_bar, scheduler, report, log):
    """JobResults of the runs in `left` (number -> mode), in any order."""
    members = plan.members
    workers, threads = shares(plan.scene, len(left), usable_cores())
    if scheduler is not None and plan.scene.numerics.threads == "auto":
        threads = 1  # a task takes one thread of a worker, whose cores are not known here
    progress, results = PlanProgress(total, total - len(left), report), []

    def heard(number, share):
        progress.heard(members[number].label, share)

    def take(result):
        results.append(result)
        member = members[result.number]
        _store(result, member.directory)
        progress.ended(member.label, int(result.code != INTERRUPTED))

    with noted_signals() as signals, open_pool(scheduler, workers, heard) as pool:
        remote = scheduler is not None
        jobs = [
            _job(n, members[n], mode, threads=threads, remote=remote, error_bar=error_bar)
            for n, mode in left.items()
        ]
        futures = _submit(pool, jobs, members, remote)
        drain(
            pool, futures, take, signals, lambda: log("stopping: the runs write their checkpoints")
        )
    return results


def drain(pool, futures, take, signals, warn):
    """Call take(JobResult) at the end of each job; after a signal warn(), and stop the pool.

    futures: Future -> number of the job, emptied. signals: of `noted_signals`. Raises
    KeyboardInterrupt at the end where it was stopped.
    """
    stopping = False
    while futures:
        done, _ = wait(futures, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in done:
            take(_result_of(future, futures.pop(future)))
        if signals and not stopping:
            stopping = True
            warn()
            pool.stop()
    if stopping:
        raise KeyboardInterrupt


def _submit(pool, jobs, members, remote):
    """Future -> number of the run. Input files of several jobs are shared once."""
    futures, shared = {}, {}
    for job in jobs:
        paths = tuple(input_files(members[job.number].scene)) if remote else ()
        if paths not in shared:
            shared[paths] = pool.share({path: content_of(path) for path in paths})
        futures[pool.submit(job, shared[paths])] = job.number
    return futures


def _job(number, member, mode, *, threads, remote, error_bar):
    """The Job of a member. remote: with the files that it needs."""
    scene = member.scene.with_value("numerics.threads", threads).to_yaml()
    if not remote:
        return Job(number, scene, mode, os.path.abspath(member.directory), error_bar=error_bar)
    if mode == "resume":
        files = {name: content_of(member.directory / name) for name in run_files(member.directory)}
        return Job(number, scene, mode, None, files, error_bar)
    checkpoint.discard(member.directory / CHECKPOINT)
    return Job(number, scene, mode, None, error_bar=error_bar)


def content_of(path):
    """Bytes of an input file of jobs. Raises DustError."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise DustError(f"{path} cannot be read: {error.strerror or error}.") from error


def _result_of(future, number):
    """JobResult of a finished Future, also of one whose worker was lost."""
    if future.cancelled():
        lost = "the cluster has cancelled it, its scheduler may have ended: continue with --resume"
        return JobResult(number, 1, lost)
    error = future.exception()
    return future.result() if error is None else JobResult(number, 1, str(error) or repr(error))


def _store(result, directory):
    """Write the files that came back from a temporary directory."""
    try:
        if RESULT in result.files:  # parts belong to the previous result
            shutil.rmtree(files.parts_folder(directory / RESULT), ignore_errors=True)
        for name, content in result.files.items():
            (directory / name).parent.mkdir(parents=True, exist_ok=True)
            files.write_whole(directory / name, content)
    except OSError as error:
        raise DustError(
            f"Cannot write {directory}: {files.explain(error, directory / RESULT)}."
        ) from error


# -- the dataset ----------------------------------------------------------------------------------


def gather_plan(plan, results):
    """The dataset of `analysis.gather` for a Plan and the JobResults of its runs.

    Numbers of failed runs are nan. Raises DustError where all failed.
    """
    runs = [
        _read(member.directory) if result.code == 0 else None
        for member, result in zip(plan.members, results, strict=True)
    ]
    labels = {
        name: [member.seeds[name] for member in plan.members] for name in plan.members[0].seeds
    }
    labels["status"] = [
        result.text if run is None else run.status
        for run, result in zip(runs, results, strict=True)
    ]
    labels["directory"] = [member.label for member in plan.members]
    axes = {axis.dimension: _variable(axis) for axis in plan.axes}
    scene = plan.scene
    # as lists: a plain text is limited to 64 kB
    texts = {"scene_given": [scene.source], "scene_resolved": [scene.to_yaml()]}
    data = gather(runs, axes, labels, {"title": scene.name} | texts)
    for name in plan.members[0].seeds:
        data[name].attrs["long_name"] = f"sample.{name.replace('_', '.')} of the run"
    data["directory"].attrs["long_name"] = "directory of the run, relative to this file"
    data["status"].attrs["long_name"] = "status of the run"
    return data


def _read(directory):
    with analysis.open_run(directory) as run:
        return run  # its series stays in memory


def _variable(axis):
    attrs = {"long_name": f"{axis.key} of the scene", "key": axis.key}
    if axis.coordinate.dtype.kind in "fi":
        attrs["units"] = axis.unit or "1"
    return xr.Variable((axis.dimension,), axis.coordinate, attrs)
