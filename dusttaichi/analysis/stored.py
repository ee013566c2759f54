"""Files with the datasets of many runs: of a trade, an ensemble, a sweep."""

from functools import partial
from pathlib import Path

import xarray as xr

from dusttaichi.errors import DustError
from dusttaichi.results.integrity import open_netcdf
from dusttaichi.scene import extensions

TRADES, ENSEMBLES = ("trade.nc",), ("sweep.nc", "ensemble.nc")


def stored(path, names):
    """The file of one of `names` at a path, or in its directory if that has no result; or None."""
    path = Path(path)
    if path.name in names:
        return path
    found = [path / name for name in names if (path / name).exists()]
    return found[0] if found and not (path / "result.nc").exists() else None


def read_stored(file, what, needed):
    """The dataset of a file, in memory. Raises DustError where it cannot be read.

    what: such as "a trade", for messages. needed: variables that it must have.
    """
    try:
        with open_netcdf(file, partial(xr.open_dataset, engine="netcdf4")) as data:
            data = data.load()
    except (OSError, ValueError, RuntimeError) as error:
        raise DustError(f"{file} cannot be read as {what}: {error}.") from error
    if not set(needed) <= {*data.variables, *data.attrs}:
        raise DustError(f"{file} is not {what}: it lacks {', '.join(sorted(needed))}.")
    return data


def is_trade(path):
    """True where a path is a trade.nc, or a directory with one and no result."""
    return stored(path, TRADES) is not None


def open_trade(path):
    """(dataset, file) of a trade.nc or its directory, read into memory.

    Raises
    ------
    DustError
        There is none, or it cannot be read.
    """
    file = stored(path, TRADES) or Path(path)
    return read_stored(file, "a trade", ("cost_ratio", "error")), file


def is_ensemble(path):
    """True where a path is a sweep.nc or an ensemble.nc, or a directory of one and no result."""
    return stored(path, ENSEMBLES) is not None


def open_ensemble(path):
    """(dataset, file) of an ensemble.nc, a sweep.nc or its directory.

    Bundled extensions of its scene are imported, as by `open_run`.

    Raises
    ------
    DustError
        There is none, or it cannot be read.
    """
    file = stored(path, ENSEMBLES) or Path(path)
    needed = ("summary_numbers", "coordinate", "replica")
    data = read_stored(file, "an ensemble or a sweep", needed)
    extensions.import_bundled(str(data.attrs.get(extensions.KEY, "")))
    return data, file
