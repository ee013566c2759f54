"""Walls: up to six planes around the particles, of which the top one may be driven."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.physics.geometry import WALLS

if TYPE_CHECKING:
    from dusttaichi.domain.drives import Boundary


NORMALS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
TOP = WALLS.index("top")


@dataclass(frozen=True, eq=False)
class Box:
    """Up to six walls; plane of wall n: x.normal = offset + speed t.

    A wall may also move along itself: its tangential displacement is slid + along t, (6, 3), and
    its velocity is speed normal + along.
    """

    normal: NDArray[np.float64]
    offset: NDArray[np.float64]
    speed: NDArray[np.float64]
    strength: NDArray[np.float64]
    present: NDArray[np.int32]
    slid: NDArray[np.float64] = field(default_factory=lambda: np.zeros((6, 3)))
    along: NDArray[np.float64] = field(default_factory=lambda: np.zeros((6, 3)))

    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocities of the walls, (6, 3)."""
        return self.speed[:, None] * self.normal + self.along

    def tangential_displacements(self, time: float) -> NDArray[np.float64]:
        """Displacement of each wall along itself at a time, (6, 3)."""
        return self.slid + self.along * time

    def offsets(self, time: float) -> NDArray[np.float64]:
        """x.normal on the six walls at a time."""
        return self.offset + self.speed * time

    def planes(self, time: float) -> NDArray[np.float64]:
        """Coordinates of the six walls at a time."""
        signs: NDArray[np.float64] = self.normal.sum(axis=1)
        return self.offsets(time) * signs

    def driven(self, speed: float, along: float, time: float) -> Box:
        """These walls with new velocities of the top one from `time` on.

        `speed` is downwards and `along` along x.
        """
        speeds, tangential = np.zeros(6), np.zeros((6, 3))
        if self.present[TOP]:
            # the normal of the top wall points down, as wall_speed does
            speeds[TOP], tangential[TOP, 0] = speed, along
        offset = self.offset + (self.speed - speeds) * time
        slid = self.slid + (self.along - tangential) * time
        return replace(self, offset=offset, speed=speeds, slid=slid, along=tangential)


def wall_strengths(boundary: Boundary) -> tuple[float | None, ...] | None:
    """Factor on the springs of each wall, None for one left out; None for a scene without walls."""
    if not boundary.walls:
        return None
    factors = zip(WALLS, [getattr(boundary, "side_walls", 1.0)] * 4 + [1.0, 1.0], strict=True)
    # a tube stiffens the dust beside it as a wall there does
    names = (*boundary.walls, "x_min") if boundary.kind == "tube" else boundary.walls
    return tuple(factor if name in names else None for name, factor in factors)


def make_box(
    boundary: Boundary,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    size: NDArray[np.float64],
) -> Box:
    """Walls around a sample of ends low and high, centred between the side walls, on the bottom."""
    slack = size - (high - low)
    low = low - np.array([0.5, 0.5, 0.0]) * slack
    high = low + size
    present = np.array([name in boundary.walls for name in WALLS], dtype=np.int32)
    factors = wall_strengths(boundary) or (None,) * 6
    strength = np.array([factor or 0.0 for factor in factors])
    offset = np.array([low[0], -high[0], low[1], -high[1], low[2], -high[2]])
    return Box(NORMALS, offset, np.zeros(6), strength, present)
