"""Study of the user, in a file: `dust study FILE.py SCENE.yaml`."""

from __future__ import annotations

import runpy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from dusttaichi import analysis
from dusttaichi.errors import DustError
from dusttaichi.scene import Scene, shipped
from dusttaichi.studies.points import Point
from dusttaichi.studies.study_types import PointResult, StagedStudy

STUDY_CLASS = "Study"  # of the class in the file


class UserStudy(StagedStudy):
    """Base class of a study in a file, whose class `Study` lists its points.

    It has a method `points`, (label -> result) -> list of all points so far, which is called until
    all have a result; or a generator `stages` (study_types.StagedStudy), which yields the points of
    each stage and then reads their results in `self.results`.

    Attributes
    ----------
    scene
        Scene of the command.
    directory
        Directory of the results.
    timed
        True where the points need a cost, the processor time of their steps (`PointResult.cost`).
    """

    timed = False

    def __init__(self, scene: Scene, directory: Path):
        self.scene, self.directory = scene, Path(directory)

    @property
    def file(self) -> Path:
        """File of the dataset."""
        return self.directory / "study.nc"

    def point(
        self, label: str, changes: Mapping[str, Any] | None = None, *, seed: int = 0
    ) -> Point:
        """The scene with changes as a run, see `points.Point.from_changes`."""
        return Point.from_changes(self.scene, self.directory, label, changes, seed=seed)

    def measure(self, run: analysis.Run) -> Mapping[str, float]:
        """Numbers of a finished run, by default those of its table."""
        numbers = analysis.summarise(run).items()
        return {name: value for name, value in numbers if isinstance(value, (int, float))}

    def dataset(self, results: Mapping[str, PointResult]) -> xr.Dataset:
        """The numbers over `point`, NaN where a run failed, with labels and status."""
        point_results = list(results.values())
        names = dict.fromkeys(name for result in point_results for name in result.measured or ())
        columns: dict[str, tuple[str, Any]] = {
            name: ("point", [(result.measured or {}).get(name, np.nan) for result in point_results])
            for name in names
        }
        texts = {
            "label": [result.point.label for result in point_results],
            "status": [result.text or "finished" for result in point_results],
        }
        columns |= {name: ("point", np.array(text, dtype=str)) for name, text in texts.items()}
        return xr.Dataset(columns)


def load_study(path: Path, scene: Scene, directory: Path) -> UserStudy:
    """The study in a file, or a bundled one such as "paszun_dominik2008/asperity_fit.py".

    Raises
    ------
    DustError
        The file cannot be read, or has no class `Study` with `points`.
    """
    file = path if path.is_file() else shipped.find_extension(path)
    if file is None:
        raise DustError(f"{path}: there is no such file; a study is a Python file")
    study_class = runpy.run_path(str(file)).get(STUDY_CLASS)
    if not (isinstance(study_class, type) and issubclass(study_class, UserStudy)):
        raise DustError(
            f"{path} has no class {STUDY_CLASS} that is a dusttaichi.studies.user_study.UserStudy; "
            "docs/extending.md has an example"
        )
    return study_class(scene, directory)
