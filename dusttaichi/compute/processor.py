"""The processor, its vectors, and the folder of its kernels. The compiler is not imported here."""

import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from dusttaichi.compute import compiler
from dusttaichi.compute.cache import cache_folder

X86 = (("avx512f", 512), ("avx", 256), ("sse2", 128))  # features, and bits of their vectors
UNUSED = 60 * 86400.0  # s after which the kernels of another processor are removed
# files by which Taichi and Quadrants lock their kernels on disk, for milliseconds
LOCKS = ("ticache.lock", "kernel_compilation_manager/qdcache.lock")
LOCKED = 60.0  # s after which such a lock is that of a process that was killed


# -- the processor ---------------------------------------------------------------------------------


def usable_cores():
    """The number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


@lru_cache(maxsize=1)
def _describe_processor():
    """(model, features) of the processor; no features if the system does not list them."""
    if sys.platform == "linux":
        lines = [line.partition(":")[::2] for line in _text("/proc/cpuinfo").splitlines()]
        rows = [(name.strip().lower(), value.strip()) for name, value in lines]
        names = [value for name, value in rows if name == "model name"]
        arm = sorted({f"{n} {v}" for n, v in rows if n in ("cpu implementer", "cpu part")})
        flags = [value.split() for name, value in rows if name in ("flags", "features")]
        # features that all cores have, which may differ
        common = frozenset.intersection(*map(frozenset, flags)) if flags else frozenset()
        model = names[0] if names else ", ".join(arm)
    elif sys.platform == "darwin":
        model = _sysctl("machdep.cpu.brand_string")
        listed = _sysctl("machdep.cpu.features", "machdep.cpu.leaf7_features")
        common = frozenset(listed.lower().replace("avx1.0", "avx").split())
    else:
        model, common = os.environ.get("PROCESSOR_IDENTIFIER", ""), _windows_features()
    return model or platform.processor() or platform.machine(), common


def _text(path):
    try:
        return Path(path).read_text(errors="replace")
    except OSError:
        return ""


def _sysctl(*names):
    command = ["sysctl", "-n", *names]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=5).stdout.strip()
    except (OSError, subprocess.TimeoutExpired):
        return ""


def _windows_features():
    if sys.platform != "win32":
        return frozenset()
    import ctypes

    numbers = {"sse2": 10, "avx": 39, "avx512f": 41}  # PF_..._INSTRUCTIONS_AVAILABLE
    is_there = ctypes.windll.kernel32.IsProcessorFeaturePresent
    return frozenset(name for name, number in numbers.items() if is_there(number))


def model() -> str:
    """Name of the processor, as the system gives it."""
    return _describe_processor()[0]


def own_bits():
    """Bits of the widest vectors of the processor; None if they are unknown."""
    if platform.machine().lower() in ("arm64", "aarch64"):
        return 128  # NEON; how wide SVE is the features do not say
    return next((bits for feature, bits in X86 if feature in _describe_processor()[1]), None)


# -- the folder of its kernels ---------------------------------------------------------------------


def kernel_key() -> str:
    """One word for processor, features and compiler: kernels of one key serve each other."""
    name, features = _describe_processor()
    digest = hashlib.sha256("\n".join([name, platform.machine(), *sorted(features)]).encode())
    slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40]
    return f"{slug}-{digest.hexdigest()[:8]}-{compiler.name()}-{compiler.version()}"


def kernel_folder() -> str:
    """Folder of kernels of this processor and compiler.

    Home directories are shared, and code for one processor may not run on another, or run more
    slowly.
    """
    return cache_folder() / "kernels" / kernel_key()


def use_kernel_folder():
    """Mark `kernel_folder` as in use and return it.

    Kernels of other processors are removed after UNUSED.
    """
    folder = kernel_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        _remove_unused(folder.parent)
    except OSError:
        pass  # a disk that refuses it costs the time of compiling
    return folder


def remove_old_locks(folder) -> None:
    """Remove locks of processes that were killed.

    With such a lock the compiler would neither read nor write kernels on disk any more.
    """
    for lock in (Path(folder) / name for name in LOCKS):
        with suppress(OSError):
            if time.time() - lock.stat().st_mtime > LOCKED:
                lock.unlink()


def _remove_unused(root) -> None:
    """Remove folders of kernels that have not been used for long."""
    oldest_use = time.time() - UNUSED
    for folder in (path for path in root.iterdir() if path.is_dir()):
        if folder.stat().st_mtime < oldest_use:
            shutil.rmtree(folder)
