"""Parts from which a simulation of grains is made. Internal units, grains and sphere in SI."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dusttaichi.domain.cell import Cell
from dusttaichi.domain.walls import Box
from dusttaichi.grains.gravity import Gravity
from dusttaichi.grains.sphere import RigidSphere
from dusttaichi.grains.state import GrainProperties
from dusttaichi.grains.time_step import TimeStep


@dataclass(frozen=True)
class Grains:
    """Grains of a sample; order (N,): their numbers in the sample, in internal order."""

    order: np.ndarray
    properties: GrainProperties


@dataclass(frozen=True)
class ContactNumbers:
    """Numbers of a contact (kernels.numbers) of two grains, with a wall and with the sphere.

    Where grains differ those of the contact that reaches farthest; sphere: None without one.
    stiffness: of the contacts over that of the material (numerics.stiffness_scaling).
    """

    pair: Any
    wall: Any
    sphere: Any
    stiffness: float


@dataclass(frozen=True)
class Environment:
    """Box, cell, sphere and gravity around the grains, each None where there is none.

    t_c [us]: characteristic time, see Domain.
    """

    box: Box | None
    cell: Cell | None
    sphere: RigidSphere | None
    gravity: Gravity | None
    t_c: float


@dataclass(frozen=True)
class Numerics:
    """Time step, skin of the search [um], None as it suits, and number of threads."""

    time_step: TimeStep
    skin: float | None
    threads: int
