"""Replicas of a scene with other seeds, and sweeps over values of its YAML."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from dusttaichi.errors import DustError
from dusttaichi.scene import Scene
from dusttaichi.studies.points import Point, make_run_name
from dusttaichi.studies.scene_settings import Axis, Settings, find_keys, make_grid

if TYPE_CHECKING:
    from dusttaichi.analysis import Run
    from dusttaichi.studies.study_types import PointResult

LONGEST_NAME = 150  # characters of a directory's name
REPLICA_PREFIX = "replica_"  # begin of the names of directories of replicas


@dataclass(frozen=True)
class Sweep:
    """Study of all points of a grid, times the replicas; without axes of the replicas alone.

    members: in the order of the axes and then of the replicas.
    """

    scene: Scene
    directory: Path
    axes: tuple[Axis, ...]
    replicas: int
    members: tuple[Point, ...]

    timed = False

    @property
    def file(self) -> Path:
        """File of the dataset of all runs."""
        return self.directory / ("sweep.nc" if self.axes else "ensemble.nc")

    def points(self, results: Mapping[str, PointResult]) -> list[Point]:
        """All members, at once."""
        return list(self.members)

    def measure(self, run: Run) -> Run:
        """The run itself, whose series stays in memory."""
        return run

    def dataset(self, results: Mapping[str, PointResult]) -> xr.Dataset:
        """The dataset of `analysis.gather`; numbers of failed runs are nan.

        Raises DustError where all failed.
        """
        from dusttaichi.analysis.ensemble import gather  # with all of the analysis

        point_results = [results[member.label] for member in self.members]
        runs = [result.measured for result in point_results]
        names = self.members[0].seeds
        labels: dict[str, list[Any]] = {
            name: [member.seeds[name] for member in self.members] for name in names
        }
        labels["status"] = [
            result.text if result.measured is None else result.measured.status
            for result in point_results
        ]
        labels["directory"] = [member.label for member in self.members]
        axes, scene = {axis.dimension: _make_coordinate(axis) for axis in self.axes}, self.scene
        # as lists: a plain text is limited to 64 kB
        texts = {"scene_given": [scene.source], "scene_resolved": [scene.to_yaml()]}
        data = gather(runs, axes, labels, {"title": scene.name} | texts)
        for name in names:
            data[name].attrs["long_name"] = f"sample.{name.replace('_', '.')} of the run"
        data["directory"].attrs["long_name"] = "directory of the run, relative to this file"
        data["status"].attrs["long_name"] = "status of the run"
        return data


def replicas(scene: Scene, directory: Path) -> Sweep:
    """The replicas of a scene, directory/replica_0 and so on, with seeds increasing by one.

    Raises DustError where the scene has no replicas, or its sample has no seed.
    """
    if scene.replicas is None:
        raise DustError("replicas: missing in the scene; a number, such as 6")
    members = _make_replicas(scene, Path(directory), "", scene.name)
    return Sweep(scene, Path(directory), (), scene.replicas, tuple(members))


def sweep(scene: Scene, settings: Settings, directory: Path) -> Sweep:
    """The full grid over `settings`, times the scene's replicas.

    settings: texts "key=value,value,...", or the values of each key. Directory of a point:
    directory/<key=value__key=value...>. Raises DustError with all invalid settings.
    """
    if not settings:
        raise DustError("a sweep needs --set, such as --set boundary.wall_speed=1cm/s,5cm/s")
    axes, scenes = make_grid(scene, settings)
    members = []
    for label, changed_scene in zip(_make_labels(axes), scenes, strict=True):
        members += _make_replicas(
            changed_scene, Path(directory), label, make_run_name(scene, label)
        )
    return Sweep(scene, Path(directory), axes, scene.replicas or 1, tuple(members))


def _make_replicas(scene: Scene, directory: Path, label: str, name: str) -> list[Point]:
    if scene.replicas is None:
        return [Point.from_changes(scene, directory, label, name=name)]
    if not (list(find_keys(scene.plain.get("sample", {}), "seed")) or list_source_runs(scene, 0)):
        raise DustError(
            f"replicas = {scene.replicas}: the sample has no seed, and all runs would be equal; "
            "use a sample with a seed, such as kind: rbd, or of a run with replicas, or remove "
            "replicas"
        )
    return [
        Point.from_changes(
            scene,
            directory,
            os.path.join(label, f"{REPLICA_PREFIX}{number}"),
            list_source_runs(scene, number),
            seed=number,
            name=f"{name[:94]}_{number}",
        )
        for number in range(scene.replicas)
    ]


def list_source_runs(scene: Scene, number: int) -> dict[str, str]:
    """Path in the YAML -> run, of a sample that is taken from a run with replicas.

    number: of the replica.
    """
    sample = scene.plain.get("sample", {})
    files = {
        ".".join(("sample", *path)): block["file"] for path, block in find_keys(sample, "file")
    }
    return {
        path: os.path.abspath(os.path.join(file, f"{REPLICA_PREFIX}{number}"))
        for path, file in files.items()
        if os.path.isdir(os.path.join(file, f"{REPLICA_PREFIX}0"))
    }


def _make_labels(axes: tuple[Axis, ...]) -> list[str]:
    """Different names for the directories of the points, valid in any file system and shell."""
    points = itertools.product(*(axis.texts for axis in axes))
    keys = [axis.key for axis in axes]
    texts = ["__".join(map("=".join, zip(keys, point, strict=True))) for point in points]
    labels = [re.sub(r"[^\w.=+-]", "_", text.replace(" ", "")) for text in texts]
    if len(set(labels)) == len(labels) and max(map(len, labels)) <= LONGEST_NAME:
        return labels
    return [f"point_{number}" for number in range(len(labels))]


def _make_coordinate(axis: Axis) -> xr.Variable:
    attrs = {"long_name": f"{axis.key} of the scene", "key": axis.key}
    if axis.coordinate.dtype.kind in "fi":
        attrs["units"] = axis.unit or "1"
    return xr.Variable((axis.dimension,), axis.coordinate, attrs)
