"""Files with the datasets of many runs: of a trade, an ensemble, a sweep, a study of collisions."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from dusttaichi.errors import DustError
from dusttaichi.results.files import RESULT
from dusttaichi.results.integrity import open_netcdf
from dusttaichi.scene import extensions


class StoredStudy(NamedTuple):
    """Type of stored study: names of its file, its name in messages, and what it must have."""

    files: tuple[str, ...]
    description: str
    required: tuple[str, ...]  # variables and attributes


STORED_STUDIES = {
    "trade": StoredStudy(("trade.nc",), "a trade", ("cost_ratio", "error")),
    "ensemble": StoredStudy(
        ("sweep.nc", "ensemble.nc"),
        "an ensemble or a sweep",
        ("summary_numbers", "coordinate", "replica"),
    ),
    "collisions": StoredStudy(
        ("collisions.nc",), "a study of collisions", ("outcome", "growth_efficiency")
    ),
    "restitution_map": StoredStudy(
        ("restitution.nc",), "a map of restitution", ("restitution", "bound", "speed")
    ),
}
"""Type of a study, which `open_TYPE` opens -> its StoredStudy."""
STUDIES = {
    "sweep.nc": "a sweep",
    "ensemble.nc": "an ensemble",
    "trade.nc": "a trade",
    "collisions.nc": "a study of collisions",
    "restitution.nc": "a map of restitution",
    "extremes.nc": "a map of extremes",
    "study.nc": "a study",
}
"""File of a study -> its name in messages."""
LISTED = 6  # largest number of runs that a message names
BELOW = ("*/", "*/*/")  # where the runs of a study are: points, and their replicas


def find_study(path: str | Path) -> str | None:
    """Type of the study (a key of STORED_STUDIES) in a file, or a directory without a result."""
    return next((name for name in STORED_STUDIES if _find_file(path, name)), None)


def _find_file(path: str | Path, study_type: str) -> Path | None:
    """The file of a study at a path, or in its directory if that has no result; or None."""
    path, names = Path(path), STORED_STUDIES[study_type].files
    if path.name in names:
        return path
    files = [path / name for name in names if (path / name).exists()]
    return files[0] if files and not (path / "result.nc").exists() else None


def read_stored(file: str | Path, description: str, required: Sequence[str]) -> xr.Dataset:
    """The dataset of a file, in memory. Raises DustError where it cannot be read.

    description: such as "a trade", for messages. required: variables that it must have.
    """
    try:
        with open_netcdf(file, partial(xr.open_dataset, engine="netcdf4")) as opened:
            data: xr.Dataset = opened.load()
    except (OSError, ValueError, RuntimeError) as error:
        raise DustError(f"{file} cannot be read as {description}: {error}.") from error
    if not set(required) <= {*data.variables, *data.attrs}:
        raise DustError(f"{file} is not {description}: it lacks {', '.join(sorted(required))}.")
    return data


def open_study(path: str | Path, study_type: str) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a study of that type, or of its directory, read into memory.

    Bundled extensions of its scene are imported, as by `open_run`.

    Parameters
    ----------
    path
    study_type : str
        "trade", "ensemble", "collisions" or "restitution_map", as of `find_study`.

    Raises
    ------
    DustError
        There is none, or it cannot be read, or the type is another.
    """
    if study_type not in STORED_STUDIES:
        allowed = ", ".join(STORED_STUDIES)
        raise DustError(f"study_type = {study_type!r}: there is none; allowed: {allowed}.")
    file = _find_file(path, study_type) or Path(path)
    study = STORED_STUDIES[study_type]
    data = read_stored(file, study.description, study.required)
    extensions.import_bundled(str(data.attrs.get(extensions.KEY, "")))
    return data, file


def open_trade(path: str | Path) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a trade.nc or its directory, as `open_study` opens it."""
    return open_study(path, "trade")


def open_ensemble(path: str | Path) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of an ensemble.nc, a sweep.nc or its directory, as of `open_study`."""
    return open_study(path, "ensemble")


def open_collisions(path: str | Path) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a collisions.nc or its directory, as `open_study` opens it."""
    return open_study(path, "collisions")


def open_restitution_map(path: str | Path) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a restitution.nc or its directory, as `open_study` opens it."""
    return open_study(path, "restitution_map")


def explain_missing_result(path: str | Path) -> DustError:
    """The DustError about a path without a result: which study and runs are in a directory."""
    folder = Path(path)
    if not folder.is_dir():
        return DustError(f"There is no result at {folder}.")
    text = f"There is no result at {folder / RESULT}."
    study = next((name for name in STUDIES if (folder / name).exists()), None)
    study_type = next((key for key, type_ in STORED_STUDIES.items() if study in type_.files), None)
    if study is not None:
        instructions = _explain_opening(folder, study, study_type)
        text = f"{folder} is the folder of {STUDIES[study]}, not of a run: {instructions}"
    runs = [str(run.parent) for depth in BELOW for run in sorted(folder.glob(depth + RESULT))]
    if runs:
        listed = ", ".join(runs[:LISTED]) + (", ..." if len(runs) > LISTED else "")
        text += f" Runs in it ({len(runs)}): {listed}."
    elif study_type in ("collisions", "restitution_map"):
        text += " Its collisions are not stored as runs; `dust run` stores one."
    elif list(folder.glob("collisions*.jsonl")):
        text += (
            " It has collisions of an unfinished study; `dust collide` with --resume gathers them."
        )
    return DustError(text)


def _explain_opening(folder: Path, study: str, study_type: str | None) -> str:
    """Sentence with the commands, and the function of Python, for the file of a study."""
    commands = []
    if study_type is not None:
        commands.append(f"`dust plot {folder}` draws it")
    if study_type in ("ensemble", "collisions"):
        commands.append(f"`dust report {folder}` shows it")
    name, path = f"dusttaichi.analysis.open_{study_type}", folder
    if study_type is None:
        name, path = "xarray.open_dataset", folder / study
    return ", ".join([*commands, f'in Python {name}("{path}")']) + "."
