"""Compiled fields and kernels of a scene, which scenes of one compile key share.

Also walls and numbers of a step as the kernels take them.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np

from dusttaichi.compute.memory import Table
from dusttaichi.domain.walls import TOP
from dusttaichi.grains.kernels import store
from dusttaichi.grains.kernels.declare import declare
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.phases import StepNumbers

NO_WALLS = Walls()
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
    load_sums: Callable | None
    measure: tuple
    add_grain_losses: Callable | None = None

    @property
    def names(self):
        """Names of those that the scene has."""
        on_their_own = [f.name for f in fields(self) if f.name != "measure"]
        there = [name for name in on_their_own if getattr(self, name) is not None]
        return there + [n for n, k in zip(MEASURES, self.measure, strict=True) if k is not None]


@dataclass(frozen=True)
class Compiled:
    """Fields with a capacity for more grains than a scene has, and the kernels over them.

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

    def tables(self, grains, access):
        """Tables of fields, scratch and sums for a scene of this many grains.

        It begins with all numbers zero and has them until its FieldAccess ends.
        """
        rows = {var.name: var.shape[0] for var in declare(grains, self.layout, self.walls)}
        out = [
            {
                name: Table(f, rows.get(name, f.shape[0]), self.memory.get(name), access)
                for name, f in some
            }
            for some in (self.fields.items(), self.scratch.items(), self.sums.items())
        ]
        for table in out[0].values():
            table.fill(0)
        out[0]["counts"].from_numpy(np.array(store.sizes(grains, self.layout, self.walls)))
        return out


# -- what kernels take of walls and step ----------------------------------------------------------


@lru_cache(maxsize=4)
def walls_argument(box):
    """The walls of a Box as kernels take them."""
    return Walls(
        normal=box.normal.tolist(),
        offset=box.offset.tolist(),
        speed=box.speed.tolist(),
        strength=box.strength.tolist(),
        along=float(box.along[TOP, 0]),
    )


@lru_cache(maxsize=1)
def step_numbers(dt, masses, wall_due, reach2):
    """The numbers of a step as kernels take them; masses: units of mass and moment of inertia."""
    mass, inertia = masses
    return StepNumbers(dt=dt, kick=dt / mass, turn=dt / inertia, reach2=reach2, wall_due=wall_due)
