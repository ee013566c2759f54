"""Files of samples, read as dicts of arrays in SI (position, velocity, spin, contacts)."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, ValidationInfo

from dusttaichi.errors import DustError
from dusttaichi.samples import formats
from dusttaichi.samples.formats.text import Source
from dusttaichi.samples.sample import memory
from dusttaichi.scene.fields import build_value_error, refuse_unreadable
from dusttaichi.scene.paths import path_in


def read(path: Path, source: Source) -> dict[str, Any]:
    """Read the arrays of a NetCDF file, a run directory's result.nc, or another program's file.

    source: a Source without lines: the name of the file in errors, and the keys of the sample that
    say how it is read. For text files see samples.formats, for NetCDF samples.netcdf. Raises
    DustError for a file that cannot be used.
    """
    try:
        return _read(path, source)
    except MemoryError:
        raise DustError(
            f"{source.name}: it does not fit into the memory that this process may use. Use a "
            "smaller file, or raise the limit of memory (ulimit -v, or that of a queue)."
        ) from None


def _read(path: Path, source: Source) -> dict[str, Any]:
    origin = source.name
    if path.is_dir():
        path = path / "result.nc"
        if not path.exists():
            raise DustError(
                f"{origin}: there is no result.nc in this directory; allowed: that of a run, or in "
                "a scene with replicas that of a run with as many."
            )
    check_kind(path, origin)
    if not path.exists():
        raise DustError(
            f"{origin}: there is no such file; allowed: a list of {source.contents.noun}, CSV or "
            "NetCDF, one of LAMMPS, YADE, MercuryDPM or XYZ, or the directory of another run. "
            "Relative paths "
            "start at the YAML file."
        )
    try:
        with path.open("rb") as file:
            head = file.read(8)
    except OSError as error:
        raise DustError(f"{origin}: it cannot be read ({error.strerror}).") from None
    if not head.startswith(formats.NETCDF):
        return formats.read(path, source)
    for key in ("columns", "style"):
        if getattr(source, key) is not None:
            raise DustError(f"sample.{key}: {origin} is NetCDF, which names its variables; leave "
                            "the key out.")  # fmt: skip
    from dusttaichi.samples import netcdf  # takes half a second to import

    return netcdf.read(path, source)


def remarks_on_reading(state: dict[str, Any], file: Any, unread: str | None = None) -> list[str]:
    """Sentences for the user on how a file was read, and on what is not read.

    unread: instead of the columns, sections and the cell that `unread_of` lists.
    """
    remarks = [f"sample: {file}: {text}" for text in state.get("remarks", ())]
    unread = unread_of(state) if unread is None else unread
    return [*remarks, *([f"sample: not read from {file}: {unread}"] if unread else [])]


def unread_of(state: dict[str, Any]) -> str:
    """Columns, sections and the cell of a file that are not read, or ""."""
    return "; ".join(filter(None, (", ".join(state.get("unread", ())), state.get("no_cell"))))


def _find_file(path: Path, info: ValidationInfo) -> Path:
    """Find the file of a key of the YAML, relative to the `folder` of the context.

    Raises a validation error for an impossible path, or, with `check_files` in the context, if it
    does not exist.
    """
    context = info.context or {}
    path = path_in(context.get("folder"), path)
    try:
        exists = path.exists() or not context.get("check_files")
    except OSError as error:  # such as a path that is too long
        raise build_value_error(f"it cannot be a file: {error.strerror}") from None
    if not exists:
        raise build_value_error(f"there is no such file ({path})")
    return path


SampleFile = Annotated[Path, AfterValidator(_find_file)]


def check_kind(path: Path, origin: str) -> None:
    """Raise DustError for directories, devices and pipes, and for files larger than the memory."""
    try:
        refuse_unreadable(path, memory())
    except FileNotFoundError:
        return
    except ValueError as error:
        raise DustError(f"{origin}: {error}; allowed: a file that fits into the memory.") from None
