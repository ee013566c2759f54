"""Folder of files that can be computed again: compiled kernels, samples of benchmarks."""

import os
import stat
import tempfile
from functools import lru_cache
from pathlib import Path

XDG = "XDG_CACHE_HOME"
_remarks = []


def cache_folder():
    """Folder of caches: $XDG_CACHE_HOME/dusttaichi or ~/.cache/dusttaichi.

    If that is not writable, a private folder of this user among the temporary files.
    """
    return _folder(os.environ.get(XDG), os.environ.get("HOME"))


def provide_home():
    """Give Taichi the folder of `cache_folder` if it cannot write its own.

    In containers without HOME it would end the process as soon as it is imported.
    """
    folder = cache_folder()
    if os.name == "posix" and _remarks:
        os.environ[XDG] = str(folder.parent)


def remarks():
    """Remarks about the folder for the user, each once per process."""
    texts = list(_remarks)
    _remarks.clear()
    return texts


@lru_cache
def _folder(cache, home):
    parent = Path(cache) if cache else Path(home) / ".cache" if home else None
    if parent is None and os.name != "posix":
        parent = Path.home() / ".cache"
    if parent is not None and _writable(parent / "dusttaichi"):
        return parent / "dusttaichi"
    private_folder = _private() / "dusttaichi"
    private_folder.mkdir(exist_ok=True)
    problem = (
        "HOME and XDG_CACHE_HOME are not set" if parent is None else f"{parent} is not writable"
    )
    _remarks.append(f"{problem}: compiled kernels are stored in {private_folder}")
    return private_folder


def _writable(folder):
    """True if that folder can be written or created."""
    existing_folder = next(
        (ancestor for ancestor in (folder, *folder.parents) if ancestor.exists()), folder
    )
    return existing_folder.is_dir() and os.access(existing_folder, os.W_OK | os.X_OK)


def _private():
    """A folder that no other user can write to, because the code in it is executed."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"dusttaichi-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        if stat.S_ISDIR(status.st_mode) and status.st_uid == user and not status.st_mode & 0o022:
            return folder
    except (OSError, AttributeError):
        pass
    return Path(tempfile.mkdtemp(prefix="dusttaichi-"))
