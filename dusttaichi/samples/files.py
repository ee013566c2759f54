"""Grains from the file of a sample: a dict of arrays in SI (position, velocity, spin, contacts)."""

from __future__ import annotations

from pathlib import Path

from dusttaichi.errors import DustError
from dusttaichi.files import refuse_unreadable
from dusttaichi.samples import csv_file, foreign
from dusttaichi.samples.limits import memory
from dusttaichi.scene.fields import needed

HEAD = 4096  # bytes of a file that tell what it is


def read(path: Path, where: str, length_unit: float | None = None, snapshot="last") -> dict:
    """Arrays of a CSV file, a NetCDF file, a run directory's result.nc, or a file of another
    program (samples.foreign).

    where: how errors name the file. length_unit [m]: what x, y, z of a CSV file count in where
    their headings do not say. snapshot: number from 0, or "last", of a NetCDF file.
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
        from dusttaichi.samples import netcdf  # half a second, which only such a file is worth

        return netcdf.read(path, where, snapshot)
    if (of_others := foreign.reader(head)) is not None:
        return of_others(path, where, length_unit, snapshot)
    if snapshot != "last":
        raise DustError(f"{where}: a CSV file has no snapshots; leave sample.snapshot out.")
    return csv_file.read(path, where, length_unit)


def found(path: Path, check: bool) -> Path:
    """The path of a key of the YAML; pydantic's error where it cannot be one, or, with `check`,
    where nothing is there."""
    try:
        there = path.exists() or not check
    except OSError as error:  # such as a path that is too long
        raise needed(f"it cannot be a file: {error.strerror}") from None
    if not there:
        raise needed(f"there is no such file ({path})")
    return path


def _is_run(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # such as a name that is too long
        return False


def check_kind(path: Path, where: str) -> None:
    """Refuse what is no file with an end, and what is larger than the memory."""
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
