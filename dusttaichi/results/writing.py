"""Helpers of the writer: its lock, the pieces of a result, and records that follow others."""

from contextlib import contextmanager

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.files import RunLock
from dusttaichi.results import pieces


@contextmanager
def acquired(path, lock):
    """The lock of the directory of a result; a new one is released after an error."""
    acquired = RunLock(path.parent) if lock is None else lock
    try:
        yield acquired
    except BaseException:
        if lock is None:
            acquired.release()
        raise


def appended(rows, blocks):
    """Two sets of arrays one after the other, each group -> name -> array."""
    appended = {
        group: {name: np.concatenate([rows[group][name], new]) for name, new in block.items()}
        for group, block in blocks.items()
        if group in rows
    }
    return rows | blocks | appended


def readable_pieces(path):
    """The pieces of a result. Raises DustError where they cannot be read."""
    try:
        return pieces.pieces_of(path)
    except (OSError, RuntimeError, KeyError, ValueError, AttributeError) as error:
        raise DustError(
            f"{path} is not a result of dusttaichi that can be read: {error}."
        ) from error


def already_there(path):
    """Message for an existing result."""
    return (
        f"{path} exists already. Use --force to overwrite it, --resume to continue it, or choose "
        "another output directory."
    )
