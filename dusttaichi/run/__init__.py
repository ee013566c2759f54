"""One run of a scene, whatever its method: from the YAML to result.nc, and on from a checkpoint.

The way through: opening.py (new, kept, resumed) makes a Run; loop.py advances it; activities.py
are what it does on the way; persistence.py is what is on disk; error_bar.py runs segments again.
"""

from pathlib import Path

from dusttaichi import files
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.run.error_bar import States, estimate
from dusttaichi.run.interrupts import Interrupts, before_the_first_step
from dusttaichi.run.opening import Opening
from dusttaichi.run.state import Report

__all__ = ["Report", "execute", "run_directory"]


def run_directory(scene, output=None):
    """Where the results of a scene go."""
    return Path(output) if output is not None else Path(scene.output.directory)


def execute(
    scene,
    directory,
    *,
    force=False,
    resume=False,
    fresh=False,
    error_bar=False,
    report=lambda report: None,
    log=lambda text: None,
    ready=lambda simulation: None,
    advancing=None,
):
    """Run a scene into `directory`; returns the directory.

    fresh: compute every stage, even those that an earlier run has finished and kept. error_bar:
    estimate the error of the time step at the end (error_bar.py). report: called with a Report now
    and then; log: with sentences for the user. ready: called with the Simulation
    (dusttaichi.method), everything compiled, before its first step.
    advancing: a context manager that is entered around every segment of steps, to time them.
    Raises DustError (bad input, an existing result, a full disk), GuardStop (with the result up to
    there kept), Interrupted (after flushing and a checkpoint).
    """
    directory = Path(directory)
    if error_bar and getattr(scene, "restiffens", False):
        raise DustError(
            "--error-bar: stages whose stiffness_scaling differs have steps of different length; "
            "allowed: one stiffness_scaling for all stages"
        )
    with Interrupts() as interrupts, files.RunLock(directory) as lock:
        others = {"interrupts": interrupts, "report": report, "log": log, "advancing": advancing}
        opening = Opening(scene, directory, lock, keep_states=error_bar, **others)
        with before_the_first_step():
            run = opening.open(force=force, resume=resume, fresh=fresh)
            ready(run.sim)
        interrupts.collect()
        try:
            run.go()
        except GuardStop:
            States(directory).discard()
            raise
        if error_bar:
            estimate(run, opening.states)
    return directory
