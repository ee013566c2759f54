"""Files that are complete at any time: atomic replacement, disk space, meaning of errors."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, suppress
from functools import lru_cache
from pathlib import Path

from dusttaichi.results import locks

MEMORY = Path("/dev/shm")  # folder of files in memory, if the system has one
WORK = "dusttaichi-"  # prefix of their names
BLOCK = 1 << 20  # bytes that are read at a time
FORGOTTEN = 3600.0  # age [s] of such a file from which its process was killed
HDF5_ERROR = -101  # number of the errors of HDF5 in those of NetCDF, also of a refused lock
RESULT, CHECKPOINT = "result.nc", "checkpoint.bin"  # the files of a run directory
PREVIOUS = ".previous"  # suffix of the former checkpoint


def parts_folder(result: str | Path) -> Path:
    """Folder of the files that continue a result during its run (results/pieces.py)."""
    return Path(result).with_suffix(".parts")


def piece_path(result: Path, number: int) -> Path:
    """Path of a file of a result; 0 is the result itself."""
    return parts_folder(result) / f"{number:06}.bin" if number else result


def is_segment(path: Path) -> bool:
    """True for the path of a file that continues a result."""
    return path.parent.suffix == ".parts"


def list_segments(result: str | Path) -> list[Path]:
    """The files that continue a result, in order."""
    return sorted(parts_folder(result).glob("[0-9]*.bin"))


def run_files(directory: str | Path) -> list[str]:
    """Relative paths of the existing files from which a run continues."""
    directory = Path(directory)
    segments = [str(path.relative_to(directory)) for path in list_segments(directory / RESULT)]
    names = [RESULT, CHECKPOINT, *segments]
    return [name for name in names if (directory / name).exists()]


def has_checkpoint(path: str | Path) -> bool:
    """True where there is a checkpoint at a path, valid or not, or the former one beside it."""
    return any(Path(f"{path}{suffix}").exists() for suffix in ("", PREVIOUS))


def advise_resuming(result: str | Path) -> str:
    """Clause on --resume, by the checkpoints beside a result."""
    if has_checkpoint(Path(result).with_name(CHECKPOINT)):
        return "continue with --resume"
    return "start again with --resume, from the beginning: there is no checkpoint yet"


def explain(error: BaseException, path: str | Path) -> str:
    """Meaning of an `error` of the operating system (or HDF5) on `path`, as a clause."""
    code = getattr(error, "errno", None)
    folder = Path(path).parent
    if code == errno.EROFS:
        return f"the disk of {folder} is read-only"
    if code == errno.ENAMETOOLONG:
        return "the name is too long for this system"
    refused = code in (errno.EACCES, errno.EPERM)
    if not os.path.isdir(folder):
        return f"there is no permission to write in {folder}" if refused else no_folder(folder)
    if (refused or code == HDF5_ERROR) and (fault := _fault_of_folder(folder)):
        return fault
    if refused:
        return f"there is no permission to replace {Path(path).name} in {folder}"
    if code == errno.EFBIG:
        return "the file would be larger than this system allows"
    free = shutil.disk_usage(folder).free
    if code in (errno.ENOSPC, errno.EDQUOT) or free < 1_000_000:
        return f"the disk is full ({free / 1e6:.1f} MB free, or a quota is reached)"
    return str(error)


def no_folder(path: Path) -> str:
    """Clause that says why there is no folder at a path, or why there can be none."""
    for ancestor in (path, *path.parents):
        if os.path.isdir(ancestor):
            break
        if os.path.islink(ancestor) and not os.path.exists(ancestor):
            return f"{ancestor} is a link to {os.readlink(ancestor)}, which does not exist"
        if os.path.exists(ancestor):
            named = "file" if os.path.isfile(ancestor) else "device or a pipe"
            return f"{ancestor} is a {named}, not a folder; choose another folder"
    return f"the folder {path} does not exist (any more)"


def _fault_of_folder(folder: str | Path) -> str:
    """Reason why a new file cannot be written in a folder, and locked there; "" if it can.

    HDF5 reports a refused lock as a missing permission.
    """
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            lockless = locks.are_missed(file.fileno())
    except PermissionError:
        return f"there is no permission to write in {folder}"
    except OSError:
        return ""
    return locks.lockless(folder) if lockless else ""


def replace_atomically(temporary: str | Path, path: str | Path) -> None:
    """Move `temporary` to `path` such that `path` is complete at any time, also after a power cut.

    Raises OSError.
    """
    descriptor = os.open(temporary, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    os.replace(temporary, path)
    _sync_folder(Path(path).parent)


def _sync_folder(folder: str | Path) -> None:
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some file systems cannot
            raise
    finally:
        os.close(descriptor)


def remove(path: str | Path) -> None:
    """Remove a file if possible, which it is not on a disk that became read-only."""
    with suppress(OSError):
        Path(path).unlink()


def temporary_path(path: str | Path) -> Path:
    """Path of a file that is to replace that at `path`."""
    path = Path(path)
    return path.with_name(f".{path.name}.tmp")


def write_whole(path: str | Path, data: bytes | Iterable[bytes | memoryview]) -> None:
    """Replace the file at `path` by these bytes, such that it is complete at any time.

    data: bytes, or an iterable of blocks. Raises OSError; the file is then unchanged.
    """
    path, temporary = Path(path), temporary_path(path)
    try:
        write_blocks(temporary, (data,) if isinstance(data, bytes) else data)
        replace_atomically(temporary, path)
    except BaseException:
        remove(temporary)
        raise


def write_blocks(path: str | Path, blocks: Iterable[bytes | memoryview]) -> None:
    """Write blocks of bytes into a new file. Raises OSError."""
    with open(path, "wb", buffering=0) as file:
        for block in blocks:
            view = memoryview(block)
            while view:
                view = view[file.write(view) :]
            del block, view  # its array may be freed before the next one is made


class WorkFile(AbstractContextManager["WorkFile"]):
    """A temporary file for a library that does not recover from failed writes (HDF5).

    It is in memory (MEMORY) if there is enough, otherwise on disk, beside the file at
    `result_path`, with reserved space. size: largest, in bytes. A context manager, which removes
    the file. Raises OSError if there is not enough space.
    """

    def __init__(self, result_path: str | Path, size: int) -> None:
        self._hidden = False
        if _free(MEMORY) > 2 * size:
            _remove_forgotten()
            self._descriptor, name = tempfile.mkstemp(prefix=WORK, dir=MEMORY)
            self.path = Path(name)
        else:
            self.path = Path(result_path).with_name(f".{Path(result_path).name}.work")
            flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC
            self._descriptor = os.open(self.path, flags, 0o666)
            try:
                reserve(self.path, size)
            except OSError:
                self.__exit__()
                raise

    def hide(self) -> None:
        """Remove the name of the file, which the library has opened, so that it cannot remain."""
        if os.name == "posix":
            self.path.unlink()
            self._hidden = True

    def blocks(self) -> Iterator[memoryview]:
        """Blocks of bytes of the file after the library has closed it; each overwrites the last."""
        buffer = memoryview(bytearray(BLOCK))
        with open(self._descriptor, "rb", buffering=0, closefd=False) as file:
            file.seek(0)
            while count := file.readinto(buffer):
                yield buffer[:count]

    def __exit__(self, *_: object) -> None:
        os.close(self._descriptor)
        if not self._hidden:
            remove(self.path)


@lru_cache(maxsize=1)
def _remove_forgotten() -> None:
    """Remove work files of processes that were killed before `hide`."""
    for path in MEMORY.glob(f"{WORK}*"):
        with suppress(OSError):
            status = path.stat()
            if status.st_uid == os.getuid() and time.time() - status.st_mtime > FORGOTTEN:
                path.unlink()


def _free(folder: str | Path) -> int:
    """Free bytes on the disk of a folder; 0 if it is not writable."""
    if not os.access(folder, os.W_OK):
        return 0
    return shutil.disk_usage(folder).free


def clone(source: str | Path, target: str | Path) -> None:
    """Copy a file, sharing its blocks where the file system can. Raises OSError."""
    if hasattr(os, "copy_file_range"):
        try:
            with open(source, "rb") as source_file, open(target, "wb") as target_file:
                remaining = os.fstat(source_file.fileno()).st_size
                while remaining > 0:
                    copied = os.copy_file_range(
                        source_file.fileno(), target_file.fileno(), remaining
                    )
                    if copied == 0:
                        break
                    remaining -= copied
            if remaining == 0:
                return
        except OSError as error:
            if error.errno not in (errno.EXDEV, errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP):
                raise
    shutil.copyfile(source, target)


def reserve(path: str | Path, size: int) -> None:
    """Reserve `size` bytes after the end of the file. Raises OSError if the disk is full.

    HDF5 does not recover from failed writes.
    """
    if hasattr(os, "posix_fallocate"):
        descriptor = os.open(path, os.O_RDWR)
        try:
            os.posix_fallocate(descriptor, os.fstat(descriptor).st_size, int(size))
        finally:
            os.close(descriptor)


def sizes_of(path: Path) -> list[int]:
    """Bytes of the files of the result at `path`."""
    return [file.stat().st_size for file in (path, *list_segments(path))]


def prepare_folder(path: Path, number: int, alone: bool) -> None:
    """Remove the parts behind that number, unless it is `alone`, and make its folder."""
    for part_path in () if alone else reversed(list_segments(path)):
        if int(part_path.stem) > number:
            part_path.unlink(missing_ok=True)
    if number:
        parts_folder(path).mkdir(exist_ok=True)


def remove_other_parts(path: str | Path) -> None:
    """Remove the parts of an earlier result at `path`; remaining ones are ignored."""
    shutil.rmtree(parts_folder(path), ignore_errors=True)
