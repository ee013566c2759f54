"""A run from Python, in SI: that of `dust run`, with a bitwise identical result.nc."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from numpy.typing import NDArray

from dusttaichi.errors import DustError, naming_keywords
from dusttaichi.results import Writer, files
from dusttaichi.results.run_lock import RunLock
from dusttaichi.running.activities import OwnRecords
from dusttaichi.running.durations import interval_of, steps_of
from dusttaichi.running.interrupts import Interrupts, before_the_first_step
from dusttaichi.running.opening import Opening
from dusttaichi.running.present import line_of
from dusttaichi.running.progress import show_progress
from dusttaichi.running.script import ScriptControl
from dusttaichi.scene import Scene
from dusttaichi.scene.paths import user_path

if TYPE_CHECKING:
    from typing_extensions import Self


def simulate(
    scene: Scene,
    sample: Any = None,
    directory: str | Path | None = None,
    *,
    force: bool = False,
    resume: bool = False,
    log: Callable[[str], object] = print,
    progress: bool | None = None,
) -> Simulation:
    """Build a scene, and return its simulation at the start, or at the end of an earlier run.

    Parameters
    ----------
    scene : Scene
    sample : Sample, optional
        Used instead of that of the scene; positions in metres.
    directory : path, optional
        Folder of the result. Default: a temporary folder that is removed with the Simulation.
    force : bool
        Overwrite an existing result.
    resume : bool
        Continue an existing result.
    log : function
        Called with messages for the user.
    progress : bool, optional
        Show the progress of `run` in one bar. Default: in a notebook or on a terminal.

    Raises
    ------
    DustError
        Bad input, or an existing result.
    Interrupted
        A signal arrived.
    """
    options: dict[str, Any] = {"force": force, "resume": resume, "log": log, "progress": progress}
    with naming_keywords():
        return Simulation(scene, sample, directory, **options)


class Simulation(ScriptControl):
    """A simulation of a scene, at whole steps. A context manager; see `close`.

    Attributes
    ----------
    scene
        Its Scene.
    directory
        Folder of its result.
    """

    def __init__(
        self,
        scene: Scene,
        sample: Any,
        directory: str | Path | None,
        *,
        force: bool,
        resume: bool,
        log: Callable[[str], object],
        progress: bool | None,
    ) -> None:
        self._temporary = tempfile.TemporaryDirectory() if directory is None else None
        self.scene, self._progress = scene, progress
        self.directory = user_path(self._temporary.name if self._temporary else directory or "")
        lock = RunLock(self.directory)
        self._lock: RunLock | None = lock
        # counts and step of the result before the last frame, at the end
        self._before_end: tuple[dict[str, int], int] | None = None
        self._past_end = False
        try:
            with Interrupts() as interrupts, before_the_first_step():
                opening = Opening(
                    scene,
                    self.directory,
                    lock,
                    report=lambda report: None,
                    interrupts=interrupts,
                    log=log,
                )
                self._run = opening.open(sample, force=force, resume=resume)
        except BaseException:
            lock.release()
            raise

    def __repr__(self) -> str:
        return line_of(self, self._run)

    def every(
        self,
        interval: int | str | dict[str, Any],
        function: Callable[[Simulation], Any],
        name: str | None = None,
        *,
        units: Mapping[str, str] | None = None,
    ) -> Callable[[Simulation], Any]:
        """Call a function at an interval, and record its results in a group of result.nc.

        The first call is immediate, unless the run was resumed and has its records.

        Parameters
        ----------
        interval : int, str or dict
            Number of steps, a time such as "1 us", or a dict as in the YAML, such as {"strain":
            0.01}.
        function : function
            Called with the Simulation. It returns a number, an array, or a dict of these (always
            with the same names and shapes), which are written with their times and steps; None is
            not written.
        name : str, optional
            Name of the group. Default: that of the function.
        units : dict
            Name -> unit.

        Returns
        -------
        function
            The function.

        Raises
        ------
        DustError
            The interval or name is not valid.
        """
        group = name or str(getattr(function, "__name__", "records"))
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", group) or group == "series":
            raise DustError(f"{group!r} cannot name a group; give a name of letters and digits")
        # NetCDF has one name for a group and a variable beside it
        used_names = {v.group for v in self._run.sim.variables}
        used_names |= {v.name for v in self._run.sim.variables if v.group == "series"}
        used_names |= {
            records.group for records in self._run.activities if isinstance(records, OwnRecords)
        }
        if group in used_names:
            raise DustError(f"the result has {group} already; give another name")
        when = interval_of(interval)
        records = OwnRecords(self._run, when, group, lambda: function(self), units=units)
        records.function.__name__ = group
        self._run.activities.append(records)
        if group not in self._run.writer.groups:
            records.act()
        return function

    def advance(self, duration: int | str) -> Self:
        """Advance by a number of steps or a time; also beyond the end of the scene.

        Records are written as specified by the scene.

        Parameters
        ----------
        duration : int or str
            Number of steps, or a time such as "1 us", rounded to at least one step; not negative.

        Returns
        -------
        Simulation
            Itself.

        Raises
        ------
        DustError
            The duration is no such number or time.
        GuardStop
            The state is not valid; all records until then are on disk.
        Interrupted
            A signal arrived; all records until then are on disk.
        """
        run = self._run
        steps = steps_of(duration, run.clock)
        if not steps:
            return self
        last = run.sim.step + steps
        self._reopen()
        with self._interrupts(), run.record_guard_stop():
            run.advance_to(last)
            while run.sim.step < last:
                if not run.next_stage():
                    self._put_off()
                run.advance_to(last)
        return self

    def run(self) -> Self:
        """Advance to the end of the scene, as `dust run` does; beyond that end it ends here.

        Returns
        -------
        Simulation
            Itself.
        """
        run = self._run
        if self._before_end is not None:
            return self
        if self._past_end:
            run.end.step, run.end.reason = run.sim.step, f"{run.sim.step} steps"
        with self._interrupts(), show_progress(run, quiet=self._progress is False):
            run.go()
        self._before_end = run.before_end
        return self

    def _reopen(self) -> None:
        """After the end: remove the last frame, which was written because of it."""
        if self._before_end is None:
            return
        counts, last = self._before_end
        run = self._run
        run.writer = run.files.writer = Writer.resume(
            self.directory / files.RESULT, counts, lock=self._lock
        )
        run.state.last_snapshot, self._before_end = last, None
        self._put_off()

    def _put_off(self) -> None:
        self._past_end = True
        self._run.end.put_off()

    def _interrupts(self) -> Interrupts:
        interrupts = self._run.interrupts = Interrupts()
        interrupts.collect()
        return interrupts

    def save(self) -> None:
        """Write result and checkpoint to disk; another run may continue from here."""
        if self._before_end is None:
            self._run.files.save(self._run)

    def records(self, group: str) -> dict[str, NDArray[Any]]:
        """Arrays [SI] of a group of result.nc ("series", "snapshots", one of `every`), by name.

        Raises
        ------
        KeyError
            There is no such group.
        """
        self._run.files.flush()
        from xarray import DataTree  # slow to import, as the next

        from dusttaichi.results.reading import open_tree

        with open_tree(self.directory / files.RESULT) as tree:
            node = tree if group == "series" else cast(DataTree, tree[group])
            data = node.to_dataset(inherit=False)
            return {str(name): values.values for name, values in data.variables.items()}

    def flush(self) -> Path:
        """Write all records to disk, so that the result can be opened; returns its directory."""
        self._run.files.flush()
        return self.directory

    def close(self) -> None:
        """Save and release the directory; a temporary one is removed."""
        if self._lock is None:
            return
        try:
            with self._run.files:
                if self._temporary is None and self._before_end is None:
                    self._run.writer.set_status("interrupted")
                    self.save()
        finally:
            self._lock.release()
            self._lock = None
            if self._temporary is not None:
                self._temporary.cleanup()

    def __exit__(self, *_: object) -> None:
        self.close()
