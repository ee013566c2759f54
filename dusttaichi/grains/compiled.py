"""What is compiled for a scene: its fields and kernels, which scenes of one compile key share."""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from dusttaichi.compute.memory import Table
from dusttaichi.grains.kernels import store
from dusttaichi.grains.kernels.declare import declare

MEASURES = ("measure_grains", "measure_pairs", "measure_walls", "measure_sphere")


@dataclass(frozen=True)
class Kernels:
    """The kernels of a scene; None what it does not have."""

    advance: Callable
    evaluate: Callable
    bounds: Callable
    list_neighbours: Callable
    relist_sphere: Callable | None
    list_entries: Callable | None
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

    def tables(self, grains, lease):
        """Tables of fields, scratch and sums for a scene of this many grains, which begins with
        all numbers zero and has them until its Lease ends."""
        rows = {var.name: var.shape[0] for var in declare(grains, self.layout, self.walls)}
        out = [
            {
                name: Table(f, rows.get(name, f.shape[0]), self.memory.get(name), lease)
                for name, f in some
            }
            for some in (self.fields.items(), self.scratch.items(), self.sums.items())
        ]
        for table in out[0].values():
            table.fill(0)
        out[0]["counts"].from_numpy(np.array(store.sizes(grains, self.layout, self.walls)))
        return out
