"""Start of Python with an emulated CUDA device (emulator/) in a process of its own."""

import hashlib
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

from dusttaichi.compute import compiler
from dusttaichi.compute.cache import cache_folder

HERE = Path(__file__).parent
SOURCES = ("driver.c", "threads.h", "translate.py", "instructions.py")


def missing():
    """Reason why there is no emulator on this machine, or None."""
    if sys.platform != "linux":
        return "the emulator replaces libcuda.so, which Linux has"
    return None if shutil.which("gcc") else "no gcc to build the emulated device with"


@cache
def folder():
    """Folder of the emulated libcuda.so, built from its present sources."""
    texts = [(HERE / "emulator" / name).read_text() for name in SOURCES]
    out = cache_folder() / "emulator" / hashlib.sha256("".join(texts).encode()).hexdigest()[:16]
    if not (out / "libcuda.so").exists():
        own = out.with_name(f"{out.name}.{os.getpid()}")
        own.mkdir(parents=True)
        for name in SOURCES:
            shutil.copy(HERE / "emulator" / name, own)
        library = own / "libcuda.so.1"
        flags = ["-O1", "-w", "-shared", "-fPIC", "-o", library]
        subprocess.run(["gcc", *flags, own / "driver.c", "-ldl"], check=True)
        (own / "libcuda.so").symlink_to(library.name)
        try:
            own.rename(out)
        except OSError:  # another process was faster
            shutil.rmtree(own)
    return out


def start(arguments, out, **settings):
    """Runs `python ARGUMENTS` with the device; (text of standard output, of standard error).

    out: folder for the modules of kernels. settings: variables EMULATOR_*, without that beginning.
    """
    out.mkdir(parents=True, exist_ok=True)
    own = {
        "LD_LIBRARY_PATH": f"{folder()}:{os.environ.get('LD_LIBRARY_PATH', '')}",
        "PYTHONPATH": f"{HERE}:{HERE.parents[1]}:{os.environ.get('PYTHONPATH', '')}",
        "EMULATOR_OUT": str(out),
        "EMULATOR_PYTHON": sys.executable,
        "EMULATOR_CACHE": str(cache_folder() / "emulator" / "modules"),
        compiler.variable(compiler.KERNEL_FOLDER): str(cache_folder() / "emulator" / "kernels"),
        **{f"EMULATOR_{name.upper()}": str(value) for name, value in settings.items()},
    }
    found = subprocess.run(
        [sys.executable, *map(str, arguments)],
        env=os.environ | own, capture_output=True, text=True, timeout=1200,
    )  # fmt: skip
    if found.returncode:
        raise RuntimeError(f"{found.stdout}\n{found.stderr}")
    return found.stdout, found.stderr
