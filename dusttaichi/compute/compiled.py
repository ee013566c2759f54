"""Compiled fields and kernels of scenes, several of them in one process."""

import gc
from dataclasses import dataclass
from typing import Any

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import program
from dusttaichi.compute.memory import FieldAccess, Table
from dusttaichi.compute.taichi_internals.addresses import arrays_of
from dusttaichi.compute.taichi_internals.launching import Launch
from dusttaichi.compute.taichi_internals.programs import PROGRAMS

LARGE = 2**25  # bytes of fields above which a structure ends when another one is used


@dataclass(frozen=True)
class Compiled:
    """Fields of a capacity above that of a scene, and the kernels over them.

    key: all that they depend on; layout: the compiled options. groups: Taichi fields by name, in a
    tuple of dicts, the state first. memory: arrays that share the memory of the fields, by name;
    none where a device has its own. program: of the compiler.
    """

    key: tuple
    layout: Any
    kernels: Any
    groups: tuple
    memory: dict
    program: Any

    @classmethod
    def from_kernels(cls, key, layout, kernels, groups):
        """Compiled of the loops of a key, whose last item is their kind (backend.Loops).

        Taichi's kernels are called by a Launch.
        """
        quick = {n: Launch(k) if hasattr(k, "_primal") else k for n, k in vars(kernels).items()}
        together = {name: field for group in groups for name, field in group.items()}
        # a device has memory of its own, also an emulated one
        memory = arrays_of(together) if key[-1] == "workers" else {}
        return cls(key, layout, type(kernels)(**quick), groups, memory, program())


class Structures:
    """Every Compiled of this process that can be reused.

    One simulation runs at a time: it is unusable once another one is built.
    """

    def __init__(self):
        self._compiled, self._access, self._fresh = [], None, None

    def get(self, key, scene, threads, compile_for):
        """The Compiled of a key, and Taichi runs with its program.

        It is the previous one of that key, or that of `compile_for(key)` after a start of Taichi
        for the scene with that number of threads.
        """
        for candidate in self._compiled:
            if candidate.key == key and PROGRAMS.resume(candidate.program):
                return candidate
        start_taichi(scene, threads)
        living = [candidate for candidate in self._compiled if candidate.program in PROGRAMS]
        if len(living) < len(self._compiled):
            self._compiled = living
            gc.collect()  # kernels refer to themselves: 23 MB of each program
        compiled = self._fresh = compile_for(key)
        self._compiled.append(compiled)
        if sum(array.nbytes for array in compiled.memory.values()) < LARGE:
            PROGRAMS.keep()
        return compiled

    def tables(self, compiled, rows):
        """A memory.Table of each field of a Compiled, in its groups; all state is zero.

        rows: used rows by name, of fields that have more. Earlier tables become unusable.
        """
        if self._access is not None:
            self._access.end()
        self._access = FieldAccess()
        memory, access = compiled.memory, self._access
        tables = [
            {n: Table(f, rows.get(n, f.shape[0]), memory.get(n), access) for n, f in group.items()}
            for group in compiled.groups
        ]
        # new fields are zero; on a device to fill them takes a kernel each, which is compiled
        if compiled is not self._fresh or memory:
            for table in tables[0].values():
                table.clear()
        self._fresh = None
        return tables


STRUCTURES = Structures()
