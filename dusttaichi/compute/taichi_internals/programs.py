"""Several programs of the compiler in one process: fields, and kernels that are loaded once.

Taichi counts its programs and refuses a second one, but all that it knows of one is in an object
that it looks up in one place. A program is therefore set aside with that object, and continued
later. All share one pool of memory, which the end of any of them empties, so that they end
together.

Loading the kernels of a scene of 60 grains takes 1.4 s of processor time, continuing them 1 ms.
"""

import atexit
import ctypes
import os
from dataclasses import dataclass
from functools import cache
from typing import Any

from dusttaichi.compute.affinity import POOL
from dusttaichi.compute.engine import drop_program, is_tested, program, settings, ti

MOST = 20  # programs, with their fields 0.5 GB of small scenes
# s in which a program has compiled, above which some of its kernels were not found on disk: Taichi
# stores them there when it ends; finding those of a scene takes 0.1 s, compiling them 4 s
COMPILED = 2.0
_COUNT = "_ZN6taichi4lang7Program14num_instances_E"  # of programs, in Taichi's library


@dataclass(frozen=True)
class Aside:
    """A program that was set aside: Taichi's runtime, kernels by function, threads."""

    program: Any
    runtime: Any
    fields: Any
    kernels: dict
    threads: list

    @classmethod
    def of_current(cls):
        """The current program."""
        runtime = ti.lang.impl.pytaichi
        kernels = {k: k.compiled_kernels for k in runtime.kernels if k.compiled_kernels}
        POOL.serve(1)  # its threads, which wait from now on, are bound to no core
        return cls(program(), runtime, ti.lang.impl._root_fb, kernels, POOL.threads)

    def resume(self):
        """Make it the current one again."""
        ti.lang.impl.pytaichi, ti.lang.impl._root_fb = self.runtime, self.fields
        for kernel in self.runtime.kernels:
            kernel.runtime, kernel.compiled_kernels = self.runtime, self.kernels.get(kernel, {})
        POOL.threads, POOL.apart = self.threads, False


class ProcessError(RuntimeError):
    """This process, or this thread of it, cannot start the compiler."""


class Programs:
    """The current program, and those of this process that are set aside, the latest last.

    An exception may come between any two lines (Ctrl-C): a program that was not started, resumed or
    ended to the end is not the current one, and the next start ends all of them.
    """

    def __init__(self):
        self._current, self._aside = None, []
        self._can_last = self._lasts = False  # the current one can be set aside, and may be
        self._forked = None  # backend of the parent, in a process that was forked meanwhile

    def start(self, lasts, **options):
        """Start a new program, as ti.init does; lasts: whether `keep` may be called later."""
        self._refuse_fork(options["arch"])
        if _count() is not None:
            if lasts and self._may_stay() and len(self._aside) + 1 < MOST:
                self._set_aside()
            else:
                self.end()
            _count().value = 0
        ti.init(**options)
        self._can_last, self._lasts = lasts and _count() is not None, False
        self._current = program()

    def keep(self):
        """Let the current program be set aside later: all of it is compiled."""
        self._lasts = self._can_last

    def resume(self, target):
        """Make a program the current one; False where it has ended, or the current one must end."""
        if program() is target and self._is_ours():
            return True
        entry = next((aside for aside in self._aside if aside.program is target), None)
        if entry is None or not (self._lasts and self._is_ours()):
            return False
        self._set_aside()
        entry.resume()
        self._aside.remove(entry)
        self._current = target
        return True

    def __contains__(self, target):
        """True if a program has not ended."""
        return any(target is living for living in (program(), *(p.program for p in self._aside)))

    def end(self):
        """Finish all: Taichi stores their new kernels on disk and frees their memory."""
        if program() is None and not self._aside:
            return
        self._current = None
        for aside in self._aside:
            aside.program.finalize()
        self._aside.clear()
        ti.reset()
        if _count() is not None:
            _count().value = 0

    def forget(self):
        """Leave all programs to the parent of this forked process, which has none of their threads.

        They are neither used nor destroyed here: both would wait for the threads.
        """
        if program() is None and not self._aside:
            return
        POOL.threads = []
        self._forked = ti.cpu if program() is None else settings().arch
        kept_alive = [*self._aside, program()]
        if _count() is None:
            drop_program()
        else:
            if program() is not None:
                kept_alive.append(Aside.of_current())
            ti.lang.impl.pytaichi = ti.lang.impl.PyTaichi(ti.lang.impl.pytaichi.kernels)
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept_alive))
        self._aside, self._current = [], None

    def _refuse_fork(self, arch):
        if self._forked is not None and (_count() is None or self._forked == arch == ti.cuda):
            raise ProcessError(
                "it was forked from one that has computed, whose threads and device it does not "
                'have. Start it by multiprocessing.get_context("spawn")'
            )

    def _is_ours(self):
        """False after a start or an end of Taichi elsewhere or in part: the memory may be empty."""
        return program() is not None and program() is self._current

    def _may_stay(self):
        current = program() if self._lasts and self._is_ours() else None
        return current is not None and current.get_total_compilation_time() < COMPILED

    def _set_aside(self):
        self._current = None
        self._aside.append(Aside.of_current())
        ti.lang.impl.pytaichi = ti.lang.impl.PyTaichi(ti.lang.impl.pytaichi.kernels)


@cache
def _count():
    """Taichi's number of programs; None where it cannot be set."""
    if not is_tested():
        return None
    try:
        library = ctypes.CDLL(ti.lang.impl._ti_core.__file__)
        return ctypes.c_int.in_dll(library, _COUNT)
    except (OSError, ValueError):
        return None


PROGRAMS = Programs()
atexit.register(PROGRAMS.end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=PROGRAMS.forget)
