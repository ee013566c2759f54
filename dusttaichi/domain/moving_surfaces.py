"""Curved surfaces around or among the particles, as they move. Units: those of the domain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.domain.servo import Servo
from dusttaichi.physics.surfaces.surface_model import (
    CURVATURE,
    SHIFT,
    SPIN,
    STEP,
    STRENGTH,
    VELOCITY,
    SurfaceModel,
    reduced_radius,
)
from dusttaichi.physics.surfaces.surface_motion import SurfaceMotion


@dataclass(frozen=True, eq=False)
class SurfaceState:
    """Changing values of Surfaces: their table, and their servos by their numbers, as texts."""

    table: NDArray[np.float64]
    servos: dict[str, Servo]


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Surfaces of a SurfaceModel and their table, a row of model.row_length numbers for each.

    names: by which messages and results call them. tube: number of the surface that is the tube of
    the boundary, or None. motions: of each as its block has it, None of the tube. servos: those
    that control a load now.
    """

    model: SurfaceModel
    table: NDArray[np.float64]
    names: tuple[str, ...] = ()
    tube: int | None = None
    motions: tuple[SurfaceMotion | None, ...] = ()
    servos: tuple[Servo, ...] = ()

    def __len__(self) -> int:
        return len(self.model)

    def with_step(self, dt: float) -> Surfaces:
        """The surfaces with the length of a step in their table."""
        table = self.table.copy()
        table[:, self.model.motion + STEP] = dt
        return replace(self, table=table)

    def state(self) -> SurfaceState:
        """The SurfaceState now."""
        return SurfaceState(self.table, {str(servo.axes[0]): servo for servo in self.servos})

    def with_state(self, state: SurfaceState) -> Surfaces:
        """The surfaces in that state."""
        return replace(self, table=state.table, servos=tuple(state.servos.values()))

    def with_velocities(self, velocities: NDArray[np.float64], time: float) -> Surfaces:
        """The surfaces with other velocities (S, 3) from a time on, at which they stay in place."""
        table, first = self.table.copy(), self.model.motion
        shift, velocity = (slice(first + c, first + c + 3) for c in (SHIFT, VELOCITY))
        table[:, shift] += (table[:, velocity] - velocities) * time
        table[:, velocity] = velocities
        return replace(self, table=table)

    def with_spins(self, spins: NDArray[np.float64]) -> Surfaces:
        """The surfaces with other angular velocities (S, 3)."""
        table, first = self.table.copy(), self.model.motion + SPIN
        table[:, first : first + 3] = spins
        return replace(self, table=table)

    def _columns(self, first: int) -> NDArray[np.float64]:
        return self.table[:, self.model.motion + first : self.model.motion + first + 3]

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Velocities, (S, 3)."""
        return self._columns(VELOCITY)

    @property
    def spins(self) -> NDArray[np.float64]:
        """Angular velocities, (S, 3)."""
        return self._columns(SPIN)

    def displacements(self, time: float) -> NDArray[np.float64]:
        """Displacements at a time since the start, (S, 3)."""
        return self._columns(SHIFT) + self.velocities * time

    def displacement_of(self, name: str, time: float) -> float:
        """Displacement of a surface along its direction at a time since the start."""
        n = self.names.index(name)
        return float(self.displacements(time)[n] @ self.directions[n])

    @property
    def directions(self) -> NDArray[np.float64]:
        """Unit vectors along which they press, (S, 3); not numbers where none is set."""
        none = (np.nan,) * 3
        return np.array([none if m is None else m.direction or none for m in self.motions])

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
        """Largest speed at which a surface comes nearer to what rests, or may by its servo."""
        moving = np.linalg.norm(self.velocities, axis=1)
        for servo in self.servos:  # along its direction no faster than its largest speed
            moving[servo.axes[0]] += servo.largest[0] - abs(servo.speed[0])
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
