"""Locks of files by the system (flock), as HDF5 takes them, and disks that have none.

HDF5 refuses a file that it cannot lock with the error of a damaged one, and a new file with that of
a missing permission. Result files are replaced as a whole and never written in place, so that
nothing is lost without its locks: a file is locked here while it is read, as far as the disk can.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dusttaichi.compute.processes import HDF5_LOCKS
from dusttaichi.errors import DustError

try:
    import fcntl
except ImportError:  # not a POSIX system: there are no such locks
    fcntl = None  # type: ignore[assignment]  # a module elsewhere

_LOCKED = errno.EAGAIN, errno.EACCES
_LOCKLESS = errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOSYS


def take(descriptor: int, *, shared: bool = False) -> bool | None:
    """Lock an open file or folder without waiting.

    Returns True, False where another process has a lock, or None where the disk has none. Raises
    OSError.
    """
    if fcntl is None:
        return None
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _LOCKED:
            return False
        if error.errno in _LOCKLESS:
            return None
        raise
    return True


@contextmanager
def reading(path: str | Path) -> Iterator[None]:
    """Context with a shared lock of a file, as far as its disk has locks.

    Raises OSError where it cannot be opened; DustError where another program writes it.
    """
    if fcntl is None:
        yield
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        if take(descriptor, shared=True) is False:
            raise DustError(
                f"{path} is in use: another program (such as HDFView or a Python session) has it "
                "open for writing. Close it there, and try again."
            )
        yield
    finally:
        os.close(descriptor)


def are_missed(descriptor: int) -> bool:
    """True where HDF5 refuses an open file because its disk has no locks. Raises OSError."""
    if fcntl is None or os.environ.get(HDF5_LOCKS, "").upper() in ("FALSE", "0"):
        return False
    return take(descriptor, shared=True) is None


def lockless(folder: str | Path) -> str:
    """The clause that a disk has no locks, and what helps."""
    return (
        f"the disk of {folder} has no file locks. Set the environment variable {HDF5_LOCKS}=FALSE "
        "before Python starts; nothing is lost by it"
    )
