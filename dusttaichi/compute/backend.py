"""Start of Taichi for a scene: backend, threads, layout of the loops."""

import logging
import os
import threading
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from io import StringIO

from dusttaichi.compute import cache, compiler, processor
from dusttaichi.compute.affinity import POOL
from dusttaichi.compute.engine import settings, ti
from dusttaichi.compute.processor import usable_cores
from dusttaichi.compute.taichi_internals.programs import PROGRAMS, ProcessError
from dusttaichi.compute.taichi_internals.source_reading import patch
from dusttaichi.errors import DustError, StartError

THREAD_CLASSES = (32, 1024)  # numbers of threads that kernels are compiled for
# of kernels on disk; Taichi's default is 100 MB, some hundred compile configurations
CACHE_BYTES = 2**30
_NO_MEMORY = "Virtual memory allocation"  # in the errors of the compiler
_STARTING = threading.Lock()
SMALL = 400  # grains below which a second thread costs more than it gains


@dataclass(frozen=True)
class Loops:
    """Layout of the loops: lanes of a block, blocks of a tile, and the execution of the step loop.

    On a GPU a thread computes one contact and a block of threads a tile, with one kernel per phase
    instead of workers that wait for each other.
    """

    width: int
    tile: int
    execution: str


def loops_of(numerics):
    """The Loops of a scene: a block fills a vector register of 512 bits, or two of 256."""
    if numerics.backend == "cuda":
        # in double precision a thread needs some 170 registers: two blocks of 192 fit on a
        # multiprocessor, where three of 128 do not
        return Loops(1, 192 if numerics.precision == "f64" else 128, "launches")
    return Loops(8, 16, "workers") if numerics.precision == "f64" else Loops(16, 8, "workers")


def threads_of(scene, grains):
    """Number of worker threads: all cores that this process may use, one for a small sample.

    Never more than there are cores, because workers wait for each other. A device has its own
    threads.
    """
    if scene.numerics.backend != "cpu":
        return 1
    cores = usable_cores()
    if scene.numerics.threads != "auto":
        return min(scene.numerics.threads, cores)
    return 1 if grains < SMALL else max(1, min(cores, grains // (SMALL // 2)))


@contextmanager
def _shell(heard):
    """Context without the compiler's variables TI_* or QD_* of the shell, unless they are heard.

    They would change the backend or the compilation. Those of the kernels on disk remain.
    """
    names = [] if heard else [n for n in os.environ if n.startswith(compiler.variable(""))]
    foreign = [name for name in names if "OFFLINE_CACHE" not in name]
    hidden = {name: os.environ.pop(name) for name in foreign}
    try:
        yield
    finally:
        os.environ.update(hidden)


def _kernel_folder():
    """Folder of the kernels on disk as an argument of ti.init, unless a variable names one.

    It is not Taichi's common folder, which other programs reduce to 100 MB when they end, and it
    belongs to this processor and compiler.
    """
    named = os.environ.get(compiler.variable(compiler.KERNEL_FOLDER))
    folder = named or str(processor.use_kernel_folder())
    processor.remove_old_locks(folder)
    return {} if named else {"offline_cache_file_path": folder}


def start_taichi(scene, threads):
    """Initialise Taichi for this scene, quietly, with the kernels cached on disk.

    Taichi's own analysis of the control flow is off: LLVM repeats it, so that steps take as long,
    and compiling takes two fifths to two thirds of the time. Its other simplifications are needed:
    they move the address of the fields out of loops, without which LLVM vectorises none of them.

    With numerics.debug Taichi's internals are not patched, it checks the bounds of fields and uses
    IEEE arithmetic, and its variables of the shell apply.
    """
    debug = scene.numerics.debug
    patch(debug)
    for text in cache.remarks():
        logging.getLogger("dusttaichi").warning(text)
    arch = {"cpu": ti.cpu, "cuda": ti.cuda}[scene.numerics.backend]
    os.environ.setdefault(compiler.variable("OFFLINE_CACHE_CLEANING_POLICY"), "lru")
    try:
        # Taichi prints as it starts, which is not output of the run
        with redirect_stdout(StringIO()), _shell(heard=debug), _alone(), POOL.start(threads):
            PROGRAMS.start(
                lasts=scene.numerics.backend == "cpu" and not debug,
                arch=arch,
                cpu_max_num_threads=threads,
                # type of literals in a kernel, which must not turn single into double precision
                default_fp=ti.f64 if scene.numerics.precision == "f64" else ti.f32,
                fast_math=not debug,
                debug=debug,
                check_out_of_bound=debug,
                cfg_optimization=False,
                offline_cache=True,
                offline_cache_max_size_of_files=CACHE_BYTES,
                **_kernel_folder(),
                log_level=ti.CRITICAL,  # errors are raised, too
                enable_fallback=False,
            )
            # `threads` are started; kernels compiled for more are the same for all numbers
            thread_class = next((n for n in THREAD_CLASSES if n >= threads), threads)
            settings().cpu_max_num_threads = thread_class
    except Exception as error:
        raise _refusal(error, scene.numerics.backend) from error


@contextmanager
def _alone():
    """Context of one thread at a time; ProcessError in another."""
    if not _STARTING.acquire(blocking=False):
        raise ProcessError(
            "another thread of this process is starting a simulation. Run simulations one after "
            'another, or each in a process of its own (multiprocessing.get_context("spawn"))'
        )
    try:
        yield
    finally:
        _STARTING.release()


def _refusal(error, backend):
    """The DustError of a failed start: its cause, and a remedy."""
    if isinstance(error, ProcessError):  # causes of a StartError that are of the machine
        return DustError(f"{compiler.label()} cannot start in this process: {error}.")
    reason = (str(error).splitlines() or [type(error).__name__])[0]
    text = f"numerics.backend = {backend}: {compiler.label()} cannot start it here"
    if isinstance(error, MemoryError) or _NO_MEMORY in reason:
        return StartError(
            f"{text}: it reserves a gigabyte of address space, more than this process may still "
            "use. Raise its limit of memory (ulimit -v, or the memory requested of a queue)."
        )
    return StartError(f"{text} ({reason})" + ("; try backend: cpu" if backend != "cpu" else "."))
