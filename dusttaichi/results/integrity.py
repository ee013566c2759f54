"""Damage of result files: it is found as a file is opened, before any of its numbers is used.

NetCDF has a checksum of each chunk of numbers (fletcher32), and HDF5 of its headers; a record that
its index has lost is read as FILL, which no run writes. An attribute has the SHA-256 of what has no
checksum: the texts, and the names of the variables.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, NamedTuple, cast

import netCDF4
import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.results import locks
from dusttaichi.results.files import BLOCK, HDF5_ERROR, is_segment
from dusttaichi.results.variables import record_dimension

DIGEST = "digest"  # global attribute
_PREFIX = "SHA-256 of the texts and names: "  # other digests are of older versions
LARGEST = 4e9  # bytes up to which all numbers are read first; above, each chunk as it is used
_BLOCK = 4_000_000  # bytes that are read at a time
_reads_numbers = ContextVar("reads_numbers", default=True)
# errors of HDF5 that are damage unless there is another cause: NC_EHDFERR, NC_ENOTBUILT
_REPORTED = HDF5_ERROR, -128
_SUPERBLOCK = 12  # bytes up to its version (at 8) and its flags of writing (at 11, from version 3)


ENDS = ("grain", "grain_i", "grain_j")  # numbers of grains among the variables of contacts


class DamagedFile(DustError):
    """A file whose structure or checksums have failed."""


class Header(NamedTuple):
    """Global attributes of a result file, and the number of records of its groups that grow."""

    attributes: dict[str, Any]
    records: dict[str, int]


_checked: dict[
    str, tuple[tuple[int, ...], Header]
] = {}  # path -> identity of the verified file, its Header


def _fill(bits: int, dtype: str) -> np.floating:
    unsigned = np.array([bits], dtype.replace("f", "u"))
    value: np.floating = unsigned.view(dtype)[0]
    return value


FILL = {  # value of unwritten records: a NaN that no computation returns
    "f8": _fill(0x7FF8_6475_7374_6669, "f8"),
    "f4": _fill(0x7FC0_6475, "f4"),
}


def check(path: str | Path) -> Header:
    """The Header of a file, which is verified once in a process and again after a change.

    It is not opened a second time, since HDF5 may crash where two handles of a file have texts
    (https://github.com/Unidata/netcdf4-python/issues/1444). Files without DIGEST, of other
    programs, are not verified. Raises as `open_netcdf`.
    """
    real_path, identity = identify(path)
    if real_path not in _checked or _checked[real_path][0] != identity:
        with open_result(path):
            pass
    return _checked[real_path][1]


@contextmanager
def open_result(path: str | Path) -> Iterator[Any]:
    """A verified result file that is open for reading. Raises as `open_netcdf`."""
    real_path, identity = identify(path)
    with open_netcdf(path) as file:
        if real_path not in _checked or _checked[real_path][0] != identity:
            with translate_errors(path):
                _checked[real_path] = identity, _verify(file, path)
        yield file


@contextmanager
def numbers_unread() -> Iterator[None]:
    """Context in which files are opened without reading all their numbers first.

    For who reads every number anyway, by `read_block`.
    """
    token = _reads_numbers.set(False)
    try:
        yield
    finally:
        _reads_numbers.reset(token)


@contextmanager
def open_netcdf(path: str | Path, engine: Callable[[Any], Any] = netCDF4.Dataset) -> Iterator[Any]:
    """A NetCDF file of any program, open for reading with a shared lock, which ends with it.

    engine: function of the path that opens it. Raises OSError, as for a missing file; DustError
    without permission, where another program writes it or the disk has no locks; DamagedFile.
    """
    with ExitStack() as stack:
        with translate_errors(path):
            stack.enter_context(locks.reading(path))
            file = stack.enter_context(engine(path))
        yield file


def reads_numbers() -> bool:
    """False in a context of `numbers_unread`."""
    return _reads_numbers.get()


def identify(path: str | Path) -> tuple[str, tuple[int, ...]]:
    """(path, identity of the file and of its content), keys of `_checked`. Raises OSError."""
    status = os.stat(path)
    return os.path.realpath(path), (
        status.st_dev,
        status.st_ino,
        status.st_size,
        status.st_mtime_ns,
    )


def _is_marked(head: bytes) -> bool:
    """True for the first bytes of a file that HDF5 has marked as being written."""
    is_superblock = head.startswith(b"\x89HDF") and len(head) == _SUPERBLOCK
    return is_superblock and head[8] == 3 and bool(head[11] & 5)


@contextmanager
def translate_errors(path: str | Path) -> Iterator[None]:
    """Context in which a file is opened or read; its errors are those of `open_netcdf`."""
    try:
        yield
    except (OSError, RuntimeError, UnicodeDecodeError, AttributeError) as error:
        reason = refusal(error, path)
        if reason is None:
            raise
        raise reason from error


def refusal(error: BaseException, path: str | Path) -> DustError | None:
    """The DustError of a file that could not be opened or read; None for an unrelated error.

    HDF5 has the same error for damage, a refused lock and a fault of the disk.
    """
    if isinstance(error, PermissionError):
        return DustError(f"{path} cannot be read: there is no permission.")
    if isinstance(error, OSError) and error.errno not in _REPORTED:
        return None
    try:
        with open(path, "rb", buffering=0) as file:
            if locks.are_missed(file.fileno()):
                return DustError(f"{path} cannot be opened: {locks.lockless(Path(path).parent)}.")
            if _is_marked(file.read(_SUPERBLOCK)):
                return DustError(
                    f"{path} is in use: another program has it open for writing, or has ended "
                    "without closing it. Close it there; `h5clear -s FILE` removes a mark that "
                    "remains."
                )
            while file.read(BLOCK):
                pass
    except OSError as fault:
        return DustError(f"{path} cannot be read: {fault.strerror or fault}.")
    return build_damage_error(path)


def _verify(file: Any, path: str | Path) -> Header:
    """The Header of an open file. Raises DustError, or an error of `translate_errors`."""
    header = Header({n: file.getncattr(n) for n in file.ncattrs()}, record_counts(file))
    digest = header.attributes.get(DIGEST)
    if isinstance(digest, str) and digest.startswith(_PREFIX):
        if digest != digest_of(file):
            raise _build_change_error(path)
        if os.stat(path).st_size <= LARGEST and _reads_numbers.get():
            _read_through(file, path)
    return header


def digest_of(file: Any) -> str:
    """Value of DIGEST for an open file."""
    groups = (file, *file.groups.values())
    texts = [[n, v] for n in file.ncattrs() if n != DIGEST and _is_text(v := file.getncattr(n))]
    for group in groups:
        for name, variable in group.variables.items():
            attributes = variable.ncattrs()
            values = [[n, v] for n in attributes if _is_text(v := variable.getncattr(n))]
            entries = variable[:].tolist() if variable.dtype is str else []
            texts.append([f"{group.path}/{name}", *values, *entries])
    return _PREFIX + hashlib.sha256(json.dumps(sorted(texts)).encode()).hexdigest()


def record_counts(file: Any) -> dict[str, int]:
    """Group of an open file -> number of its records, of groups that grow."""
    groups = {"series": file, **file.groups}
    dimensions = {g: folder.dimensions.get(record_dimension(g)) for g, folder in groups.items()}
    return {g: len(dimension) for g, dimension in dimensions.items() if dimension is not None}


def build_damage_error(path: str | Path) -> DamagedFile:
    """The DamagedFile for a path."""
    path, advice = Path(path), "Take it from a backup, or compute it again (--force)"
    if is_segment(path):
        advice += "; without it and the parts after it the earlier records can be read"
    return DamagedFile(f"{path} is damaged: its content is not that which was written. {advice}.")


def check_ends(path: str | Path, name: str, contacts: Mapping[Any, Any], count: int) -> None:
    """Refuse contacts, variables by name, of other grains than 0 to `count` - 1. DamagedFile.

    name: of the contacts, for the message.
    """
    for variable in ENDS:
        ends = np.asarray(contacts[variable] if variable in contacts else [])
        unknown = ends[(ends < 0) | (ends >= count)]
        if len(unknown):
            raise DamagedFile(
                f"{path} is damaged, or of another program: {variable} of the {name} names grain "
                f"{unknown[0]}; allowed: 0 to {count - 1}. Take it from a backup, or compute it "
                "again (--force)."
            )


def _build_change_error(path: str | Path) -> DamagedFile:
    return DamagedFile(
        f"{path} is damaged, or another program has changed it: its texts are not those that were "
        f"written. If you have changed it yourself, remove its attribute {DIGEST}, too; otherwise "
        "take it from a backup, or compute it again (--force)."
    )


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _read_through(file: Any, path: str | Path) -> None:
    """Read all numbers of an open file. Raises RuntimeError, DamagedFile."""
    file.set_auto_maskandscale(False)
    for group in (file, *file.groups.values()):
        for variable in group.variables.values():
            if variable.dtype is str or not variable.size:
                continue
            if not isinstance(variable.chunking(), list):  # a single number, or of an older version
                variable[...]
                continue
            rows = rows_of_block(variable)
            for start in range(0, len(variable), rows):
                read_block(variable, start, start + rows, path)


def rows_of_block(variable: Any) -> int:
    """Records of a variable with chunks that are read at a time, a multiple of those of a chunk."""
    row = int(variable.dtype.itemsize * variable.size // len(variable))
    rows = int(variable.chunking()[0])
    return max(_BLOCK // row // rows, 1) * rows


def read_block(variable: Any, start: int, end: int, path: str | Path) -> NDArray[Any]:
    """Records `start` to before `end` of a variable with chunks; `start` is the first of a chunk.

    path: of its file. Raises RuntimeError, DamagedFile.
    """
    values: NDArray[Any] = variable[start:end]
    corners = tuple(slice(None, None, chunk) for chunk in variable.chunking())
    if _is_fill(values[corners], variable.dtype).any():
        raise build_damage_error(path)
    return values


def _is_fill(values: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[np.bool_]:
    """Mask of the unwritten records of a type."""
    if (fill := FILL.get(dtype.str[1:])) is not None:
        bits = f"u{dtype.itemsize}"
        is_fill = np.ascontiguousarray(values).view(bits) == fill.view(bits)
    else:
        is_fill = values == netCDF4.default_fillvals[dtype.str[1:]]
    return cast("NDArray[np.bool_]", is_fill)
