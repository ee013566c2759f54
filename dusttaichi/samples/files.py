"""Files of samples, read as dicts of arrays in SI (position, velocity, spin, contacts)."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, ValidationInfo

from dusttaichi.errors import DustError
from dusttaichi.files import refuse_unreadable
from dusttaichi.samples import csv_file, foreign
from dusttaichi.samples.sample import memory
from dusttaichi.scene.fields import needed

HEAD = 4096  # bytes at the start of a file that identify its format


def read(path: Path, where: str, length_unit: float | None = None, snapshot="last") -> dict:
    """Arrays of a CSV or NetCDF file, of a run directory's result.nc, or of another program's file.

    where: name of the file in errors. length_unit [m]: unit of x, y, z of a CSV file without units
    in its header. snapshot: number from 0, or "last", of a NetCDF file. For other programs see
    samples.foreign.
    """
    if _is_run(path):
        path = path / "result.nc"
        if not path.exists():
            raise DustError(f"{where}: there is no result.nc in this directory; allowed: a run's.")
    check_kind(path, where)
    if not path.exists():
        raise DustError(
            f"{where}: there is no such file; allowed: a CSV or NetCDF file, one of LAMMPS, YADE "
            "or XYZ, or the directory of another run. Relative paths start at the YAML file."
        )
    head = _first_bytes(path, where)
    if head.startswith((b"\x89HDF", b"CDF")):
        from dusttaichi.samples import netcdf  # takes half a second to import

        return netcdf.read(path, where, snapshot)
    if (of_others := foreign.reader(head)) is not None:
        return of_others(path, where, length_unit, snapshot)
    if snapshot != "last":
        raise DustError(f"{where}: a CSV file has no snapshots; leave sample.snapshot out.")
    return csv_file.read(path, where, length_unit)


def _found(path: Path, info: ValidationInfo) -> Path:
    """The path of a key of the YAML, relative to the `folder` of the context.

    Raises a validation error for an impossible path, or, with `check_files` in the context, if it
    does not exist.
    """
    context = info.context or {}
    path = Path(context.get("folder") or "") / path
    try:
        there = path.exists() or not context.get("check_files")
    except OSError as error:  # such as a path that is too long
        raise needed(f"it cannot be a file: {error.strerror}") from None
    if not there:
        raise needed(f"there is no such file ({path})")
    return path


SampleFile = Annotated[Path, AfterValidator(_found)]


def _is_run(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # such as a name that is too long
        return False


def check_kind(path: Path, where: str) -> None:
    """Raise DustError for directories, devices and pipes, and for files larger than the memory."""
    try:
        refuse_unreadable(path, memory())
    except FileNotFoundError:
        return
    except ValueError as error:
        raise DustError(f"{where}: {error}; allowed: a file that fits into the memory.") from None


def _first_bytes(path: Path, where: str) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(HEAD)
    except OSError as error:
        raise DustError(f"{where}: it cannot be read ({error.strerror}).") from None
