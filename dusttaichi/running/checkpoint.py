"""Checkpoints: states from which a run continues.

A checkpoint is a file of arrays (results/stored_arrays.py) with meta data.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.results import stored_arrays
from dusttaichi.results.files import (
    PREVIOUS,
    explain,
    has_checkpoint,
    remove,
    replace_atomically,
    write_blocks,
)

OLDER = b"dusttaichi checkpoint "
MAGIC = b"dusttaichi checkpoint 8\n"
NEW = ".new"  # suffix of a checkpoint that is not valid yet
BESIDE = "", ".tmp", PREVIOUS  # suffixes of valid ones, the newest first


class Checkpoint(NamedTuple):
    """Result of `load`: the arrays, the metadata, their file, and a note or None."""

    arrays: dict[str, NDArray[Any]]
    meta: dict[str, Any]
    source: Path
    note: str | None


def _append_suffix(path: str | Path, suffix: str) -> Path:
    path = Path(path)
    return path.with_name(path.name + suffix)


def save(path: str | Path, arrays: Mapping[str, NDArray[Any]], meta: Mapping[str, Any]) -> None:
    """`write` and `publish` a checkpoint. Raises DustError."""
    write(path, arrays, meta)
    publish(path)


def write(path: str | Path, arrays: Mapping[str, NDArray[Any]], meta: Mapping[str, Any]) -> int:
    """Write a checkpoint beside `path`, which `publish` makes valid.

    Parameters
    ----------
    path
        Path of the checkpoint.
    arrays
        Name -> array, of any shape and plain type; stored bitwise, and read one after another.
    meta
        Meta data for JSON.

    Returns
    -------
    int
        Its bytes.

    Raises
    ------
    DustError
        It cannot be written; the former checkpoint is untouched.
    """
    new, text = _append_suffix(path, NEW), stored_arrays.encode(meta)
    try:
        write_blocks(new, stored_arrays.yield_blocks(MAGIC, arrays.items(), text, compact=True))
        return new.stat().st_size
    except OSError as error:
        raise _build_error(path, error) from error


def publish(path: str | Path) -> None:
    """Make the checkpoint that `write` has written that at `path`.

    The former one becomes PATH.previous; after a kill or on a full disk one of them is valid.
    Raises DustError, with the old checkpoints untouched.
    """
    new, temporary = _append_suffix(path, NEW), _append_suffix(path, ".tmp")
    try:
        replace_atomically(new, temporary)
        if os.path.exists(path):
            os.replace(path, _append_suffix(path, PREVIOUS))
        replace_atomically(temporary, path)
    except OSError as error:
        raise _build_error(path, error) from error


def forget(path: str | Path) -> None:
    """Remove a checkpoint that was written and not published, if any."""
    remove(_append_suffix(path, NEW))


def _build_error(path: str | Path, error: OSError) -> DustError:
    """The DustError of a checkpoint that could not be written; what is there of it is removed."""
    reason = explain(error, path)
    forget(path)
    remainder = "The former one remains"
    if not has_checkpoint(path):
        remainder = "There is none yet: --resume would start the run from the beginning"
    return DustError(f"The checkpoint {path} could not be written: {reason}. {remainder}.")


def _read(path: str | Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Arrays and meta of one file. Raises ValueError if damaged, OSError if unreadable."""
    with open(path, "rb") as file:
        head = file.read(len(MAGIC))
    if head.startswith(OLDER) and head != MAGIC:
        raise ValueError("of another version of dusttaichi")
    try:
        with stored_arrays.open_arrays(path, MAGIC) as (file, listing, meta):
            return {a.name: stored_arrays.read_array(file, a) for a in listing}, meta
    except ValueError as error:
        raise ValueError("damaged, or not a checkpoint") from error


def load(path: str | Path) -> Checkpoint:
    """The Checkpoint at `path`, or the newest valid one beside it.

    Its `note` is a message for the user if `path` itself could not be used. Raises DustError
    without a valid one, and where the system refuses the newest, which may be valid.
    """
    path = Path(path)
    problem = None
    # .tmp is valid and the newest after a kill between the two renames of `save`
    for candidate in (_append_suffix(path, suffix) for suffix in BESIDE):
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
    if has_checkpoint(path):
        return True
    try:
        _read(_append_suffix(path, ".tmp"))
    except (ValueError, OSError):
        return False
    return True


def discard(path: str | Path) -> None:
    """Remove the checkpoint and those beside it, for a new run. Raises DustError."""
    for suffix in (*BESIDE, NEW):
        try:
            _append_suffix(path, suffix).unlink(missing_ok=True)
        except OSError as error:
            raise DustError(
                f"The old checkpoint {path} cannot be removed: {explain(error, path)}."
            ) from error
