"""The lock of a run directory."""

import os
import socket
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path

from dusttaichi.errors import DustError
from dusttaichi.results import locks
from dusttaichi.results.files import explain, remove


class RunLock(AbstractContextManager["RunLock"]):
    """Lock of a run directory against a second process; the system releases it with its process.

    `RunLock(directory)` takes it at once, makes the directory if it is missing, and raises
    DustError if another run has it or the directory is not writable. A context manager. The package
    filelock cannot identify the owner of a lock (in releases for Python 3.10 a second process
    empties the file), and fails on network file systems without locks.
    """

    def __init__(self, directory: str | Path) -> None:
        self.path = Path(directory) / ".lock"
        self._descriptor: int | None = None
        self._folder: int | None = None
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._descriptor = self._take()
            self._folder = self._take_folder(self._descriptor)
            os.ftruncate(self._descriptor, 0)
            os.pwrite(self._descriptor, f"{os.getpid()} on {socket.gethostname()}\n".encode(), 0)
        except OSError as error:
            self.release()
            raise DustError(
                f"Cannot write in {self.path.parent}: {explain(error, self.path)}."
            ) from error

    def _take_folder(self, descriptor: int) -> int | None:
        """Lock the folder as well, in case that the lock file is deleted; None if impossible."""
        if os.name != "posix":
            return None
        folder, is_locked = os.open(self.path.parent, os.O_RDONLY), None
        with suppress(OSError):
            is_locked = locks.take(folder)
        if is_locked:
            return folder
        os.close(folder)
        if is_locked is None:  # network file systems lock no folders
            return None
        refusal = self._refusal(descriptor)
        remove(self.path)  # it is this one's: the owner's was deleted
        os.close(descriptor)
        raise refusal

    def _take(self) -> int:
        while True:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                self._lock(descriptor)
                same = os.fstat(descriptor).st_ino == os.stat(self.path).st_ino
            except FileNotFoundError:
                same = False
            except BaseException:
                os.close(descriptor)
                raise
            if same:
                return descriptor
            os.close(descriptor)  # its owner removed the file in between: take the new one

    def _lock(self, descriptor: int) -> None:
        is_locked = locks.take(descriptor)
        # a network file system may have no locks
        lockless = is_locked is None and os.name == "posix"
        if is_locked is False or (lockless and self._owner_lives(descriptor)):
            raise self._refusal(descriptor)

    def _refusal(self, descriptor: int) -> DustError:
        owner = os.pread(descriptor, 200, 0).decode(errors="replace").strip()
        return DustError(
            f"Another run is writing into {self.path.parent} (process {owner or 'unknown'}). "
            "Wait for it, stop it, or choose another output directory."
        )

    @staticmethod
    def _owner_lives(descriptor: int) -> bool:
        number, _, host = os.pread(descriptor, 200, 0).decode(errors="replace").partition(" on ")
        if not number.isdigit():
            return False
        if host.strip() != socket.gethostname():
            return True  # unknown from here: refuse rather than corrupt a result
        try:
            os.kill(int(number), 0)
        except ProcessLookupError:
            return False
        except PermissionError:
            return True
        return int(number) != os.getpid()

    @property
    def descriptors(self) -> list[int]:
        """The open lock file and folder, for a process that inherits the lock."""
        return [n for n in (self._descriptor, self._folder) if n is not None]

    def release(self) -> None:
        """Release the lock and remove its file. May be called again."""
        if self._descriptor is None:
            return
        remove(self.path)
        for descriptor in self.descriptors:
            os.close(descriptor)
        self._descriptor = self._folder = None

    def __exit__(self, *_: object) -> None:
        self.release()


@contextmanager
def acquire_lock(path: Path, lock: RunLock | None) -> Iterator[RunLock]:
    """The lock of the directory of a result; a new one is released after an error."""
    acquired = RunLock(path.parent) if lock is None else lock
    try:
        yield acquired
    except BaseException:
        if lock is None:
            acquired.release()
        raise
