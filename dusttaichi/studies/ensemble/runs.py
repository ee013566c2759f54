"""All runs of a plan: what is there already, what is left to do, how each of them ended."""

import os
import signal
import threading
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import netCDF4
import yaml

from dusttaichi import files
from dusttaichi.errors import DustError
from dusttaichi.files import CHECKPOINT, RESULT
from dusttaichi.run import checkpoint
from dusttaichi.studies.ensemble.jobs import INTERRUPTED, POLL, Job, Outcome
from dusttaichi.studies.ensemble.pool import open_pool, usable_cores
from dusttaichi.studies.ensemble.scenes import input_files

# what does not make a finished run another one
BESIDES = (("output", "directory"), ("output", "checkpoint"), ("numerics", "threads"))


@dataclass
class Progress:
    """What the watcher of an ensemble is told: runs in all and at their end, shares of others."""

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
    watch=lambda progress: None,
    say=lambda text: None,
):
    """Do all runs of a Plan; returns an Outcome for each member.

    One that fails does not end the others. scheduler: address of a Dask cluster, whose workers
    need not see this disk. error_bar: each run estimates the error of its time step; those that are
    finished are left as they are. Raises DustError (results there already, no scheduler),
    KeyboardInterrupt (after every run has written its checkpoint).
    """
    with files.RunLock(plan.directory):
        if not force and not resume:
            _refuse_existing(plan)
        modes = {n: _mode(member, force, resume) for n, member in enumerate(plan.members)}
        left = {n: mode for n, mode in modes.items() if mode is not None}
        outcomes = [Outcome(n, 0, "") for n in range(len(modes))]
        if len(left) < len(modes):
            say(f"{len(modes) - len(left)} of {len(modes)} runs are finished already")
        if left:
            for outcome in _do(plan, left, error_bar, scheduler, watch, say):
                outcomes[outcome.number] = outcome
    return outcomes


# -- what is there -------------------------------------------------------------------------------


def _refuse_existing(plan):
    for path in [plan.file, *(member.directory / RESULT for member in plan.members)]:
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
        with netCDF4.Dataset(member.directory / RESULT) as file:
            status, scene = file.getncattr("status"), file.getncattr("scene_resolved")
    except (OSError, RuntimeError, AttributeError):
        return False
    return status.startswith("finished") and core_of(scene) == core_of(member.scene.to_yaml())


def core_of(text):
    scene = yaml.safe_load(text)
    for block, key in BESIDES:
        scene.get(block, {}).pop(key, None)
    return scene


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


def _do(plan, left, error_bar, scheduler, watch, say):
    """Outcomes of the runs that are left, in any order."""
    members = plan.members
    progress = Progress(len(members), len(members) - len(left))
    lock = threading.Lock()

    def heard(number, share):
        with lock:
            progress.running[members[number].label] = share
            watch(progress)

    workers, threads = shares(plan.scene, len(left), usable_cores())
    if scheduler is not None and plan.scene.numerics.threads == "auto":
        threads = 1  # a task takes one thread of a worker, whose cores are not known here
    watch(progress)
    outcomes = []
    with noted_signals() as signals, open_pool(scheduler, workers, heard) as pool:
        futures = _submit(pool, members, left, threads, scheduler is not None, error_bar)
        stopping = False
        while futures:
            done, _ = wait(futures, timeout=POLL, return_when=FIRST_COMPLETED)
            for future in done:
                outcomes.append(_outcome(future, futures.pop(future)))
                member = members[outcomes[-1].number]
                _keep(outcomes[-1], member.directory)
                with lock:
                    progress.done += outcomes[-1].code != INTERRUPTED
                    progress.running.pop(member.label, None)
                    watch(progress)
            if signals and not stopping:
                stopping = True
                pool.stop()
                say("stopping: the runs write their checkpoints")
    if stopping:
        raise KeyboardInterrupt
    return outcomes


def _submit(pool, members, left, threads, remote, error_bar):
    """Future -> number of the run."""
    futures, sent = {}, {}
    for number, mode in left.items():
        member = members[number]
        paths = tuple(input_files(member.scene)) if remote else ()
        if paths not in sent:
            sent[paths] = pool.share({path: _bytes(path) for path in paths})
        job = _job(number, member, mode, threads, remote, error_bar)
        futures[pool.submit(job, sent[paths])] = number
    return futures


def _job(number, member, mode, threads, remote, error_bar):
    scene = member.scene.with_value("numerics.threads", threads).to_yaml()
    if not remote:
        return Job(number, scene, mode, os.path.abspath(member.directory), error_bar=error_bar)
    if mode == "resume":
        files = {name: _bytes(member.directory / name) for name in (RESULT, CHECKPOINT)}
        return Job(number, scene, mode, None, files, error_bar)
    checkpoint.discard(member.directory / CHECKPOINT)
    return Job(number, scene, mode, None, error_bar=error_bar)


def _bytes(path):
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise DustError(f"{path} cannot be read: {error.strerror or error}.") from error


def _outcome(future, number):
    """Of a future that is done; a worker that was lost is a failure like others."""
    error = future.exception() if not future.cancelled() else "the cluster gave the task up"
    return future.result() if error is None else Outcome(number, 1, str(error) or repr(error))


def _keep(outcome, directory):
    """Write what came back from a temporary directory."""
    try:
        for name, content in outcome.files.items():
            directory.mkdir(parents=True, exist_ok=True)
            temporary = directory / f".{name}.tmp"
            temporary.write_bytes(content)
            files.replace_atomically(temporary, directory / name)
    except OSError as error:
        raise DustError(
            f"Cannot write {directory}: {files.explain(error, directory / RESULT)}."
        ) from error


@contextmanager
def noted_signals():
    """Ctrl-C, SIGTERM and a closed terminal only fill the list that this yields.

    A second one breaks off; the runs then end by themselves, with their checkpoints.
    """
    seen = []

    def note(number, _):
        seen.append(number)
        if len(seen) > 1:
            raise KeyboardInterrupt

    old = {}
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                old[number] = signal.signal(number, note)
    try:
        yield seen
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)
