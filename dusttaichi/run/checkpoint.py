"""Checkpoints: what a run goes on from.

A checkpoint is one file: a magic line, the length of a JSON header, the header (names, types and
shapes of the arrays, and `meta`), the raw bytes of the arrays, and the SHA-256 of all that. (Of
this, safetensors has neither the sum nor meta data other than texts.)
"""

import hashlib
import json
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.files import explain, remove, replace_atomically
from dusttaichi.results.provenance import plain

OLDER = b"dusttaichi checkpoint "
MAGIC = b"dusttaichi checkpoint 3\n"


class Checkpoint(NamedTuple):
    """Result of `load`: the arrays, the meta data, the file they are from, and a note or None."""

    arrays: dict
    meta: dict
    source: Path
    note: str | None


def _beside(path, suffix):
    path = Path(path)
    return path.with_name(path.name + suffix)


def _refuse(value):
    raise TypeError(f"a checkpoint's meta data cannot hold a {type(value).__name__}")


def save(path, arrays, meta):
    """Write `arrays` (name -> array, any shape and plain dtype) and `meta` (what JSON can hold).

    Bits are kept exactly. The checkpoint at `path` before this one is kept as PATH.previous; a
    kill or a full disk at any moment leaves one of them whole. Raises DustError, with the old
    checkpoints untouched, where the new one cannot be written.
    """
    path, temporary = Path(path), _beside(path, ".tmp")
    solid = {name: np.ascontiguousarray(a).reshape(np.shape(a)) for name, a in arrays.items()}
    listing = [[name, a.dtype.str, list(a.shape)] for name, a in solid.items()]
    header = json.dumps({"arrays": listing, "meta": plain(meta)}, default=_refuse).encode()
    try:
        with open(temporary, "wb") as file:
            digest = hashlib.sha256()
            blocks = [MAGIC, len(header).to_bytes(8, "little"), header]
            for block in [*blocks, *(a.reshape(-1).view(np.uint8) for a in solid.values())]:
                file.write(block)
                digest.update(block)
            file.write(digest.digest())
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            os.replace(path, _beside(path, ".previous"))
        replace_atomically(temporary, path)
    except OSError as error:
        reason = explain(error, path)
        remove(temporary)
        raise DustError(
            f"The checkpoint {path} could not be written: {reason}. The one before it is kept."
        ) from error


def _read(path):
    """Arrays and meta of one file. ValueError where it is damaged, OSError where it is not."""
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
    for name, dtype, shape in header["arrays"]:
        count = int(np.prod(shape, dtype=np.int64))
        arrays[name] = np.frombuffer(raw, dtype, count, end).reshape(shape).copy()
        end += arrays[name].nbytes
    return arrays, header["meta"]


def load(path):
    """The checkpoint at `path`, or the newest whole one beside it. Returns a Checkpoint.

    Its `note` is a sentence for the user where `path` itself could not be used, else None.
    Raises DustError where there is none, or none that is whole.
    """
    path = Path(path)
    problem = None
    # .tmp is whole and the newest where a kill fell between the two renames of `save`
    for candidate in (path, _beside(path, ".tmp"), _beside(path, ".previous")):
        try:
            arrays, meta = _read(candidate)
        except FileNotFoundError:
            continue
        except (ValueError, OSError) as error:
            problem = problem or f"{candidate.name} cannot be used ({error})"
            continue
        note = None
        if candidate != path:
            note = f"{problem or f'{path.name} is missing'}; going on from {candidate.name}."
        return Checkpoint(arrays, meta, candidate, note)
    if problem is None:
        raise DustError(f"There is no checkpoint at {path}: nothing to resume from.")
    raise DustError(f"No whole checkpoint in {path.parent}: {problem}. Start the run anew.")


def exists(path):
    """True where there is a checkpoint, whole or not; a first one that has been begun is none."""
    if any(_beside(path, suffix).exists() for suffix in ("", ".previous")):
        return True
    try:
        _read(_beside(path, ".tmp"))
    except (ValueError, OSError):
        return False
    return True


def discard(path):
    """Remove the checkpoint and those kept beside it (a run that starts anew). Raises DustError."""
    for suffix in ("", ".tmp", ".previous"):
        try:
            _beside(path, suffix).unlink(missing_ok=True)
        except OSError as error:
            raise DustError(
                f"The old checkpoint {path} cannot be removed: {explain(error, path)}."
            ) from error
