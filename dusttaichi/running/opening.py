"""Start of a run: new, or resumed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dusttaichi import method
from dusttaichi.compute import compiler
from dusttaichi.errors import DustError
from dusttaichi.method import Start, State
from dusttaichi.results import Writer, open_result, provenance
from dusttaichi.results.files import CHECKPOINT, RESULT
from dusttaichi.results.pieces import make_exists_error
from dusttaichi.results.plain import from_plain
from dusttaichi.running import checkpoint
from dusttaichi.running.identity import (
    Origin,
    check_extensions,
    check_same,
    check_same_beginning,
    stage_stop,
)
from dusttaichi.running.loop import Run
from dusttaichi.running.persistence import RunFiles, check_outputs, write_scene
from dusttaichi.running.state import RunState

if TYPE_CHECKING:
    from dusttaichi.method import Engine
    from dusttaichi.results.run_lock import RunLock
    from dusttaichi.running.checkpoint import Checkpoint
    from dusttaichi.scene.scene import Scene


class Opening:
    """Opens the run of a scene in a directory with an acquired RunLock.

    sampled: called with the sample of a new run. callbacks: further arguments of Run.
    """

    def __init__(
        self,
        scene: Scene,
        directory: Path,
        lock: RunLock | None,
        *,
        sampled: Callable[[Any], object] = lambda sample: None,
        **callbacks: Any,
    ) -> None:
        self.sampled = sampled
        self.scene, self.directory, self.lock, self.callbacks = scene, directory, lock, callbacks
        self.method = method.find_method(scene)
        self.origin = Origin.read(scene)

    def open(self, sample: Any = None, *, force: bool = False, resume: bool = False) -> Run:
        """A Run: resumed if requested and possible, else new.

        sample: instead of that of the scene. Raises DustError, as for an existing result.
        """
        if not force and not resume and (self.directory / RESULT).exists():
            raise make_exists_error(self.directory / RESULT)
        # a resumed run has its files
        run = self.resume() if resume else None
        if run is None:
            check_outputs(self.scene, self.directory, force)
        return self.new(sample, force=force or resume) if run is None else run

    def new(self, sample: Any = None, force: bool = False) -> Run:
        """A Run at step 0 with its first records; sample: instead of that of the scene."""
        scene = self.scene
        sample = self.method.make_sample(scene) if sample is None else sample
        self.sampled(sample)
        sim = self.method.build(scene, sample)
        remarks = getattr(sample, "info", {}).get("remarks", ())
        for text in [*remarks, *getattr(sim, "remarks", ())]:
            self.callbacks["log"](text)
        # a signal during the first records ends the run with its status and checkpoint
        self.callbacks["interrupts"].collect()
        checkpoint.discard(self.directory / CHECKPOINT)
        write_scene(scene, self.directory)
        writer = Writer.create(
            self.directory / RESULT,
            sim.variables,
            sim.sizes(),
            sim.constants(),
            self._attributes(sim),
            force=force,
            lock=self.lock,
        )
        run = self._run(sim, RunState(Start.from_measurement(sim.measure())), writer)
        run.begin()
        run.stop_if_interrupted()
        return run

    def resume(self) -> Run | None:
        """A Run at the checkpoint of an earlier one, or None without a checkpoint.

        Raises DustError for a checkpoint of another scene or version, or the result of another.
        """
        path, log = self.directory / CHECKPOINT, self.callbacks["log"]
        if not checkpoint.exists(path):
            _check_replaced(self.directory / RESULT, self.scene)
            log(f"no checkpoint found in {self.directory}: starting from the beginning")
            return None
        saved = checkpoint.load(path)
        if saved.note:
            log(saved.note)
        check_extensions(saved.meta.get("extensions", []), self.scene)
        self._check_code(saved)
        stage = saved.meta["run"]["stage"]
        check_same(saved.meta, self.scene, self.origin.inputs, stage)
        if stage_stop(saved.meta["scene"], stage) != stage_stop(self.scene.to_yaml(), stage):
            saved.meta["run"]["end_reason"] = ""
        run = self._restore(saved)
        time = run.sim.time * run.sim.units("s") * 1e6
        log(f"continuing from step {run.sim.step:,} ({time:.6g} µs)")
        return run

    def _restore(self, saved: Checkpoint) -> Run:
        """A Run from a Checkpoint."""
        state = State(saved.arrays, saved.meta["numbers"])
        sim = self.method.reopen(self.scene, state)
        if sim.dt != state.numbers["dt"]:
            saved_step, scene_step = (
                dt * sim.units("s") * 1e9 for dt in (state.numbers["dt"], sim.dt)
            )
            raise DustError(
                f"{saved.source} has a time step of {saved_step:.6g} ns, and this scene one of "
                f"{scene_step:.6g} ns. Start again with --force."
            )
        writer = Writer.resume(self.directory / RESULT, saved.meta["counts"], lock=self.lock)
        return self._run(sim, from_plain(RunState, saved.meta["run"]), writer)

    def _check_code(self, saved: Checkpoint) -> None:
        if saved.meta.get("code") != self.origin.code:
            raise DustError(
                f"{saved.source} was written by another version of dusttaichi or its compiler "
                f"(here {compiler.label()}), or with another version of your laws: numbers may "
                "differ. Continue with that version, or start again with --force."
            )

    def _run(self, sim: Engine, state: RunState, writer: Writer) -> Run:
        every = self.scene.output.checkpoint
        run_files = RunFiles(self.directory, writer, every, self.origin, lock=self.lock)
        return Run(self.scene, sim, state, run_files, **self.callbacks)

    def _attributes(self, sim: Engine) -> dict[str, Any]:
        scene = self.scene
        common = {
            "title": scene.name,
            "time_step": sim.dt * sim.units("s"),
            "stages": " ".join(stage.name for stage in scene.stages) or None,
            "extensions": "\n".join(scene.imported_texts) or None,
        }
        return provenance(scene.source or "", scene.to_yaml(), **(common | sim.attributes()))


def _check_replaced(path: str | Path, scene: Scene) -> None:
    """Raise DustError for a result without a checkpoint that is finished or of another scene.

    One in use is refused as well.
    """
    try:
        with open_result(path) as file:
            status = str(getattr(file, "status", ""))
            scene_text = str(getattr(file, "scene_resolved", ""))
    except FileNotFoundError:
        return
    if status.startswith("finished"):
        raise DustError(
            f"{path} is finished, and its checkpoint is missing. Start again with --force, or "
            "choose another output directory."
        )
    if scene_text:
        check_same_beginning(scene_text, scene, path)
