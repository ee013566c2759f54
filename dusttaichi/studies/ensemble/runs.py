"""All runs of a plan: what is there already, what is left to do, how each of them ended."""

import os
import shutil
import threading
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from dusttaichi import files
from dusttaichi.errors import DustError
from dusttaichi.files import CHECKPOINT, RESULT, run_files
from dusttaichi.processes import usable_cores
from dusttaichi.results.reading import open_tree
from dusttaichi.run import checkpoint
from dusttaichi.run.same_scene import without
from dusttaichi.studies.ensemble.jobs import Job, JobResult
from dusttaichi.studies.ensemble.pool import open_pool
from dusttaichi.studies.ensemble.scenes import input_files
from dusttaichi.studies.interrupts import noted_signals
from dusttaichi.studies.workers import INTERRUPTED, POLL

# what does not make a finished run another one
BESIDES = (("output", "directory"), ("output", "checkpoint"), ("numerics", "threads"))


@dataclass
class PlanProgress:
    """How far all runs of a plan have come: their number, those at their end, shares of others."""

    total: int
    done: int = 0
    running: dict[str, float] = field(default_factory=dict)  # label -> share


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
    """Do all runs of a Plan; returns a JobResult for each member.

    part: (k, n), every n-th run only, from the k-th on, counted from 1: the parts of a sweep may go
    on at the same time, each in a job of its own; the results are then those of these runs. One
    that fails does not end the others. scheduler: address of a Dask cluster, whose workers need not
    see this disk. error_bar: each run estimates the error of its time step; those that are finished
    are left as they are. Raises DustError (results there already, no scheduler), KeyboardInterrupt
    (after every run has written its checkpoint).
    """
    chosen, whole = range(part[0] - 1, len(plan.members), part[1]), part == (1, 1)
    # of the parts each run has its own lock
    with files.RunLock(plan.directory) if whole else nullcontext():
        if not force and not resume:
            own = [plan.members[n].directory / RESULT for n in chosen]
            _refuse_existing([plan.file] * whole + own)
        modes = {n: _mode(plan.members[n], force, resume) for n in chosen}
        left = {n: mode for n, mode in modes.items() if mode is not None}
        results = {n: JobResult(n, 0, "") for n in chosen}
        if len(left) < len(modes):
            log(f"{len(modes) - len(left)} of {len(modes)} runs are finished already")
        if left:
            how = {"error_bar": error_bar, "scheduler": scheduler, "report": report, "log": log}
            done = _do(plan, left, len(modes), **how)
            results |= {result.number: result for result in done}
    return list(results.values())


# -- what is there -------------------------------------------------------------------------------


def _refuse_existing(paths):
    for path in paths:
        if path.exists():
            raise DustError(
                f"{path} exists already. Use --force to overwrite it, --resume to go on with "
                "what is missing, or choose another output directory."
            )


def _mode(member, force, resume):
    """How a run is to be done: "new", "force", "resume", or None where it is finished."""
    if force or not resume:
        return "force" if force else "new"
    if _finished(member):
        return None
    # without a checkpoint there is nothing to go on from, whatever else lies there
    return "resume" if (member.directory / CHECKPOINT).exists() else "force"


def _finished(member):
    """The result is there, at its end, and of this scene."""
    try:
        with open_tree(member.directory / RESULT) as result:
            status, scene = result.attrs["status"], result.attrs["scene_resolved"]
            extensions = str(result.attrs.get("extensions", ""))
    except (DustError, OSError, RuntimeError, ValueError, KeyError):
        return False  # none, or a damaged one, which is computed again
    if extensions != "\n".join(member.scene.imported_texts):
        return False
    return status.startswith("finished") and core_of(scene) == core_of(member.scene.to_yaml())


def core_of(text):
    """The scene of a YAML text as plain data, without the keys that do not change the result."""
    return without(yaml.safe_load(text), BESIDES)


# -- doing it ------------------------------------------------------------------------------------


