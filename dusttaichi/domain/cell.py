"""The periodic cell: its edges and their motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dusttaichi.physics.geometry import nearest_image


@dataclass(frozen=True, eq=False)
class Cell:
    """A periodic cell: edge L(t) = start exp(growth t) + rate t along the periodic axes, centred.

    start, rate, growth, centre: (3,). Along the other axes start is 0.
    The image above it is shifted along x by tilt + tilt_rate t; tilted: the cell may be sheared in
    this run. strain + shear_rate t: shear strain since the start of the run.
    """

    start: NDArray[np.float64]
    rate: NDArray[np.float64]
    growth: NDArray[np.float64]
    centre: NDArray[np.float64]
    axes: tuple[int, ...]
    tilted: bool = False
    tilt: float = 0.0
    tilt_rate: float = 0.0
    strain: float = 0.0
    shear_rate: float = 0.0

    @property
    def rows(self) -> NDArray[np.float64]:
        """Rows of the field `cell` (kernels.cell_kinematics)."""
        tilt = [self.tilt, self.tilt_rate, 0.0]
        return np.array([self.start, self.rate, self.growth, self.centre, tilt])

    def edges(self, time: float) -> NDArray[np.float64]:
        """Lengths at a time, (3,)."""
        return self.start * np.exp(self.growth * time) + self.rate * time

    def speeds(self, time: float) -> NDArray[np.float64]:
        """Growth rates of the edges at a time, (3,)."""
        return self.growth * self.start * np.exp(self.growth * time) + self.rate

    def offset(self, time: float) -> float:
        """Shift of the image above along x at a time."""
        return self.tilt + self.tilt_rate * time

    def compute_shear_strain(self, time: float) -> float:
        """Shear strain since the start of the run."""
        return self.strain + self.shear_rate * time

    def low(self, time: float) -> NDArray[np.float64]:
        """Lower faces at a time, (3,)."""
        return self.centre - 0.5 * self.edges(time)

    def outside(self, x: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Numbers of edges by which positions x (N, 3) are outside the cell: (N, 3) floats.

        The faces across x of a sheared cell are parallel to its edge along z.
        """
        edges, out = self.edges(time), np.zeros(np.shape(x))
        low, x = self.low(time), np.array(x, float)
        for n in sorted(self.axes, reverse=True):
            out[:, n] = np.floor((x[:, n] - low[n]) / edges[n])
            x[:, n] -= out[:, n] * edges[n]
            if n == 2 and self.tilted:
                slope = self.offset(time) / edges[2]
                x[:, 0] -= out[:, 2] * self.offset(time) + slope * (x[:, 2] - self.centre[2])
        return out

    def across(self, counts: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Vectors (N, 3) of these numbers of edges along the axes."""
        out = counts * self.edges(time)
        out[:, 0] += counts[:, 2] * self.offset(time)
        return out

    def speeds_across(self, counts: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Relative velocities of images at these numbers of edges, (N, 3)."""
        out = counts * self.speeds(time)
        out[:, 0] += counts[:, 2] * self.tilt_rate
        return out

    def power(self, loads: NDArray[np.float64], time: float) -> float:
        """Power of the faces under the loads (3, 3) of LoadSums.across_faces."""
        return float(np.diag(loads) @ self.speeds(time) + loads[0, 2] * self.tilt_rate)

    def nearest(self, d: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Distance vectors, (N, 3), to the nearest image."""
        period = np.where(np.isin(np.arange(3), self.axes), self.edges(time), np.inf)
        return nearest_image(d, period, self.offset(time))

    def driven(
        self,
        time: float,
        *,
        rate: float | NDArray[np.float64] = 0.0,
        growth: float | NDArray[np.float64] = 0.0,
        shear: float = 0.0,
    ) -> Cell:
        """The cell with another motion from `time` on.

        rate and growth: one or (3,).
        """
        periodic = np.isin(np.arange(3), self.axes)
        growth, rate = np.where(periodic, growth, 0.0), np.where(periodic, rate, 0.0)
        edges, offset = self.edges(time), self.offset(time)
        start = (edges - rate * time) * np.exp(-growth * time)
        # the faces follow a homogeneous flow: the tilt along x grows with the edge there
        tilt_rate = shear * edges[2] + growth[0] * offset if self.tilted else 0.0
        return replace(
            self,
            start=start,
            rate=rate,
            growth=growth,
            tilt=offset - tilt_rate * time,
            tilt_rate=float(tilt_rate),
            strain=self.compute_shear_strain(time) - shear * time,
            shear_rate=float(shear),
        )

    def upright(self, time: float) -> Cell:
        """An equal lattice of images, with the smallest shift of the one above."""
        turns = np.round(self.offset(time) / self.edges(time)[0]) if self.tilted else 0.0
        if not turns:
            return self
        faster = turns * self.speeds(time)[0]
        tilt = self.offset(time) - turns * self.edges(time)[0]
        rate = self.tilt_rate - faster
        return replace(self, tilt=float(tilt - rate * time), tilt_rate=float(rate))
