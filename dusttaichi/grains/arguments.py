"""Walls and numbers of a step as kernels take them."""

from functools import lru_cache

from dusttaichi.domain.walls import TOP
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.phases import StepNumbers

NO_WALLS = Walls()


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
