"""What is compiled for a scene: its fields and kernels, which scenes of one compile key share."""

import gc
import weakref
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from taichi.lang import impl

from dusttaichi.compute.memory import Table
from dusttaichi.grains.kernels import store
from dusttaichi.grains.kernels.declare import declare

MEASURES = ("measure_grains", "measure_pairs", "measure_walls")


@dataclass(frozen=True)
class Kernels:
    """The kernels of a scene; None what it does not have."""

    advance: Callable
    bounds: Callable
    find: Callable
    relist: Callable
    list_entries: Callable
    relist_walls: Callable | None
    wrap: Callable | None
    measure: tuple

    @property
    def names(self):
        """Names of those that the scene has."""
        on_their_own = [f.name for f in fields(self) if f.name != "measure"]
        there = [name for name in on_their_own if getattr(self, name) is not None]
        return there + [n for n, k in zip(MEASURES, self.measure, strict=True) if k is not None]


@dataclass(frozen=True)
class Compiled:
    """Fields with room for more grains than a scene has, and the kernels over them.

    compile_key: all that they depend on. fields, scratch, sums: Taichi fields by name: the state,
    what the search needs meanwhile, sums of measurements. memory: arrays that share the memory of
    the fields, by name; none on a device with its own.
    """

    compile_key: tuple
    layout: store.Layout
    walls: bool
    kernels: Kernels
    fields: dict
    scratch: dict
    sums: dict
    memory: dict

    def tables(self, grains):
        """Tables of fields, scratch and sums for a scene of this many grains, which begins with
        all numbers zero."""
        rows = {var.name: var.shape[0] for var in declare(grains, self.layout, self.walls)}
        out = [
            {name: Table(f, rows.get(name, f.shape[0]), self.memory.get(name)) for name, f in some}
            for some in (self.fields.items(), self.scratch.items(), self.sums.items())
        ]
        for table in out[0].values():
            table.fill(0)
        out[0]["counts"].from_numpy(np.array(store.sizes(grains, self.layout, self.walls)))
        return out


class LastCompiled:
    """What was compiled last in this process: it serves again once nobody has its simulation.

    Taichi holds one program at a time, so a start of it would undo the fields of the simulation
    before anyway.
    """

    def __init__(self):
        self._compiled, self._simulation, self._program = None, lambda: None, None

    def remember(self, simulation):
        """That of a Simulation just built."""
        self._compiled, self._simulation = simulation.compiled, weakref.ref(simulation)
        self._program = impl.get_runtime().prog

    def of_no_more_use(self, compile_key):
        """The Compiled of that key, None where it is another or its simulation is still held."""
        if self._compiled is None or self._compiled.compile_key != compile_key:
            return None
        if impl.get_runtime().prog is not self._program:
            return None  # somebody has started Taichi anew
        if self._simulation() is not None:
            gc.collect()  # it may only be held in a circle
        return self._compiled if self._simulation() is None else None
