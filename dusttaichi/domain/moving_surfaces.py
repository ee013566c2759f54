"""Curved surfaces around or among the particles, as they move. Units: those of the domain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.physics.surfaces.surface_model import (
    CURVATURE,
    SHIFT,
    STEP,
    STRENGTH,
    VELOCITY,
    SurfaceModel,
    reduced_radius,
)


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Surfaces of a SurfaceModel and their table, a row of model.row_length numbers for each.

    names: by which messages and results call them. tube: number of the surface that is the tube of
    the boundary, or None.
    """

    model: SurfaceModel
    table: NDArray[np.float64]
    names: tuple[str, ...] = ()
    tube: int | None = None

    def __len__(self) -> int:
        return len(self.model)

    def with_step(self, dt: float) -> Surfaces:
        """The surfaces with the length of a step in their table."""
        table = self.table.copy()
        table[:, self.model.motion + STEP] = dt
        return replace(self, table=table)

    def _motion(self, n: int, first: int, count: int = 3) -> NDArray[np.float64]:
        column = self.model.motion + first
        return self.table[n, column : column + count]

    def numbers(self, n: int, time: float) -> SimpleNamespace:
        """Numbers of surface n at a time, by name."""
        out: dict[str, Any] = {}
        row, rates = self.table[n], self.table[n, self.model.width :]
        for name, first, components in self.model.columns[n]:
            values = row[first : first + components] + rates[first : first + components] * time
            out[name] = values if components > 1 else values[0]
        return SimpleNamespace(**out)

    def _local(self, n: int, x: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        return np.transpose(x - self._motion(n, SHIFT) - self._motion(n, VELOCITY) * time)

    def distances(self, n: int, x: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Distances of points (m, 3) from surface n at a time, (m,)."""
        law = self.model.laws[n]
        away = law.distance(self._local(n, x, time), self.numbers(n, time))
        return np.asarray(away + np.zeros(len(x)), float)

    def normals(self, n: int, x: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Unit normals of surface n at points (m, 3), towards the particles."""
        law = self.model.laws[n]
        normal = law.normal(self._local(n, x, time), self.numbers(n, time))
        return np.stack([a + np.zeros(len(x)) for a in normal], axis=1)

    def strengths(self) -> NDArray[np.float64]:
        """Factors on rolling, sliding and twisting, (S,)."""
        return self.table[:, self.model.motion + STRENGTH]

    def curvatures(self, n: int) -> tuple[float, ...]:
        """Principal curvatures of surface n, positive where it bends around the particles."""
        return tuple(self._motion(n, CURVATURE, 2).tolist())

    def reduced_radius(self, n: int, radius: Any) -> Any:
        """Reduced radius of contacts of spheres with surface n; radius: one number or (m,)."""
        return reduced_radius(radius, self.curvatures(n))

    @property
    def rates(self) -> NDArray[np.float64]:
        """Rates of change of the numbers of the laws, (S, width)."""
        return self.table[:, self.model.width : self.model.motion]

    @property
    def fastest(self) -> float:
        """Largest speed at which a surface comes nearer to what rests."""
        column = self.model.motion + VELOCITY
        moving = np.linalg.norm(self.table[:, column : column + 3], axis=1)
        return float(np.max(moving + np.abs(self.rates).sum(axis=1), initial=0.0))

    def tube_radius(self, time: float) -> float:
        """Radius of the tube at a time."""
        if self.tube is None:
            raise ValueError("there is no tube")
        return float(self.numbers(self.tube, time).radius)

    @property
    def tube_rate(self) -> float:
        """Rate at which the radius of the tube grows."""
        column = self.model.columns[self.tube][0][1]
        return float(self.rates[self.tube, column])
