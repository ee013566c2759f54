"""Kernels of a scene of grains; walls and numbers of a step as they take them."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import lru_cache

from dusttaichi.domain.walls import TOP
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
