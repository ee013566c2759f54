"""What is compiled for a scene: its fields and kernels, which scenes of one compile key share."""

from dataclasses import dataclass
from typing import Any

from dusttaichi.compute.memory import Table, arrays_of
from dusttaichi.continuum.kernels import store
from dusttaichi.continuum.kernels.forces import Forces
from dusttaichi.continuum.kernels.lists import Lists, make_list
from dusttaichi.continuum.kernels.motion import Motion
from dusttaichi.continuum.kernels.numbers import numbers_type
from dusttaichi.continuum.kernels.rates import Rates
from dusttaichi.continuum.kernels.response import Response
from dusttaichi.continuum.kernels.separation import Separation
from dusttaichi.continuum.kernels.smoothing import KERNELS
from dusttaichi.continuum.step import make_advance


class Fields:
    """Taichi fields by name, as kernels say them: fields.x."""

    def __init__(self, fields):
        self.__dict__.update(fields)


@dataclass(frozen=True)
class Kernels:
    """The kernels of a scene, and the type of what they are told."""

    advance: Any
    count: Any
    write: Any
    StepNumbers: Any


@dataclass(frozen=True)
class Compiled:
    """Fields with room for more particles than a scene has, and the kernels over them.

    compile_key: all that they depend on. fields, lists: Taichi fields by name: the state, and what
    follows from it. memory: arrays that share the memory of the fields, by name; none where a
    device has its own.
    """

    compile_key: tuple
    layout: store.Layout
    kernels: Kernels
    fields: dict
    lists: dict
    memory: dict

    def tables(self, n, lease):
        """Tables of fields and lists for a scene of n particles, which begins with all numbers
        zero and has them until its Lease ends."""
        rows = {v.name: f.shape[0] if v.ghosts else n for v, f in self._declared()}
        fields = {
            name: Table(field, rows.get(name, field.shape[0]), self.memory.get(name), lease)
            for name, field in self.fields.items()
        }
        lists = {
            name: Table(field, field.shape[0], self.memory.get(name), lease)
            for name, field in self.lists.items()
        }
        for table in (*fields.values(), lists["sync"], lists["most"]):
            table.fill(0)
        return fields, lists

    def _declared(self):
        return [(v, self.fields[v.name]) for v in store.declare(self.layout)]


def compiled_for(key, layout, room, entries, kind):
    """The Compiled of a layout with room for so many particles and list entries; Taichi runs.

    kind: of the loops (backend.Loops). A kernel a phase is for devices, whose memory is their own:
    wherever it runs, it looks at none directly.
    """
    fields, lists = store.place(layout, room, entries)
    f, scratch = Fields(fields), Fields(lists)
    n, smoothing = layout.dimension, KERNELS[layout.kernel]
    contact = Separation(f, scratch, n, smoothing) if layout.separate else None
    law = Response(f, n)
    rates = Rates(f, scratch, layout, smoothing=smoothing, law=law, contact=contact)
    forces = Forces(f, scratch, layout)
    StepNumbers = numbers_type(n)
    advance = make_advance((Motion(f, scratch, layout), rates, forces), StepNumbers, kind)
    count, write = make_list(Lists(f, scratch, n))
    kernels = Kernels(advance, count, write, StepNumbers)
    memory = arrays_of({**fields, **lists}) if kind == "workers" else {}
    return Compiled(key, layout, kernels, fields, lists, memory)
