"""Points of a study, each a changed scene that runs into a directory of its own."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dusttaichi.scene import Scene
from dusttaichi.studies.settings import data_of, keys_of, portable

NAME = 90  # characters of the name of a scene


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
        made = Scene.from_dict(data, title=f"the scene of {label}")
        return cls(label, made, Path(directory) / label, seeds)
