"""Compiled fields and kernels of a scene, and the cache of the last ones of this process."""

from dataclasses import dataclass
from typing import Any

from dusttaichi.compute.engine import program
from dusttaichi.compute.memory import FieldAccess, Table, arrays_of


@dataclass(frozen=True)
class Compiled:
    """Fields of a capacity above that of a scene, and the kernels over them.

    key: all that they depend on; layout: the options that are compiled in. groups: Taichi fields by
    name, in a tuple of dicts, the state first. memory: arrays that share the memory of the fields,
    by name; none where a device has its own.
    """

    key: tuple
    layout: Any
    kernels: Any
    groups: tuple
    memory: dict

    @classmethod
    def of(cls, key, layout, kernels, groups):
        """Compiled of the loops of a key, whose last item is their kind (backend.Loops)."""
        together = {name: field for group in groups for name, field in group.items()}
        # a device has memory of its own; what emulates one has it too
        memory = arrays_of(together) if key[-1] == "workers" else {}
        return cls(key, layout, kernels, groups, memory)


class LastCompiled:
    """The last Compiled of this process, reused if the next scene needs the same.

    Taichi has one program at a time: a simulation is unusable once another one is built, whether
    that compiles its own kernels or reuses the fields.
    """

    def __init__(self):
        self._compiled, self._access, self._program = None, None, None

    def of(self, key):
        """The Compiled of that key; None if it has another key, or Taichi was restarted."""
        if self._compiled is None or self._compiled.key != key:
            return None
        return self._compiled if program() is self._program else None

    def tables(self, compiled, rows):
        """A memory.Table of each field of a Compiled, in its groups; all state is zero.

        rows: used rows by name, of fields that have more. Earlier tables become unusable.
        """
        if self._access is not None:
            self._access.end()
        self._compiled, self._access = compiled, FieldAccess()
        self._program = program()
        memory, access = compiled.memory, self._access
        tables = [
            {n: Table(f, rows.get(n, f.shape[0]), memory.get(n), access) for n, f in group.items()}
            for group in compiled.groups
        ]
        for table in tables[0].values():
            table.fill(0)
        return tables
