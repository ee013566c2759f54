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
from typing import Any, cast

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
from dusttaichi.studies.jobs import Task, read_content
from dusttaichi.studies.result_store import ResultStore
from dusttaichi.studies.scene_settings import find_keys, list_input_files, make_portable
from dusttaichi.studies.study_types import RunStudy, Study
from dusttaichi.studies.workers import Answer

NAME_LENGTH = 90  # characters of the name of a scene
COST = "cost.json"
RUN = "dusttaichi.studies.jobs:run"
# keys whose change does not invalidate a finished run
IRRELEVANT_KEYS = (("output", "directory"), ("output", "checkpoint"), ("numerics", "threads"))


def read_result_keys(text: str) -> dict[str, Any]:
    """Scene of a YAML text as plain data, without the keys that do not change the result."""
    return without(yaml.safe_load(text), IRRELEVANT_KEYS)


def make_run_name(scene: Scene, label: str) -> str:
    """Name of a scene with a label; a long one ends with a digest in place of its rest."""
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", f"{scene.name}-{label}")
    if len(name) <= NAME_LENGTH:
        return name
    digest = hashlib.sha256(label.encode()).hexdigest()[:8]
    return f"{name[: NAME_LENGTH - 9]}-{digest}"


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
    def from_changes(
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
        data = (scene.with_values(dict(changes)) if changes else scene).plain
        data.pop("replicas", None)
        data["name"] = name or make_run_name(scene, label)
        data["output"]["directory"] = str(Path(directory) / label)
        # those of many runs may fill a disk
        if data["output"]["snapshots"] == "auto" and not snapshots:
            data["output"]["snapshots"] = "off"
        seeds = {}
        for path, block in find_keys(data.get("sample", {}), "seed"):
            block["seed"] += seed
            seeds["_".join(path)] = block["seed"]
        make_portable(data)
        changed_scene = Scene.from_dict(data, title=f"the scene of {label}")
        return cls(label, changed_scene, Path(directory) / label, seeds)

    @property
    def inputs(self) -> list[str]:
        """Paths of the files that the run reads."""
        return list_input_files(self.scene)

    def choose_mode(self, store: ResultStore) -> str | None:
        """Mode of the run: "new", "force" (start again), "resume", or None where it is finished.

        A run with a cost runs without interruption and by this code. Raises DustError where it has
        results that the store neither overwrites nor continues.
        """
        if store.force:
            return "force"
        if not store.resume:
            if (self.directory / RESULT).exists():
                raise make_exists_error(self.directory / RESULT, "with the missing runs")
            return "new"
        status = self._read_status(store.timed)
        if status.startswith("finished") and not (store.timed and self.cost is None):
            return None
        if status and store.timed and self.guard_reason:
            return None
        # without a checkpoint a run cannot continue, whatever other files there are
        has_checkpoint = not store.timed and (self.directory / CHECKPOINT).exists()
        return "resume" if has_checkpoint else "force"

    def find_answer(self, store: ResultStore) -> Answer | None:
        """Its Answer where it is finished, or was stopped by a guard, as it would be again."""
        store.modes[self.label] = self.choose_mode(store)
        if store.modes[self.label] is not None:
            return None
        text = self.guard_reason if store.timed else ""
        return Answer(GuardStop.exit_code if text else 0, text)

    def save_answer(self, answer: Answer, store: ResultStore) -> None:
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
            if store.timed and answer.code in (0, GuardStop.exit_code):
                record = (
                    {"stopped": answer.text} if answer.code else {"cost": answer.values["cost"]}
                )
                text = json.dumps(record | {"code": package_hash()})
                files.write_whole(self.directory / COST, text.encode())
        except OSError as error:
            reason = files.explain(error, self.directory / RESULT)
            raise DustError(f"Cannot write {self.directory}: {reason}.") from error

    def choose_processes(self, count: int, cores: int, *, remote: bool) -> tuple[int, int | str]:
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
        return min(count, max(1, cores // int(threads))), threads

    def to_task(
        self,
        threads: int | str,
        store: ResultStore,
        *,
        remote: bool,
        execute_options: dict[str, Any],
    ) -> Task:
        """The Task of the run, on a cluster with the files that it needs.

        The mode is that of `find_answer`. execute_options: further arguments of `execute`.
        """
        mode, folder = store.modes[self.label], None
        scene = self.scene.with_value("numerics.threads", threads).to_yaml()
        arguments: dict[str, Any] = {"scene": scene, "mode": mode, "timed": store.timed}
        arguments["execute_options"] = execute_options
        if not remote:
            arguments["directory"] = os.path.abspath(self.directory)
        elif mode == "resume":
            names = run_files(self.directory)
            folder = {name: read_content(self.directory / name) for name in names}
        else:
            checkpoint.discard(self.directory / CHECKPOINT)
            folder = {}
        return Task(self.label, RUN, arguments, folder=folder, alone=True)

    def measure_answer(self, study: Study, answer: Answer) -> tuple[Any, float | None]:
        """(numbers that a Study measures of the run, its cost if the study is timed)."""
        from dusttaichi.analysis import open_run  # which takes a second

        with open_run(self.directory) as run:
            return cast(RunStudy, study).measure(run), self.cost if study.timed else None

    @property
    def cost(self) -> float | None:
        """Processor time of the steps of the finished run [s], None of other code or without it."""
        cost: float | None = self._read_record("cost")
        return cost

    @property
    def guard_reason(self) -> str:
        """Reason why a guard has stopped a timed run; "" if none has, or other code ran."""
        return self._read_record("stopped") or ""

    def _read_record(self, key: str) -> Any:
        try:
            record = json.loads((self.directory / COST).read_text(encoding="utf-8"))
            return record[key] if record["code"] == package_hash() else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def _read_status(self, timed: bool) -> str:
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
        return status if read_result_keys(scene) == read_result_keys(self.scene.to_yaml()) else ""
