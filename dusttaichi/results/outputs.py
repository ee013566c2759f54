"""Rules for output paths: no file of the user is overwritten without --force, no input at all.

A file counts as written by this program if it contains the mark of its format, so that a new figure
or table replaces the former one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING

from dusttaichi.errors import DustError
from dusttaichi.results.files import explain, remove, replace_atomically, write_whole

if TYPE_CHECKING:
    import xarray as xr


MARK = "written by dusttaichi"  # in the metadata of figures and films
NETCDF = "dusttaichi"  # in the attribute `source` of data sets
SEARCHED = 1 << 20  # bytes at the start and at the end of a file that are searched for the mark

_force = ContextVar("force", default=False)
_inputs: ContextVar[tuple[Path, ...]] = ContextVar("inputs", default=())


@contextmanager
def writing(*, force: bool = False, inputs: Iterable[str | Path] = ()) -> Iterator[None]:
    """Context in which `force` allows to overwrite foreign files, but never these inputs.

    inputs: paths of files, or of run directories for their results.
    """
    read = [Path(path) / "result.nc" if Path(path).is_dir() else Path(path) for path in inputs]
    tokens = _force.set(force), _inputs.set((*_inputs.get(), *read))
    try:
        yield
    finally:
        _force.reset(tokens[0])
        _inputs.reset(tokens[1])


def check(path: str | Path, mark: str = MARK) -> Path:
    """`path`, if it may be written. Raises DustError for an input or a foreign file.

    mark: text in such files of this program.
    """
    path = Path(path)
    refuse_inputs(path, _inputs.get())
    if path.is_dir():
        raise DustError(f"{path} is a directory; a file name is needed.")
    empty = path.is_file() and path.stat().st_size == 0
    if not _force.get() and path.exists() and not (empty or is_ours(path, mark)):
        raise DustError(
            f"{path} exists and was not written by dusttaichi. --force overwrites it, --output "
            "names another place."
        )
    return path


def write(path: str | Path, text: str, mark: str) -> Path:
    """Write a text file, complete or not at all; returns its path.

    mark: as of `check`; "" where any file may be replaced. Raises DustError, also where the file
    cannot be written.
    """
    path = check(path, mark)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text.encode())
    except OSError as error:
        raise DustError(f"{path} cannot be written: {explain(error, path)}.") from error
    return path


def write_dataset(path: str | Path, data: xr.Dataset, mark: str, *, packed: bool = False) -> Path:
    """Write an xr.Dataset as NetCDF, complete or not at all; returns its path.

    mark: as of `check`. packed: its variables are compressed. Raises DustError, also where the file
    cannot be written.
    """
    path = check(path, mark)
    temporary = path.with_name(f".{path.name}.tmp")
    encoding = {name: {"zlib": True, "complevel": 1} for name in data.data_vars if packed}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        data.to_netcdf(temporary, engine="netcdf4", encoding=encoding)
        replace_atomically(temporary, path)
    except (OSError, RuntimeError) as error:
        remove(temporary)
        raise DustError(f"{path} cannot be written: {explain(error, path)}.") from error
    return path


def refuse_inputs(path: Path, inputs: Iterable[Path]) -> None:
    """Raises DustError where `path` is one of the files that are read."""
    for input_path in inputs:
        if input_path.exists() and path.exists() and path.samefile(input_path):
            raise DustError(
                f"{path} is read by this command and would be overwritten by it. Choose another "
                "--output."
            )


def is_ours(path: Path, mark: str = MARK) -> bool:
    """True for a regular file with the mark near its start or its end."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(SEARCHED)
        file.seek(max(len(head), path.stat().st_size - SEARCHED))
        return mark.encode() in head or mark.encode() in file.read(SEARCHED)
