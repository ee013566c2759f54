"""The periodic cell of a sample, and pairs of its grains across the faces."""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.physics.geometry import nearest_image, pairs_within
from dusttaichi.physics.near import near_pairs
from dusttaichi.samples.materials import Materials


@dataclass(frozen=True)
class Cell:
    """Periodic cell of the grains: edges (3,) [m], inf along open axes, and tilt [m]."""

    period: NDArray[np.float64]
    tilt: float = 0.0

    @property
    def axes(self) -> NDArray[np.intp]:
        """Numbers of the periodic axes."""
        return np.flatnonzero(np.isfinite(self.period))

    @property
    def vectors(self) -> NDArray[np.float64]:
        """Edges as rows (3, 3) [m], zero along open axes."""
        out = np.diag(np.where(np.isfinite(self.period), self.period, 0.0))
        out[2, 0] = self.tilt
        return out

    def nearest(self, d: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance vectors (N, 3) to the nearest image."""
        return nearest_image(d, self.period, self.tilt)

    def wrap_positions(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Wrap positions (N, 3): images that are at least 0 and below the edges."""
        x = np.array(x, float)
        for n in (2, 1, 0):  # a turn along z shifts along x
            if np.isfinite(self.period[n]):
                x -= np.floor(x[:, n] / self.period[n])[:, None] * self.vectors[n]
        return x

    def pairs(
        self, x: NDArray[np.float64], radii: NDArray[np.float64], factor: float = 1.0
    ) -> NDArray[np.integer]:
        """Pairs no farther apart than `factor` times their radii, across faces too.

        Parameters
        ----------
        x : array
            Positions [m], (N, 3).
        radii : array
            [m], (N,).
        factor : float

        Returns
        -------
        array
            Numbers i < j, (C, 2).
        """
        if not len(self.axes):
            return np.column_stack(pairs_within(x, radii, factor)[:2])
        x, vectors = self.wrap_positions(x), self.vectors
        reach = factor * 2.0 * np.max(radii)
        low, high = x.min(axis=0) - reach, x.max(axis=0) + reach
        numbers, images = [np.arange(len(x))], [x]
        for turns in product(*((-1, 0, 1) if n in self.axes else (0,) for n in range(3))):
            if any(turns):
                rows = self._at_faces(x, turns, low, high)
                image = x[rows] + np.array(turns) @ vectors
                near = np.all((image > low) & (image < high), axis=1)
                numbers.append(rows[near])
                images.append(image[near])
        number, positions = np.concatenate(numbers), np.concatenate(images)
        if np.ptp(radii) == 0.0:
            i, j = near_pairs(positions, reach)[:2]
        else:
            i, j = pairs_within(positions, radii[number], factor)[:2]
        i, j = number[i[i < len(x)]], number[j[i < len(x)]]
        first, second = np.minimum(i, j)[i != j], np.maximum(i, j)[i != j]
        pairs = np.sort(first * len(x) + second)  # np.unique takes thirty times as long
        return np.column_stack(np.divmod(pairs[np.diff(pairs, prepend=-1) > 0], len(x)))

    def _at_faces(
        self,
        x: NDArray[np.float64],
        turns: tuple[int, ...],
        low: NDArray[np.float64],
        high: NDArray[np.float64],
    ) -> NDArray[np.intp]:
        """Rows whose images by these turns are between two corners along y and z, and x."""
        edges = np.diag(self.vectors) * turns
        sure = [n for n in np.flatnonzero(turns) if n or not self.tilt]
        between = np.ones(len(x), bool)
        for n in sure:  # a turn along z shifts along x too
            between &= (x[:, n] + edges[n] > low[n]) & (x[:, n] + edges[n] < high[n])
        return np.flatnonzero(between)


OPEN = Cell(np.full(3, np.inf))


def find_cell(info: dict[str, Any], materials: Materials) -> Cell:
    """Find the Cell that a sample will be in, as far as it is known before it is built.

    It is that of the file which the sample keeps, that which the scene prescribes, or that with
    which the sample repeats itself, along the periodic axes of the scene alone; a cell that is
    fitted to the sample is known only where that is placed in it.

    Parameters
    ----------
    info
        That of the Sample.
    materials : Materials
        From the scene.
    """
    period, tilt = np.array(materials.period, float), 0.0
    if (room := info.get("room")) is not None:
        low, high = np.reshape(room, (3, 2)).astype(float).T
        period, tilt = np.where(np.isfinite(high - low), high - low, np.inf), info.get("tilt", 0.0)
    elif "period" in info and not materials.cube:
        period = np.where(np.isfinite(period), period, info["period"])
    return Cell(np.where(materials.periodic, period, np.inf), tilt)
