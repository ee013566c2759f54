"""Fractal dimension of a body of grains: counts of grains about those of its core."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dusttaichi.physics.geometry import Floats

LEAST_FRACTAL = 100  # grains: in fewer there is no range of radii to fit a power law to
SHELLS = 8  # radii of the fit
FEWEST_OCTANTS = 4  # about the centre of a body, for the error of its dimension
MOST_DISTANCES = 2e7  # between centres and all grains: below a second


def grains_within(
    positions: Floats, radius: ArrayLike, gyration: float
) -> tuple[Floats, Floats] | None:
    """(R, N), (SHELLS,) each: mean number N of other grains within R of a grain of the core.

    None for bodies that are too small. radius: mean radius of the grains, or (N,); gyration: radius
    of gyration. The core are the grains within gyration/2 of the centre. R is evenly spaced in ln R
    from 3 radii to 3/4 of gyration. All of these spheres are inside of a sphere or cube, so N ~ R^3
    for a homogeneous body, R^2 for a plate, R for a chain, up to the first shells of neighbours.
    """
    counted = _count_about_core(positions, radius, gyration)
    return None if counted is None else (counted[0], counted[2].sum(axis=0) / len(counted[2]))


def fit_fractal_dimension(
    positions: Floats, radius: ArrayLike, gyration: float
) -> tuple[float, float]:
    """(D, its standard error) of N ~ R^D (grains_within); NaN of bodies that are too small.

    The error is that of the mean over the octants about the centre, fitted each by itself.
    """
    counted = _count_about_core(positions, radius, gyration)
    if counted is None:
        return np.nan, np.nan
    radii, apart, counts = counted
    octant = (apart > 0.0) @ np.array([1, 2, 4])
    means = [counts[octant == number].mean(axis=0) for number in np.unique(octant)]
    slopes = [power(radii, mean) for mean in means if mean[0] > 0.0]
    enough = len(slopes) >= FEWEST_OCTANTS
    error = np.std(slopes, ddof=1) / np.sqrt(len(slopes)) if enough else np.inf
    return power(radii, counts.sum(axis=0) / len(counts)), float(error)


def _count_about_core(
    positions: Floats, radius: ArrayLike, gyration: float
) -> tuple[Floats, Floats, Floats] | None:
    """Radii R (SHELLS,), grains of the core from the centre (C, 3), other grains within R of each.

    The last is (C, SHELLS); see grains_within.
    """
    grain_radius, reach = float(np.mean(np.asarray(radius, dtype=float))), gyration / 2
    largest = 1.5 * reach
    if len(positions) < LEAST_FRACTAL or largest < 5 * grain_radius:
        return None
    apart = positions - positions.mean(axis=0)
    core = np.flatnonzero(np.linalg.norm(apart, axis=1) <= reach)
    if len(core) == 0:
        return None
    largest_core = max(20, int(MOST_DISTANCES / len(positions)))
    core = core[:: -(-len(core) // largest_core)]
    radii = np.geomspace(3 * grain_radius, largest, SHELLS)
    counts = np.zeros((len(core), SHELLS))
    x, y, z = np.ascontiguousarray(positions.T)
    for number, centre in enumerate(positions[core]):
        distance = np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2)
        counts[number] = np.searchsorted(np.sort(distance[distance <= largest]), radii, "right") - 1
    return (radii, apart[core], counts) if counts[:, 0].any() else None


def power(x: ArrayLike, y: ArrayLike) -> float:
    """The exponent of y ~ x^D by least squares in the logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
