"""Compiled fields and kernels of a scene, shared by scenes of one compile key."""

from dataclasses import dataclass
from typing import Any

from dusttaichi.compute.memory import Table, arrays_of
from dusttaichi.continuum.kernels import store
from dusttaichi.continuum.kernels.attraction import Attraction, make_potential
from dusttaichi.continuum.kernels.blocks import Blocks
from dusttaichi.continuum.kernels.forces import Forces
from dusttaichi.continuum.kernels.hourglass import Hourglass
from dusttaichi.continuum.kernels.images import Images
from dusttaichi.continuum.kernels.lists import Lists, make_list, make_measure
from dusttaichi.continuum.kernels.motion import Motion
from dusttaichi.continuum.kernels.numbers import numbers_type
from dusttaichi.continuum.kernels.planes import Planes
from dusttaichi.continuum.kernels.rates import Rates
from dusttaichi.continuum.kernels.response import Response
from dusttaichi.continuum.kernels.rigid import Rigid
from dusttaichi.continuum.kernels.search import make_search, place_search
from dusttaichi.continuum.kernels.separation import Separation
from dusttaichi.continuum.kernels.smoothing import KERNELS
from dusttaichi.continuum.step import make_advance


class Fields:
    """Taichi fields as attributes, as kernels use them: fields.x."""

    def __init__(self, fields):
        self.__dict__.update(fields)


@dataclass(frozen=True)
class Kernels:
    """The kernels of a scene, and the type of their arguments.

    search: launches of a search on a device, None where the host searches with `count`, `write` and
    `measure`.
    """

    advance: Any
    search: Any
    count: Any
    write: Any
    measure: Any
    potential: Any
    StepNumbers: Any


@dataclass(frozen=True)
class Compiled:
    """Fields of a capacity above the number of particles of a scene, and the kernels over them.

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

    def tables(self, n, access):
        """Tables of fields and lists for a scene of n particles.

        It begins with all numbers zero and has them until its FieldAccess ends.
        """
        rows = {v.name: f.shape[0] if v.ghosts else n for v, f in self._declared()}
        fields = {
            name: Table(field, rows.get(name, field.shape[0]), self.memory.get(name), access)
            for name, field in self.fields.items()
        }
        lists = {
            name: Table(field, field.shape[0], self.memory.get(name), access)
            for name, field in self.lists.items()
        }
        for table in (*fields.values(), lists["sync"], lists["most"]):
            table.fill(0)
        return fields, lists

    def _declared(self):
        return [(v, self.fields[v.name]) for v in store.declare(self.layout)]


def compiled_for(key, layout, capacity, kind):
    """The Compiled of a layout; Taichi runs.

    capacity: numbers of particles, list entries and ghosts (capacities).

    kind: of the loops (backend.Loops). A kernel a phase is for devices, whose memory is their own:
    wherever it runs, it looks at none directly.
    """
    fields, lists = store.place(layout, *capacity)
    if kind != "workers":
        lists |= place_search(fields, lists, layout)
    f, scratch = Fields(fields), Fields(lists)
    n, StepNumbers = layout.dimension, numbers_type(layout.dimension)
    attraction = Attraction(f, scratch, n) if layout.self_gravity else None
    rigid, rates, forces = passes(f, scratch, layout, attraction)
    motion = Motion(f, scratch, layout, rigid=rigid, images=forces.images, attraction=attraction)
    advance = make_advance(motion, rates, forces, StepNumbers, kind)
    search = None if kind == "workers" else make_search(motion, advance.numbers)
    count, write = make_list(Lists(f, scratch, layout))
    measure = make_measure(f, scratch, rigid, StepNumbers) if layout.rigid else None
    potential = make_potential(attraction, StepNumbers) if layout.self_gravity else None
    kernels = Kernels(advance, search, count, write, measure, potential, StepNumbers)
    memory = arrays_of({**fields, **lists}) if kind == "workers" else {}
    return Compiled(key, layout, kernels, fields, lists, memory)


def passes(f, lists, layout, attraction=None):
    """(Rigid, Rates, Forces) of a layout over Fields of state and lists."""
    slope, rigid, contact = KERNELS[layout.kernel], Rigid(f, layout.dimension), None
    images = planes = None
    blocks = Blocks(f, lists, layout, Lists(f, lists, layout))
    if layout.rigid:
        images = Images(f, lists, blocks, layout, slope=slope, rigid=rigid)
    if layout.faces:
        planes = Planes(f, lists, blocks, images)
    if layout.separate:
        contact = Separation(f, lists, blocks, slope=slope, images=images)
    law = Response(f, lists, layout)
    hourglass = Hourglass(f, lists, blocks, slope) if layout.hourglass else None
    both = {"blocks": blocks, "images": images, "planes": planes, "hourglass": hourglass}
    rates = Rates(f, lists, layout, law=law, contact=contact, **both)
    return rigid, rates, Forces(f, lists, layout, attraction=attraction, **both)
