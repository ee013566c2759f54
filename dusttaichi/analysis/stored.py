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


class Kind(NamedTuple):
    """Kind of stored dataset: its files, its name in messages, and what it must have."""

    files: tuple[str, ...]
    description: str
    required: tuple[str, ...]  # variables and attributes


KINDS = {
    "trade": Kind(("trade.nc",), "a trade", ("cost_ratio", "error")),
    "ensemble": Kind(
        ("sweep.nc", "ensemble.nc"),
        "an ensemble or a sweep",
        ("summary_numbers", "coordinate", "replica"),
    ),
    "collisions": Kind(
        ("collisions.nc",), "a study of collisions", ("outcome", "growth_efficiency")
    ),
    "restitution_map": Kind(
        ("restitution.nc",), "a map of restitution", ("restitution", "bound", "speed")
    ),
}
"""Kind of a dataset, which `open_KIND` opens -> its Kind."""
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
    """Kind (a key of KINDS) of the study whose file, or directory without a result, a path is."""
    return next((kind for kind in KINDS if _find_file(path, kind)), None)


def _find_file(path: str | Path, kind: str) -> Path | None:
    """The file of a kind at a path, or in its directory if that has no result; or None."""
    path, names = Path(path), KINDS[kind].files
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


def open_study(path: str | Path, kind: str) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a study of that kind, or of its directory, read into memory.

    Bundled extensions of its scene are imported, as by `open_run`.

    Parameters
    ----------
    path
    kind : str
        A key of KINDS.

    Raises
    ------
    DustError
        There is none, or it cannot be read.
    """
    file = _find_file(path, kind) or Path(path)
    data = read_stored(file, KINDS[kind].description, KINDS[kind].required)
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
    kind = next((kind for kind in KINDS if study in KINDS[kind].files), None)
    if study is not None:
        instructions = _explain_opening(folder, study, kind)
        text = f"{folder} is the folder of {STUDIES[study]}, not of a run: {instructions}"
    runs = [str(run.parent) for depth in BELOW for run in sorted(folder.glob(depth + RESULT))]
    if runs:
        listed = ", ".join(runs[:LISTED]) + (", ..." if len(runs) > LISTED else "")
        text += f" Runs in it ({len(runs)}): {listed}."
    elif kind in ("collisions", "restitution_map"):
        text += " Its collisions are not stored as runs; `dust run` stores one."
    elif list(folder.glob("collisions*.jsonl")):
        text += (
            " It has collisions of an unfinished study; `dust collide` with --resume gathers them."
        )
    return DustError(text)


def _explain_opening(folder: Path, study: str, kind: str | None) -> str:
    """Sentence with the commands, and the function of Python, for the file of a study."""
    commands = []
    if kind is not None:
        commands.append(f"`dust plot {folder}` draws it")
    if kind in ("ensemble", "collisions"):
        commands.append(f"`dust report {folder}` shows it")
    name, path = f"dusttaichi.analysis.open_{kind}", folder
    if kind is None:
        name, path = "xarray.open_dataset", folder / study
    return ", ".join([*commands, f'in Python {name}("{path}")']) + "."