def shares(scene, runs, cores):
    """(runs at a time, threads of each or "auto") for so many runs on so many cores.

    A GPU takes one run at a time.
    """
    threads = scene.numerics.threads
    if runs == 1 or scene.numerics.backend != "cpu":
        return 1, threads
    if threads == "auto":
        threads = max(1, cores // runs)
    return min(runs, max(1, cores // threads)), threads


def _do(plan, left, total, *, error_bar, scheduler, report, log):
    """JobResults of the runs that are left of so many, in any order."""
    members = plan.members
    progress = PlanProgress(total, total - len(left))
    lock, ended = threading.Lock(), set()

    def heard(number, share):
        with lock:
            if number not in ended:  # a cluster may tell of a run after its end
                progress.running[members[number].label] = share
                report(progress)

    workers, threads = shares(plan.scene, len(left), usable_cores())
    if scheduler is not None and plan.scene.numerics.threads == "auto":
        threads = 1  # a task takes one thread of a worker, whose cores are not known here
    report(progress)
    results = []

    def interrupted():
        if signals:
            log("stopping: the runs write their checkpoints")
        return bool(signals)

    with noted_signals() as signals, open_pool(scheduler, workers, heard) as pool:
        remote = scheduler is not None
        jobs = [
            _job(n, members[n], mode, threads=threads, remote=remote, error_bar=error_bar)
            for n, mode in left.items()
        ]
        futures = _submit(pool, jobs, members, remote)

        def take(result):
            results.append(result)
            member = members[result.number]
            _keep(result, member.directory)
            with lock:
                ended.add(result.number)
                progress.done += result.code != INTERRUPTED
                progress.running.pop(member.label, None)
                report(progress)

        stopping = drain(pool, futures, take, interrupted)
    if stopping:
        raise KeyboardInterrupt
    return results


def drain(pool, futures, take, interrupted):
    """Call take(JobResult) as the jobs end; once interrupted(), the pool lets all others end early.

    futures: Future -> number of the job, emptied. Returns whether it was interrupted.
    """
    stopping = False
    while futures:
        done, _ = wait(futures, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in done:
            take(_result_of(future, futures.pop(future)))
        if not stopping and interrupted():
            stopping = True
            pool.stop()
    return stopping


def _submit(pool, jobs, members, remote):
    """Future -> number of the run. Files that several jobs read are shared once."""
    futures, shared = {}, {}
    for job in jobs:
        paths = tuple(input_files(members[job.number].scene)) if remote else ()
        if paths not in shared:
            shared[paths] = pool.share({path: content_of(path) for path in paths})
        futures[pool.submit(job, shared[paths])] = job.number
    return futures


def _job(number, member, mode, *, threads, remote, error_bar):
    """The Job of a member. remote: its files travel with it."""
    scene = member.scene.with_value("numerics.threads", threads).to_yaml()
    if not remote:
        return Job(number, scene, mode, os.path.abspath(member.directory), error_bar=error_bar)
    if mode == "resume":
        files = {name: content_of(member.directory / name) for name in run_files(member.directory)}
        return Job(number, scene, mode, None, files, error_bar)
    checkpoint.discard(member.directory / CHECKPOINT)
    return Job(number, scene, mode, None, error_bar=error_bar)


def content_of(path):
    """Bytes of a file that jobs read. Raises DustError."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise DustError(f"{path} cannot be read: {error.strerror or error}.") from error


def _result_of(future, number):
    """Of a future that is done; a worker that was lost is a failure like others."""
    if future.cancelled():
        lost = "the cluster has given it up, its scheduler may be gone: go on with --resume"
        return JobResult(number, 1, lost)
    error = future.exception()
    return future.result() if error is None else JobResult(number, 1, str(error) or repr(error))


def _keep(result, directory):
    """Write what came back from a temporary directory."""
    try:
        if RESULT in result.files:  # parts of the result that was there before fit no other
            shutil.rmtree(files.parts_folder(directory / RESULT), ignore_errors=True)
        for name, content in result.files.items():
            (directory / name).parent.mkdir(parents=True, exist_ok=True)
            files.write_whole(directory / name, content)
    except OSError as error:
        raise DustError(
            f"Cannot write {directory}: {files.explain(error, directory / RESULT)}."
        ) from error
