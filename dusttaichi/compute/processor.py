"""The processor, the vectors that the compiler makes for it, and the folder of its kernels.

LLVM chooses the width of vectors by the name of the processor. LLVM 15, with which Taichi 1.7
compiles, takes an AMD processor newer than itself (Zen 5) for the oldest one: two doubles at a
time, whatever its registers hold. The compiler is not imported here; a child process compiles the
loop from whose code the width is read.
"""

import hashlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from dusttaichi import compiler
from dusttaichi.compute.cache import cache_folder
from dusttaichi.files import write_whole
from dusttaichi.processes import python_command

X86 = (("avx512f", 512), ("avx", 256), ("sse2", 128))  # features, and bits of their vectors
# LLVM stays at 256 bits on processors with AVX-512, most of which slow their clock down for wider
USUAL_BITS = 256
UNUSED = 60 * 86400.0  # s after which the kernels of another processor are removed
PATIENCE = 60.0  # s that the child process may take


# -- the processor ---------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _described():
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


def model():
    """Name of the processor, as the system gives it."""
    return _described()[0]


def own_bits():
    """Bits of the widest vectors of the processor; None if they are unknown."""
    if platform.machine().lower() in ("arm64", "aarch64"):
        return 128  # NEON; how wide SVE is the features do not say
    return next((bits for feature, bits in X86 if feature in _described()[1]), None)


# -- the folder of its kernels ---------------------------------------------------------------------


def kernel_key():
    """One word for processor, features and compiler: kernels of one key serve each other."""
    name, found = _described()
    digest = hashlib.sha256("\n".join([name, platform.machine(), *sorted(found)]).encode())
    slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40]
    return f"{slug}-{digest.hexdigest()[:8]}-{compiler.name()}-{compiler.version()}"


def kernel_folder():
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


def _remove_unused(root):
    """Remove unused folders, and kernels that earlier versions have left in the root."""
    old = time.time() - UNUSED
    files = [path for path in root.iterdir() if path.is_file() and path.suffix != ".json"]
    for folder in (path for path in root.iterdir() if path.is_dir()):
        if folder.stat().st_mtime < old:
            _remove(folder)
    if files and max(path.stat().st_mtime for path in files) < old:
        for path in files:
            path.unlink(missing_ok=True)


def _remove(folder):
    shutil.rmtree(folder)
    folder.with_name(f"{folder.name}.json").unlink(missing_ok=True)


# -- the vectors of compiled kernels ---------------------------------------------------------------


@lru_cache(maxsize=1)
def compiled_bits():
    """Bits of the vectors in compiled kernels; None if they cannot be determined.

    The first time on a machine a child process compiles a loop, which takes a second; the result is
    stored beside the kernels.
    """
    beside = kernel_folder().with_name(f"{kernel_key()}.json")
    with suppress(OSError, ValueError, KeyError, TypeError):
        return int(json.loads(beside.read_text())["vector_bits"])
    bits = _found_in_a_child()
    if bits is not None:
        with suppress(OSError):
            beside.parent.mkdir(parents=True, exist_ok=True)
            known = {"processor": model(), "own_bits": own_bits(), "vector_bits": bits}
            write_whole(beside, json.dumps(known).encode())
    return bits


def _found_in_a_child():
    command = python_command("dusttaichi.compute.processor")
    environment = {n: v for n, v in os.environ.items() if not n.startswith(compiler.variable(""))}
    try:
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                cwd=folder,
                timeout=PATIENCE,
                env=environment,
            )
        return int(done.stdout.split()[-1])
    except (OSError, subprocess.TimeoutExpired, ValueError, IndexError):
        return None


def _compile():
    """In the child: bits of the vectors that LLVM makes of a sum of products of doubles.

    Taichi writes the code into the current folder.
    """
    from dusttaichi.compute.engine import settings, ti

    ti.init(arch=ti.cpu, offline_cache=False, default_fp=ti.f64, log_level=ti.ERROR)
    settings().print_kernel_llvm_ir_optimized = True
    x = ti.field(ti.f64, shape=64)

    @ti.kernel
    def products(n: ti.i32):
        ti.loop_config(serialize=True)
        for i in range(n):
            total = 0.0
            for k in range(n):
                total += x[k] * x[k]
            x[i] = total

    products(0)
    code = "".join(file.read_text() for file in Path().glob("*optimized*.ll"))
    lanes = [int(n) for n in re.findall(r"fmul [a-z ]*<(\d+) x double>", code)]
    return 64 * max(lanes, default=1)


# -- output ------------------------------------------------------------------------------------


def vector_rows():
    """Rows (name, value) of the processor and the vectors of compiled kernels."""
    bits, own = compiled_bits(), own_bits()
    width = "unknown" if bits is None else f"{bits} bits, {bits // 64} doubles at a time"
    width += "" if own is None else f" (the processor has {own} bits)"
    return [("processor", model()), ("vectors in compiled kernels", width)]


def warning():
    """One line if compiled kernels use narrower vectors than they could here; else None."""
    bits, own = compiled_bits(), own_bits()
    if bits is None or own is None or bits >= min(own, USUAL_BITS):
        return None
    return (
        f"kernels use vectors of {bits} bits where this processor has {own}: the compiler "
        f"(LLVM of {compiler.label()}) does not know it, and steps of grains take about 1.3 times "
        f"as long; {compiler.VARIABLE}=quadrants chooses a newer one"
    )


if __name__ == "__main__":
    print(_compile())
