"""One run of a scene of any method: from the YAML to result.nc, and from a checkpoint.

opening.py creates a Run (new or resumed); loop.py advances it; activities.py are
its scheduled actions; persistence.py are its files.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dusttaichi.results.run_lock import RunLock
from dusttaichi.running.interrupts import Interrupts, before_the_first_step
from dusttaichi.running.opening import Opening
from dusttaichi.running.state import Report
from dusttaichi.scene.paths import user_path

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from dusttaichi.scene.scene import Scene


__all__ = ["Report", "execute", "run_directory", "study_directory"]


def run_directory(scene: Scene, output: str | Path | None = None) -> Path:
    """Output directory of the results of a scene.

    Parameters
    ----------
    scene : Scene
    output : path, optional
        Directory to use instead of the scene's.
    """
    return Path(output) if output is not None else Path(scene.output.directory)


def study_directory(scene: Scene, word: str, output: str | Path | None = None) -> Path:
    """Directory of a study of a scene: beside that of its run, with a word.

    Parameters
    ----------
    scene : Scene
    word : str
    output : path, optional
        Directory to use instead.
    """
    if output is not None:
        return Path(output)
    runs = Path(scene.output.directory)
    return runs.with_name(f"{runs.name}-{word}")


def execute(
    scene: Scene,
    directory: str | Path,
    *,
    force: bool = False,
    resume: bool = False,
    report: Callable[[Report], None] = lambda report: None,
    log: Callable[[str], object] = lambda text: None,
    sampled: Callable[[Any], object] = lambda sample: None,
    ready: Callable[[Any], object] = lambda simulation: None,
    advancing: AbstractContextManager[Any] | None = None,
) -> Path:
    """Run a scene into a directory.

    Parameters
    ----------
    scene : Scene
    directory : path
    force : bool
        Overwrite an existing result.
    resume : bool
        Continue an existing result.
    report : function
        Called regularly with a Report.
    log : function
        Called with messages for the user.
    sampled : function
        Called with the sample of a new run, before the Engine is built.
    ready : function
        Called with the compiled Engine (dusttaichi.method) before its first step.
    advancing : context manager, optional
        Entered around every segment of steps, to time them.

    Returns
    -------
    pathlib.Path
        The directory.

    Raises
    ------
    DustError
        Bad input, an existing result, or a full disk.
    GuardStop
        The run is not valid; the result until then is on disk.
    Interrupted
        After a flush and a checkpoint.
    """
    directory = user_path(directory)
    with Interrupts() as interrupts, RunLock(directory) as lock:
        callbacks = {"interrupts": interrupts, "report": report, "log": log, "advancing": advancing}
        opening = Opening(scene, directory, lock, sampled=sampled, **callbacks)
        with before_the_first_step():
            run = opening.open(force=force, resume=resume)
            ready(run.sim)
        interrupts.collect()
        with run.files:
            run.go()
    return directory
