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
        process_folder = out.with_name(f"{out.name}.{os.getpid()}")
        process_folder.mkdir(parents=True)
        for name in SOURCES:
            shutil.copy(HERE / "emulator" / name, process_folder)
        library = process_folder / "libcuda.so.1"
        flags = ["-O1", "-w", "-shared", "-fPIC", "-o", library]
        subprocess.run(["gcc", *flags, process_folder / "driver.c", "-ldl"], check=True)
        (process_folder / "libcuda.so").symlink_to(library.name)
        try:
            process_folder.rename(out)
        except OSError:  # another process was faster
            shutil.rmtree(process_folder)
    return out


def start(arguments, out, **settings):
    """Runs `python ARGUMENTS` with the device; (text of standard output, of standard error).

    out: folder for the modules of kernels. settings: variables EMULATOR_*, without that beginning.
    """
    out.mkdir(parents=True, exist_ok=True)
    variables = {
        "LD_LIBRARY_PATH": f"{folder()}:{os.environ.get('LD_LIBRARY_PATH', '')}",
        "PYTHONPATH": f"{HERE}:{HERE.parents[1]}:{os.environ.get('PYTHONPATH', '')}",
        "EMULATOR_OUT": str(out),
        "EMULATOR_PYTHON": sys.executable,
        "EMULATOR_CACHE": str(cache_folder() / "emulator" / "modules"),
        compiler.variable(compiler.KERNEL_FOLDER): str(cache_folder() / "emulator" / "kernels"),
        **{f"EMULATOR_{name.upper()}": str(value) for name, value in settings.items()},
    }
    process = subprocess.run(
        [sys.executable, *map(str, arguments)],
        env=os.environ | variables, capture_output=True, text=True, timeout=1200,
    )  # fmt: skip
    if process.returncode:
        raise RuntimeError(f"{process.stdout}\n{process.stderr}")
    return process.stdout, process.stderr
