"""Choice of the particles of a large run that a report shows: a slice, or random ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dusttaichi.results.datasets import read_variables

MOST_SHOWN = 100_000  # particles of a snapshot: more do not turn smoothly
DIMENSIONS = ("grain", "particle")  # of snapshots


@dataclass(frozen=True)
class Selection:
    """Particles that are shown: their numbers, rising, or None for all; text: which, for the page.

    count: number of all particles.
    """

    count: int
    numbers: np.ndarray | None = None
    text: str = ""

    @property
    def size(self) -> int:
        """Number of the shown particles."""
        return self.count if self.numbers is None else len(self.numbers)

    def take(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the shown particles, of those of all (count, ...)."""
        return values if self.numbers is None else values[self.numbers]

    def renumber(self, pairs: NDArray[np.integer]) -> tuple[NDArray[np.bool_], NDArray[np.integer]]:
        """(True for pairs of shown particles (C,), these pairs by the numbers of the shown)."""
        if self.numbers is None:
            return np.ones(len(pairs), dtype=bool), pairs
        rank = np.full(self.count, -1)
        rank[self.numbers] = np.arange(len(self.numbers))
        inside = (rank[pairs] >= 0).all(axis=1)
        return inside, rank[pairs[inside]]

    def read(self, frames: xr.Dataset) -> xr.Dataset:
        """The snapshots (an xarray.Dataset that is read when used) of the shown particles."""
        dimension = next((name for name in DIMENSIONS if name in frames.dims), None)
        if self.numbers is None or dimension is None:
            return read_variables(frames)

        def read(variable: xr.Variable) -> NDArray[Any]:
            if dimension not in variable.dims:
                return variable.values
            if "snapshot" not in variable.dims:
                return self.take(variable.values)
            # a snapshot at a time: a file is slow to read by many single numbers
            snapshots = range(variable.sizes["snapshot"])
            return np.stack([self.take(variable.isel(snapshot=n).values) for n in snapshots])

        return read_variables(frames, read)


def select_particles(
    frames: xr.Dataset, flat: bool = False, max_count: int = MOST_SHOWN
) -> Selection:
    """Select at most `max_count` particles of these snapshots, the same in all.

    Those nearest to the middle plane across y in the last snapshot, so that contacts remain; of a
    flat body (in two dimensions) random ones.
    """
    count = frames.position.shape[1]
    if count <= max_count:
        return Selection(count)
    name = "grains" if "grain" in frames.dims else "particles"
    if flat:
        numbers = np.random.default_rng(1).choice(count, max_count, replace=False)
        return Selection(count, np.sort(numbers), f"{max_count:,} random ones of {count:,} {name}")
    y = frames.position.isel(snapshot=-1).values[:, 1]
    distance = np.abs(y - 0.5 * (y.min() + y.max()))
    numbers = np.sort(np.argpartition(distance, max_count)[:max_count])
    return Selection(count, numbers, f"a slice of {max_count:,} of {count:,} {name}")
