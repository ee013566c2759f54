"""Points of a study, each a changed scene that runs into a directory of its own."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from dusttaichi.errors import DustError, GuardStop
from dusttaichi.results import files
from dusttaichi.results.files import CHECKPOINT, RESULT, run_files
from dusttaichi.results.integrity import DamagedFile
from dusttaichi.results.pieces import make_exists_error
from dusttaichi.results.reading import open_tree
from dusttaichi.running import checkpoint
from dusttaichi.running.identity import package_hash, without
from dusttaichi.scene import Scene
from dusttaichi.studies.jobs import Task, content_of
from dusttaichi.studies.settings import data_of, input_files, keys_of, portable
from dusttaichi.studies.workers import Answer

NAME = 90  # characters of the name of a scene
COST = "cost.json"
RUN = "dusttaichi.studies.jobs:run"
# keys whose change does not invalidate a finished run
BESIDES = (("output", "directory"), ("output", "checkpoint"), ("numerics", "threads"))


def core_of(text: str) -> dict[str, Any]:
    """Scene of a YAML text as plain data, without the keys that do not change the result."""
    return without(yaml.safe_load(text), BESIDES)


def name_of(scene: Scene, label: str) -> str:
    """Name of a scene with a label; a long one ends with a digest in place of its rest."""
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", f"{scene.name}-{label}")
    if len(name) <= NAME:
        return name
    digest = hashlib.sha256(label.encode()).hexdigest()[:8]
    return f"{name[: NAME - 9]}-{digest}"


@dataclass(frozen=True)
class Point:
    """One run of a study.

    Attributes
    ----------
    label
        Name of the point, and its directory relative to that of the study.
    scene
        The changed scene.
    directory
        Directory of the run.
    seeds
        Seeds of the sample by their path below `sample`.
    """

    label: str
    scene: Scene
    directory: Path
    seeds: dict[str, int]

    @classmethod
    def of(
        cls,
        scene: Scene,
        directory: Path,
        label: str,
        changes: Mapping[str, Any] | None = None,
        *,
        seed: int = 0,
        name: str | None = None,
        snapshots: bool = False,
    ) -> Point:
        """The point of a scene with changes, path in the YAML -> value.

        Parameters
        ----------
        scene
        directory
            Directory of the study.
        label
        changes
        seed
            Number that is added to every seed of the sample.
        name
            Name of the changed scene, by default that of the scene with the label.
        snapshots
            False: with `output.snapshots: auto` the run has none.

        Raises
        ------
        DustError
            The scene refuses the changes.
        """
        data = data_of(scene.with_values(changes) if changes else scene)
        data.pop("replicas", None)
        data["name"] = name or name_of(scene, label)
        data["output"]["directory"] = str(Path(directory) / label)
        # those of many runs may fill a disk
        if data["output"]["snapshots"] == "auto" and not snapshots:
            data["output"]["snapshots"] = "off"
        seeds = {}
        for path, block in keys_of(data.get("sample", {}), "seed"):
            block["seed"] += seed
            seeds["_".join(path)] = block["seed"]
        portable(data)
        changed_scene = Scene.from_dict(data, title=f"the scene of {label}")
        return cls(label, changed_scene, Path(directory) / label, seeds)

    @property
    def inputs(self) -> list[str]:
        """Paths of the files that the run reads."""
        return input_files(self.scene)

    def mode(self, shelf) -> str | None:
        """Mode of the run: "new", "force" (start again), "resume", or None where it is finished.

        Where its cost is wanted, it runs in one piece and by this code. Raises DustError where its
        results are there and the shelf neither overwrites nor continues them.
        """
        if shelf.force:
            return "force"
        if not shelf.resume:
            if (self.directory / RESULT).exists():
                raise make_exists_error(self.directory / RESULT, "with the missing runs")
            return "new"
        status = self._status(shelf.timed)
        if status.startswith("finished") and not (shelf.timed and self.cost is None):
            return None
        if status and shelf.timed and self.stopped:
            return None
        # without a checkpoint a run cannot continue, whatever other files there are
        has_checkpoint = not shelf.timed and (self.directory / CHECKPOINT).exists()
        return "resume" if has_checkpoint else "force"

    def find_answer(self, shelf) -> Answer | None:
        """Its Answer where it is finished, or was stopped by a guard, as it would be again."""
        shelf.modes[self.label] = self.mode(shelf)
        if shelf.modes[self.label] is not None:
            return None
        text = self.stopped if shelf.timed else ""
        return Answer(GuardStop.exit_code if text else 0, text)

    def store(self, answer, shelf):
        """Write the files that came back from a temporary directory. Raises DustError.

        With them go the cost of a timed run, or why a guard has stopped it.
        """
        try:
            if RESULT in answer.files:  # parts belong to the previous result
                parts_folder = files.parts_folder(self.directory / RESULT)
                shutil.rmtree(parts_folder, ignore_errors=True)
            for name, content in answer.files.items():
                (self.directory / name).parent.mkdir(parents=True, exist_ok=True)
                files.write_whole(self.directory / name, content)
            if shelf.timed and answer.code in (0, GuardStop.exit_code):
                record = {"stopped": answer.text} if answer.code else {"cost": answer.found["cost"]}
                text = json.dumps(record | {"code": package_hash()})
                files.write_whole(self.directory / COST, text.encode())
        except OSError as error:
            reason = files.explain(error, self.directory / RESULT)
            raise DustError(f"Cannot write {self.directory}: {reason}.") from error

    def choose_processes(self, count, cores, *, remote):
        """(simultaneous runs of `count` on some cores, threads of each or "auto").

        A GPU takes one run at a time.
        """
        threads = self.scene.numerics.threads
        if remote and threads == "auto":
            # a task takes one thread of a worker, whose cores are not known here
            return min(count, cores), 1
        if count == 1 or self.scene.numerics.backend != "cpu":
            return 1, threads
        if threads == "auto":
            threads = max(1, cores // count)
        return min(count, max(1, cores // threads)), threads

    def to_task(self, threads, shelf, *, remote, how) -> Task:
        """The Task of the run, on a cluster with the files that it needs.

        The mode is that in which `find_answer` has found it. how: further arguments of `execute`.
        """
        mode, folder = shelf.modes[self.label], None
        scene = self.scene.with_value("numerics.threads", threads).to_yaml()
        arguments = {"scene": scene, "mode": mode, "timed": shelf.timed, "how": how}
        if not remote:
            arguments["directory"] = os.path.abspath(self.directory)
        elif mode == "resume":
            names = run_files(self.directory)
            folder = {name: content_of(self.directory / name) for name in names}
        else:
            checkpoint.discard(self.directory / CHECKPOINT)
            folder = {}
        return Task(self.label, RUN, arguments, folder=folder, alone=True)

    def measure_answer(self, study, answer):
        """(numbers that a Study measures of the run, its cost if that is wanted)."""
        from dusttaichi.analysis import open_run  # which takes a second

        with open_run(self.directory) as run:
            return study.measure(run), self.cost if study.timed else None

    @property
    def cost(self) -> float | None:
        """Processor time of the steps of the finished run [s], None of other code or without it."""
        return self._stored("cost")

    @property
    def stopped(self) -> str:
        """Reason why a guard has stopped a timed run; "" if none has, or other code ran."""
        return self._stored("stopped") or ""

    def _stored(self, key):
        try:
            record = json.loads((self.directory / COST).read_text(encoding="utf-8"))
            return record[key] if record["code"] == package_hash() else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def _status(self, timed):
        """End of the result of the scene of the point, "" without one.

        timed: one of other threads counts for none, as they have another cost. Raises DustError,
        OSError where it is in use or cannot be read, as it would otherwise be computed again.
        """
        try:
            with open_tree(self.directory / RESULT) as result:
                status, scene = result.attrs["status"], result.attrs["scene_resolved"]
                extensions = str(result.attrs.get("extensions", ""))
        except (FileNotFoundError, DamagedFile, RuntimeError, ValueError, KeyError):
            return ""  # without a result, or with a damaged one
        if extensions != "\n".join(self.scene.imported_texts):
            return ""
        threads = self.scene.numerics.threads
        if timed and threads not in ("auto", yaml.safe_load(scene)["numerics"]["threads"]):
            return ""
        return status if core_of(scene) == core_of(self.scene.to_yaml()) else ""
