"""Files with the datasets of many runs: of a trade, an ensemble, a sweep, a study of collisions."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import xarray as xr

from dusttaichi.errors import DustError
from dusttaichi.results.files import RESULT
from dusttaichi.results.integrity import open_netcdf
from dusttaichi.scene import extensions

TRADES, ENSEMBLES = ("trade.nc",), ("sweep.nc", "ensemble.nc")
COLLISIONS, MAPS = ("collisions.nc",), ("restitution.nc",)
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


def find_stored(path: str | Path, names: Sequence[str]) -> Path | None:
    """The file of one of `names` at a path, or in its directory if that has no result; or None."""
    path = Path(path)
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


def is_trade(path: str | Path) -> bool:
    """True where a path is a trade.nc, or a directory with one and no result."""
    return find_stored(path, TRADES) is not None


def open_trade(path: str | Path) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a trade.nc or its directory, read into memory.

    Raises
    ------
    DustError
        There is none, or it cannot be read.
    """
    return _open(path, TRADES, "a trade", ("cost_ratio", "error"))


def is_ensemble(path: str | Path) -> bool:
    """True where a path is a sweep.nc or an ensemble.nc, or a directory of one and no result."""
    return find_stored(path, ENSEMBLES) is not None


def open_ensemble(path: str | Path) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of an ensemble.nc, a sweep.nc or its directory.

    Bundled extensions of its scene are imported, as by `open_run`.

    Raises
    ------
    DustError
        There is none, or it cannot be read.
    """
    required = ("summary_numbers", "coordinate", "replica")
    data, file = _open(path, ENSEMBLES, "an ensemble or a sweep", required)
    extensions.import_bundled(str(data.attrs.get(extensions.KEY, "")))
    return data, file


def is_collisions(path: str | Path) -> bool:
    """True where a path is a collisions.nc, or a directory with one and no result."""
    return find_stored(path, COLLISIONS) is not None


def open_collisions(path: str | Path) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a collisions.nc or its directory; bundled extensions are imported.

    Raises
    ------
    DustError
        There is none, or it cannot be read.
    """
    required = ("outcome", "growth_efficiency")
    data, file = _open(path, COLLISIONS, "a study of collisions", required)
    extensions.import_bundled(str(data.attrs.get(extensions.KEY, "")))
    return data, file


def is_restitution_map(path: str | Path) -> bool:
    """True where a path is a restitution.nc, or a directory with one and no result."""
    return find_stored(path, MAPS) is not None


def open_restitution_map(path: str | Path) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a restitution.nc or its directory.

    Raises
    ------
    DustError
        There is none, or it cannot be read.
    """
    return _open(path, MAPS, "a map of restitution", ("restitution", "bound", "speed"))


def _open(
    path: str | Path, names: Sequence[str], description: str, required: Sequence[str]
) -> tuple[xr.Dataset, Path]:
    """(dataset, file) of a stored dataset of one of these file names, or of its directory."""
    file = find_stored(path, names) or Path(path)
    return read_stored(file, description, required), file


def explain_missing_result(path: str | Path) -> DustError:
    """The DustError about a path without a result: which study and runs are in a directory."""
    folder = Path(path)
    if not folder.is_dir():
        return DustError(f"There is no result at {folder}.")
    text = f"There is no result at {folder / RESULT}."
    study = next((name for name in STUDIES if (folder / name).exists()), None)
    if study is not None:
        instructions = _explain_opening(folder, study)
        text = f"{folder} is the folder of {STUDIES[study]}, not of a run: {instructions}"
    runs = [str(run.parent) for depth in BELOW for run in sorted(folder.glob(depth + RESULT))]
    if runs:
        listed = ", ".join(runs[:LISTED]) + (", ..." if len(runs) > LISTED else "")
        text += f" Runs in it ({len(runs)}): {listed}."
    elif study in (*COLLISIONS, *MAPS):
        text += " Its collisions are not stored as runs; `dust run` stores one."
    elif list(folder.glob("collisions*.jsonl")):
        text += (
            " It has collisions of an unfinished study; `dust collide` with --resume gathers them."
        )
    return DustError(text)


def _explain_opening(folder: Path, study: str) -> str:
    """Sentence with the commands, and the function of Python, for the file of a study."""
    commands = []
    if study not in ("extremes.nc", "study.nc"):
        commands.append(f"`dust plot {folder}` draws it")
    if study in (*ENSEMBLES, *COLLISIONS):
        commands.append(f"`dust report {folder}` shows it")
    opens = {"trade.nc": "open_trade", "collisions.nc": "open_collisions"}
    opens |= dict.fromkeys(ENSEMBLES, "open_ensemble") | {"restitution.nc": "open_restitution_map"}
    name = f"dusttaichi.analysis.{opens[study]}" if study in opens else "xarray.open_dataset"
    path = folder if study in opens else folder / study
    return ", ".join([*commands, f'in Python {name}("{path}")']) + "."
