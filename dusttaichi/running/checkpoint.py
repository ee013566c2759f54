"""Checkpoints: states from which a run continues.

A checkpoint is one file: a magic line, the length of a JSON header, the header (names, types and
shapes of the arrays, and `meta`), the raw bytes of the arrays, and the SHA-256 of all that.
An array of equal numbers, as the spins of a sample at rest, is stored as a single number.
(safetensors has neither a checksum nor metadata other than texts.)
"""

import hashlib
import json
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.results.files import explain, remove, replace_atomically
from dusttaichi.results.plain import plain

OLDER = b"dusttaichi checkpoint "
MAGIC = b"dusttaichi checkpoint 5\n"


class Checkpoint(NamedTuple):
    """Result of `load`: the arrays, the metadata, their file, and a note or None."""

    arrays: dict
    meta: dict
    source: Path
    note: str | None


def _append_suffix(path, suffix):
    path = Path(path)
    return path.with_name(path.name + suffix)


def _refuse(value):
    raise TypeError(f"a checkpoint's meta data cannot hold a {type(value).__name__}")


def save(path, arrays, meta):
    """Write `arrays` (name -> array, any shape and plain dtype) and `meta` (for JSON), bitwise.

    The former checkpoint at `path` becomes PATH.previous; after a kill or on a full disk one of
    them is valid. Raises DustError, with the old checkpoints untouched, where the new one cannot be
    written.
    """
    path, temporary = Path(path), _append_suffix(path, ".tmp")
    solid = {name: np.ascontiguousarray(a).reshape(-1) for name, a in arrays.items()}
    solid = {name: a[:1] if _is_uniform(a) else a for name, a in solid.items()}
    listing = [[n, a.dtype.str, list(np.shape(arrays[n])), len(a)] for n, a in solid.items()]
    header = json.dumps({"arrays": listing, "meta": plain(meta)}, default=_refuse).encode()
    try:
        with open(temporary, "wb") as file:
            digest = hashlib.sha256()
            blocks = [MAGIC, len(header).to_bytes(8, "little"), header]
            for block in [*blocks, *(a.view(np.uint8) for a in solid.values())]:
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


def _is_uniform(a):
    """True where all numbers (n,) have the bits of the first; False of fewer than two."""
    if len(a) < 2:
        return False
    rows = a.view(np.uint8).reshape(len(a), -1)
    return bool((rows[: 2**10] == rows[0]).all() and (rows == rows[0]).all())


def _read(path):
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
    for name, dtype, shape, count in header["arrays"]:
        stored = np.frombuffer(raw, dtype, count, end)
        end += stored.nbytes
        uniform = count < np.prod(shape, dtype=np.int64)
        arrays[name] = np.full(shape, stored[0]) if uniform else stored.reshape(shape).copy()
    return arrays, header["meta"]


def load(path):
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


def exists(path):
    """True where there is a checkpoint, valid or not; an incomplete first one does not count."""
    if any(_append_suffix(path, suffix).exists() for suffix in ("", ".previous")):
        return True
    try:
        _read(_append_suffix(path, ".tmp"))
    except (ValueError, OSError):
        return False
    return True


def discard(path):
    """Remove the checkpoint and those beside it, for a new run. Raises DustError."""
    for suffix in ("", ".tmp", ".previous"):
        try:
            _append_suffix(path, suffix).unlink(missing_ok=True)
        except OSError as error:
            raise DustError(
                f"The old checkpoint {path} cannot be removed: {explain(error, path)}."
            ) from error
