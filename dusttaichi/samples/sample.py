"""What a sample is: grains with positions, velocities and spins, and how to measure it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree


@dataclass(frozen=True)
class Sample:
    """Grains of one size before the first step; everything in SI.

    positions, velocities, spins: float64, shape (N, 3), in m, m/s and rad/s.
    contacts: None, or the state of the pair contacts that exist already:
        i, j (C,) int64; pointer_i, pointer_j (C, 3) unit vectors; twist (C,) [rad];
        approach (C,), carried over exactly as the run that wrote it has defined it.
        None means that contacts are to be found from the distances.
    info: plain numbers and strings that say where the sample comes from.
    """

    positions: np.ndarray
    velocities: np.ndarray
    spins: np.ndarray
    contacts: dict[str, np.ndarray] | None = None
    info: dict[str, int | float | str] = field(default_factory=dict)

    @classmethod
    def at_rest(cls, positions: np.ndarray, info: dict | None = None) -> Sample:
        """Grains that neither move nor spin; positions of shape (N, 3) [m]."""
        positions = np.ascontiguousarray(positions, dtype=np.float64)
        still = np.zeros_like(positions)
        return cls(positions, still, still.copy(), None, dict(info or {}))

    def __len__(self) -> int:
        return len(self.positions)


def extent(sample: Sample, radius: float) -> np.ndarray:
    """Edges of the smallest upright box around the grains, surfaces included, shape (3,) [m]."""
    return np.ptp(sample.positions, axis=0) + 2 * radius


def filling_factor(sample: Sample, radius: float) -> float:
    """Grain volume over the volume of the smallest upright box around the grains (S12 eq 28).

    Grain surfaces are inside the box. A sample whose info names the shape "cylinder" is
    measured by the smallest upright cylinder around the axis x = y = 0 instead.
    """
    width, depth, height = extent(sample, radius)
    area = width * depth
    if sample.info.get("shape") == "cylinder":
        area = np.pi * (np.hypot(*sample.positions[:, :2].T).max() + radius) ** 2
    return float(len(sample) * 4 / 3 * np.pi * radius**3 / (area * height))


def bulk_filling_factor(
    sample: Sample, radius: float, *, side: float = 2.0, bottom: float = 20.0, top: float = 2.0
) -> float:
    """Filling factor away from the surfaces; nan if nothing is left there.

    Counts the grain centres in an upright cylinder in the middle of the sample: unbiased, as
    the chance of a centre to be in it does not depend on where its surface is cut.
    side, bottom, top: what is left out, from the outermost grain centres, in grain radii. The
    bottom's 20 is how far a deposit's denser first layers reach (seen in its profile: 0.20 at
    the floor, some 5 % above the bulk from there on, fading slowly).
    """
    low, high = sample.positions.min(axis=0), sample.positions.max(axis=0)
    floor, ceiling = low[2] + bottom * radius, high[2] - top * radius
    reach = (high - low)[:2].min() / 2 - side * radius
    if reach <= 0 or ceiling <= floor:
        return float("nan")
    off_axis = np.hypot(*(sample.positions - (low + high) / 2)[:, :2].T)
    z = sample.positions[:, 2]
    inside = np.count_nonzero((off_axis < reach) & (z >= floor) & (z < ceiling))
    return float(inside * 4 / 3 * radius**3 / (reach**2 * (ceiling - floor)))


def touching_pairs(positions: np.ndarray, distance: float) -> np.ndarray:
    """Pairs i < j of grains whose centres are no farther apart than distance [m], (C, 2) int."""
    return cKDTree(positions).query_pairs(distance, output_type="ndarray")


def coordination(sample: Sample, distance: float) -> float:
    """Mean number of grains that a grain touches: centres no farther apart than distance [m].

    Walls are not counted.
    """
    return 2 * len(touching_pairs(sample.positions, distance)) / len(sample)
