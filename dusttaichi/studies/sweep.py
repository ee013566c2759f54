"""Replicas of a scene with other seeds, and sweeps over values of its YAML."""

import itertools
import os
import re
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from dusttaichi.errors import DustError
from dusttaichi.scene import Scene
from dusttaichi.studies.points import Point, name_of
from dusttaichi.studies.settings import Axis, Settings, data_of, grid, keys_of

LONGEST = 150  # characters of a directory's name
REPLICA = "replica_"  # begin of the names of directories of replicas


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

    def points(self, found) -> list[Point]:
        """All members, at once."""
        return list(self.members)

    def measure(self, run):
        """The run itself, whose series stays in memory."""
        return run

    def dataset(self, found) -> xr.Dataset:
        """The dataset of `analysis.gather`; numbers of failed runs are nan.

        Raises DustError where all failed.
        """
        from dusttaichi.analysis.ensemble import gather  # with all of the analysis

        found = [found[member.label] for member in self.members]
        runs = [one.measured for one in found]
        names = self.members[0].seeds
        labels = {name: [member.seeds[name] for member in self.members] for name in names}
        labels["status"] = [
            one.text if run is None else run.status for run, one in zip(runs, found, strict=True)
        ]
        labels["directory"] = [member.label for member in self.members]
        axes = {axis.dimension: _variable(axis) for axis in self.axes}
        scene = self.scene
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
    members = _replicas(scene, Path(directory), "", scene.name)
    return Sweep(scene, Path(directory), (), scene.replicas, tuple(members))


def sweep(scene: Scene, settings: Settings, directory: Path) -> Sweep:
    """The full grid over `settings`, times the scene's replicas.

    settings: texts "key=value,value,...", or the values of each key. Directory of a point:
    directory/<key=value__key=value...>. Raises DustError with all invalid settings.
    """
    if not settings:
        raise DustError("a sweep needs --set, such as --set boundary.wall_speed=1cm/s,5cm/s")
    axes, scenes = grid(scene, settings)
    members = []
    for label, of in zip(_labels(axes), scenes, strict=True):
        members += _replicas(of, Path(directory), label, name_of(scene, label))
    return Sweep(scene, Path(directory), axes, scene.replicas or 1, tuple(members))


def _replicas(scene, directory, label, name):
    if scene.replicas is None:
        return [Point.of(scene, directory, label, name=name)]
    if not (list(keys_of(data_of(scene).get("sample", {}), "seed")) or taken(scene, 0)):
        raise DustError(
            f"replicas = {scene.replicas}: the sample has no seed, and all runs would be equal; "
            "use a sample with a seed, such as kind: rbd, or of a run with replicas, or remove "
            "replicas"
        )
    return [
        Point.of(
            scene,
            directory,
            os.path.join(label, f"{REPLICA}{number}"),
            taken(scene, number),
            seed=number,
            name=f"{name[:94]}_{number}",
        )
        for number in range(scene.replicas)
    ]


def taken(scene: Scene, number: int) -> dict[str, str]:
    """Path in the YAML -> run, of a sample that is taken from a run with replicas.

    number: of the replica.
    """
    sample = data_of(scene).get("sample", {})
    files = {".".join(("sample", *path)): block["file"] for path, block in keys_of(sample, "file")}
    return {
        path: os.path.abspath(os.path.join(file, f"{REPLICA}{number}"))
        for path, file in files.items()
        if os.path.isdir(os.path.join(file, f"{REPLICA}0"))
    }


def _labels(axes):
    """Different names for the directories of the points, valid in any file system and shell."""
    points = itertools.product(*(axis.texts for axis in axes))
    keys = [axis.key for axis in axes]
    texts = ["__".join(map("=".join, zip(keys, point, strict=True))) for point in points]
    labels = [re.sub(r"[^\w.=+-]", "_", text.replace(" ", "")) for text in texts]
    if len(set(labels)) == len(labels) and max(map(len, labels)) <= LONGEST:
        return labels
    return [f"point_{number}" for number in range(len(labels))]


def _variable(axis):
    attrs = {"long_name": f"{axis.key} of the scene", "key": axis.key}
    if axis.coordinate.dtype.kind in "fi":
        attrs["units"] = axis.unit or "1"
    return xr.Variable((axis.dimension,), axis.coordinate, attrs)
