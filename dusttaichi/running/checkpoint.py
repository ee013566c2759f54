"""Checkpoints: states from which a run continues.

A checkpoint is one file: a magic line, the length of a JSON header, the header (names, types and
shapes of the arrays, and `meta`), the raw bytes of the arrays, and the SHA-256 of all that.
An array of mostly equal numbers, as the spins of a sample at rest, is stored as that number, with
the places and values of the others.
(safetensors has neither a checksum nor metadata other than texts.)
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.results.files import explain, remove, replace_atomically
from dusttaichi.results.plain import plain

OLDER = b"dusttaichi checkpoint "
MAGIC = b"dusttaichi checkpoint 7\n"
ALL = -1  # exceptions of an array whose numbers are all stored
FEW = 0.125  # largest share of exceptions
PROBES = 1024  # numbers of an array that are compared first


class Checkpoint(NamedTuple):
    """Result of `load`: the arrays, the metadata, their file, and a note or None."""

    arrays: dict[str, NDArray[Any]]
    meta: dict[str, Any]
    source: Path
    note: str | None


def _append_suffix(path: str | Path, suffix: str) -> Path:
    path = Path(path)
    return path.with_name(path.name + suffix)


def _refuse(value: Any) -> None:
    raise TypeError(f"a checkpoint's meta data cannot hold a {type(value).__name__}")


def save(path: str | Path, arrays: Mapping[str, NDArray[Any]], meta: Mapping[str, Any]) -> None:
    """Write `arrays` (name -> array, any shape and plain dtype) and `meta` (for JSON), bitwise.

    The former checkpoint at `path` becomes PATH.previous; after a kill or on a full disk one of
    them is valid. Raises DustError, with the old checkpoints untouched, where the new one cannot be
    written.
    """
    path, temporary = Path(path), _append_suffix(path, ".tmp")
    stored = {name: _compact(np.ascontiguousarray(a).reshape(-1)) for name, a in arrays.items()}
    listing = [
        [name, blocks[0].dtype.str, list(np.shape(arrays[name])), exceptions]
        for name, (exceptions, blocks) in stored.items()
    ]
    header = json.dumps({"arrays": listing, "meta": plain(meta)}, default=_refuse).encode()
    try:
        with open(temporary, "wb") as file:
            digest = hashlib.sha256()
            blocks: list[Any] = [MAGIC, len(header).to_bytes(8, "little"), header]
            for _, arrays_of_name in stored.values():
                blocks += [a.view(np.uint8) for a in arrays_of_name]
            for block in blocks:
                file.write(block)
                digest.update(block)
            file.write(digest.digest())
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            os.replace(path, _append_suffix(path, ".previous"))
        replace_atomically(temporary, path)
    except OSError as error:
        reason = explain(error, path)
        remove(temporary)
        raise DustError(
            f"The checkpoint {path} could not be written: {reason}. The former one remains."
        ) from error


def _compact(a: NDArray[Any]) -> tuple[int, list[NDArray[Any]]]:
    """(number of exceptions or ALL, the arrays that store the numbers (n,), bitwise).

    Those are `a` itself, or its most frequent number, the places of the others and these.
    """
    if len(a) < 2 or a.itemsize not in (1, 2, 4, 8):
        return ALL, [a]
    bits = a.view(f"u{a.itemsize}")
    values, counts = np.unique(bits[:: -(-len(a) // PROBES)], return_counts=True)
    if counts.max() < (1.0 - FEW) * counts.sum():
        return ALL, [a]
    commonest = values[[counts.argmax()]]
    exceptional = np.flatnonzero(bits != commonest)
    if len(exceptional) > FEW * len(a):
        return ALL, [a]
    return len(exceptional), [commonest.view(a.dtype), exceptional.astype(np.int64), a[exceptional]]


def _restore(
    raw: bytes, start: int, dtype: str, shape: list[int], exceptions: int
) -> tuple[NDArray[Any], int]:
    """(an array that `_compact` has stored in bytes from `start` on, the end of these)."""
    if exceptions == ALL:
        stored = np.frombuffer(raw, dtype, np.prod(shape, dtype=np.int64), start)
        return stored.reshape(shape).copy(), start + stored.nbytes
    commonest = np.frombuffer(raw, dtype, 1, start)
    exceptional = np.frombuffer(raw, np.int64, exceptions, start := start + commonest.nbytes)
    values = np.frombuffer(raw, dtype, exceptions, start := start + exceptional.nbytes)
    array = np.full(shape, commonest[0])
    array.reshape(-1)[exceptional] = values
    return array, start + values.nbytes


def _read(path: str | Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Arrays and meta of one file. Raises ValueError if damaged, OSError if unreadable."""
    raw = Path(path).read_bytes()
    body, digest = memoryview(raw)[:-32], raw[-32:]
    if raw.startswith(OLDER) and not raw.startswith(MAGIC):
        raise ValueError("of another version of dusttaichi")
    if not raw.startswith(MAGIC) or hashlib.sha256(body).digest() != digest:
        raise ValueError("damaged, or not a checkpoint")
    start = len(MAGIC) + 8
    end = start + int.from_bytes(raw[len(MAGIC) : start], "little")
    header = json.loads(raw[start:end])
    arrays = {}
    for name, *entry in header["arrays"]:
        arrays[name], end = _restore(raw, end, *entry)
    return arrays, header["meta"]


def load(path: str | Path) -> Checkpoint:
    """The Checkpoint at `path`, or the newest valid one beside it.

    Its `note` is a message for the user if `path` itself could not be used. Raises DustError
    without a valid one, and where the system refuses the newest, which may be valid.
    """
    path = Path(path)
    problem = None
    # .tmp is valid and the newest after a kill between the two renames of `save`
    for candidate in (path, _append_suffix(path, ".tmp"), _append_suffix(path, ".previous")):
        try:
            arrays, meta = _read(candidate)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise DustError(f"{candidate} cannot be read: {error.strerror or error}.") from error
        except ValueError as error:
            problem = problem or f"{candidate.name} cannot be used ({error})"
            continue
        note = None
        if candidate != path:
            note = f"{problem or f'{path.name} is missing'}; continuing from {candidate.name}."
        return Checkpoint(arrays, meta, candidate, note)
    if problem is None:
        raise DustError(f"There is no checkpoint at {path}: nothing to resume from.")
    raise DustError(f"No valid checkpoint in {path.parent}: {problem}. Start the run again.")


def exists(path: str | Path) -> bool:
    """True where there is a checkpoint, valid or not; an incomplete first one does not count."""
    if any(_append_suffix(path, suffix).exists() for suffix in ("", ".previous")):
        return True
    try:
        _read(_append_suffix(path, ".tmp"))
    except (ValueError, OSError):
        return False
    return True


def discard(path: str | Path) -> None:
    """Remove the checkpoint and those beside it, for a new run. Raises DustError."""
    for suffix in ("", ".tmp", ".previous"):
        try:
            _append_suffix(path, suffix).unlink(missing_ok=True)
        except OSError as error:
            raise DustError(
                f"The old checkpoint {path} cannot be removed: {explain(error, path)}."
            ) from error
