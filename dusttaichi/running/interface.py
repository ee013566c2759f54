"""A run from Python, in SI: that of `dust run`, with a bitwise identical result.nc."""

import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dusttaichi.errors import DustError, naming_keywords
from dusttaichi.results import Writer, files
from dusttaichi.results.run_lock import RunLock
from dusttaichi.running.activities import OwnRecords, series_record, take_records
from dusttaichi.running.durations import interval_of, steps_of
from dusttaichi.running.interrupts import Interrupts, before_the_first_step
from dusttaichi.running.opening import Opening
from dusttaichi.running.present import label_values, line_of, read_only
from dusttaichi.running.progress import show_progress
from dusttaichi.running.script import ScriptControl
from dusttaichi.scene import Scene
from dusttaichi.scene.paths import user_path


def simulate(
    scene: Scene,
    sample: Any = None,
    directory: str | Path | None = None,
    *,
    force: bool = False,
    resume: bool = False,
    log: Callable[[str], object] = print,
    progress: bool | None = None,
) -> "Simulation":
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

    def __init__(self, scene, sample, directory, *, force, resume, log, progress):
        self._temporary = tempfile.TemporaryDirectory() if directory is None else None
        self.scene, self._progress = scene, progress
        self.directory = user_path(self._temporary.name if directory is None else directory)
        self._lock = RunLock(self.directory)
        # state of the result before the last frame, at the end; whether the end was passed
        self._before_end, self._past_end = None, False
        try:
            with Interrupts() as interrupts, before_the_first_step():
                opening = Opening(
                    scene,
                    self.directory,
                    self._lock,
                    report=lambda report: None,
                    interrupts=interrupts,
                    log=log,
                )
                self._run = opening.open(sample, force=force, resume=resume)
        except BaseException:
            self._lock.release()
            raise

    def __repr__(self):
        return line_of(self, self._run)

    @property
    def step(self):
        """Whole steps done."""
        return self._run.sim.step

    @property
    def time(self):
        """Simulated time [s]."""
        return self._run.sim.time * self._run.sim.units("s")

    @property
    def time_step(self):
        """The step [s]."""
        return self._run.sim.dt * self._run.sim.units("s")

    def measure(self):
        """Present values of the time series of result.nc, in SI, by the same names.

        `units` has their units. Arrays are read-only xarray.DataArray, as pressure.sel(wall="top").
        Averages (pressure, wall_force, stress) are over the time since the last record, or, at the
        step of a record, over its time. The state does not change.
        """
        run, sim = self._run, self._run.sim
        window = run.state.window(sim)
        return label_values(sim, series_record(sim, run.clock, run.state, sim.measure(), window))

    def snapshot(self):
        """The current frame: group of result.nc (snapshots, ...) -> name -> array [SI].

        This and all other arrays of the state are read-only copies: nothing that is written into
        them would change the simulation. A changed sample does.
        """
        return {
            group: {name: read_only(values) for name, values in record.items()}
            for group, record in take_records(self._run.sim, "snapshots")
        }

    @property
    def positions(self):
        """Positions of the grains [m], (grains, 3)."""
        return self.snapshot()["snapshots"]["position"]

    @property
    def velocities(self):
        """Velocities [m/s], (grains, 3), at the same time."""
        return self.snapshot()["snapshots"]["velocity"]

    @property
    def spins(self):
        """Angular velocities [rad/s], (grains, 3)."""
        return self.snapshot()["snapshots"]["spin"]

    @property
    def contacts(self):
        """Contacts between grains: name -> array, one row a contact, as in /contacts of result.nc.

        Names are for example grain_i, grain_j, overlap [m]. Needs `output.contacts: true`, the
        default.
        """
        groups = self.snapshot()
        if "contacts" not in groups:
            raise DustError("output.contacts = false: contacts are not recorded; allowed: true")
        return groups["contacts"]

    def forces(self):
        """Force and torque of the contacts on every grain.

        They are evaluated from the current positions, velocities and histories, without a step.

        Returns
        -------
        force
            [N], (grains, 3).
        torque
            [N m], (grains, 3).

        Raises
        ------
        DustError
            The method has no forces.
        """
        if not hasattr(self._run.sim, "forces"):
            raise DustError("forces are known of grains; this scene is of another method")
        return tuple(read_only(values) for values in self._run.sim.forces())

    def every(self, interval, function, name=None, *, units=()):
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
        group = name or getattr(function, "__name__", "records")
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

    def advance(self, duration):
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

    def run(self):
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

    def _reopen(self):
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

    def _put_off(self):
        self._past_end = True
        self._run.end.put_off()

    def _interrupts(self):
        interrupts = self._run.interrupts = Interrupts()
        interrupts.collect()
        return interrupts

    def save(self):
        """Write result and checkpoint to disk; another run may continue from here."""
        if self._before_end is None:
            self._run.files.save(self._run)

    def records(self, group):
        """Arrays [SI] of a group of result.nc ("series", "snapshots", one of `every`), by name.

        Raises
        ------
        KeyError
            There is no such group.
        """
        self._run.files.flush()
        from dusttaichi.results.reading import open_tree  # slow to import

        with open_tree(self.directory / files.RESULT) as tree:
            data = (tree if group == "series" else tree[group]).to_dataset(inherit=False)
            return {name: values.values for name, values in data.variables.items()}

    def flush(self):
        """Write all records to disk, so that the result can be opened; returns its directory."""
        self._run.files.flush()
        return self.directory

    def close(self):
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

    def __exit__(self, *_):
        self.close()
