"""Measures of a sample: contacts, fragments, sizes and filling factor, with images in a cell."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.physics.geometry import AXES, heaviest_first, label_components, pairs_within
from dusttaichi.physics.unwrap import crossings, unwrap_fragments
from dusttaichi.samples.extraction import FARTHEST
from dusttaichi.samples.images import OPEN, Cell
from dusttaichi.samples.sample import (
    Sample,
    extent,
    filling_factor,
    fractal_dimension,
    radius_of_gyration,
    touching_pairs,
    volume,
)

# keys that a sample has in one cell and not in another
OPTIONAL = ("radius_of_gyration", "fractal_dimension")


def describe(
    sample: Sample, radius: float | NDArray[np.float64], touch: float | None, cell: Cell = OPEN
) -> dict[str, Any]:
    """Measures of any sample, for its info.

    In a periodic cell, extent, radius of gyration and fractal dimension are those of the largest
    fragment, in one piece and not cut by the faces. One that is connected to its own images
    percolates: it extends over the cell along these axes and has no radius of gyration.

    Parameters
    ----------
    sample
    radius : float or array
        Radii of the grains [m].
    touch
        Largest distance of the centres of grains in contact [m]; None: the sum of their radii.
    cell
        Periodic cell of the sample.

    Returns
    -------
    dict
        filling_factor, filling_factor_in (its volume), extent (3 numbers, m), coordination,
        network, and radius_of_gyration [m] and fractal_dimension if there is one. network has the
        numbers of `contacts` and `fragments`; of fragments that percolate, where there are any, the
        number `percolating` and their axes `along`, "x y z".
    """
    pairs = pairs_in_contact(sample, touch, radius, cell)
    number, label = label_components(pairs, len(sample))
    info: dict[str, Any] = {
        "filling_factor": filling_factor(sample, radius, cell),
        "filling_factor_in": volume(sample, radius, cell)[1],
        "coordination": 2 * len(pairs) / len(sample),
        "network": {"contacts": len(pairs), "fragments": number},
    }
    body, body_radius, across = sample, radius, np.zeros(3, bool)
    if len(cell.axes):
        x = unwrap_fragments(sample.positions, pairs, _find_first_grains(label), cell.nearest)
        percolates = _find_percolation(x, pairs, label, cell)
        if percolates.any():
            info["network"]["percolating"] = int(percolates.any(axis=1).sum())
            info["network"]["along"] = _join_names(np.any(percolates, axis=0))
        volumes = np.broadcast_to(radius, len(sample)) ** 3
        largest = heaviest_first(label, volumes)[0]
        rows, across = label == largest, percolates[largest]
        body = Sample.at_rest(x[rows])
        body_radius = np.asarray(radius)[rows] if np.ndim(radius) else radius
    info["extent"] = np.where(across, cell.period, extent(body, body_radius)).tolist()
    if not across.any():
        info["radius_of_gyration"] = radius_of_gyration(body, body_radius)
        dimension = fractal_dimension(body, body_radius)
        if np.isfinite(dimension):
            info["fractal_dimension"] = dimension
    return info


def pairs_in_contact(
    sample: Sample,
    distance: float | None,
    radius: float | NDArray[np.float64] | None = None,
    cell: Cell = OPEN,
) -> np.ndarray:
    """Pairs (C, 2) of grains in contact, with periodic images; arguments as of `coordination`."""
    if len(cell.axes):
        radii = np.broadcast_to(np.asarray(radius), len(sample)).astype(float)
        pairs = cell.pairs(sample.positions, radii)
    elif distance is None:
        pairs = np.column_stack(pairs_within(sample.positions, np.asarray(radius))[:2])
    else:
        pairs = touching_pairs(sample.positions, distance)
    if sample.stored_pairs is None:
        return pairs
    stored = np.sort(sample.stored_pairs, axis=1)
    if radius is not None:  # without those across the faces of another cell
        apart = sample.positions[stored[:, 0]] - sample.positions[stored[:, 1]]
        both = np.broadcast_to(radius, len(sample))[stored].sum(axis=1)
        stored = stored[np.linalg.norm(cell.nearest(apart), axis=1) <= FARTHEST * both]
    return np.unique(np.concatenate([pairs, stored]), axis=0)


def coordination(
    sample: Sample,
    distance: float | None,
    radius: float | NDArray[np.float64] | None = None,
    cell: Cell = OPEN,
) -> float:
    """Mean number of contacts of a grain.

    Contacts of the sample's file are included, as far as a contact can be stretched. Walls are not.

    Parameters
    ----------
    sample
    distance
        Largest distance of the centres of grains in contact [m]; None: the sum of their radii.
    radius : float or array
        Radii of the grains [m].
    cell
        Periodic cell of the sample.
    """
    return 2 * len(pairs_in_contact(sample, distance, radius, cell)) / len(sample)


def describe_in_cell(
    sample: Sample, radius: float | NDArray[np.float64], cell: Cell = OPEN
) -> Sample:
    """Describe a sample in a cell: the sample with its measures as info.

    Parameters
    ----------
    sample
    radius : float or array
        Radii of the grains [m].
    cell
        Periodic cell of the sample.
    """
    # grains that overlap at the start are in contact
    touch = None if np.ndim(radius) else 2 * float(radius)
    info = {name: value for name, value in sample.info.items() if name not in OPTIONAL}
    info |= describe(sample, radius, touch, cell)
    if "touching" in info:  # now with the images
        counts = {name: info["network"][name] for name in ("contacts", "fragments")}
        info["touching"] = info["touching"] | counts | {"text": format_counts(info["network"])}
    return replace(sample, info=info)


def format_counts(network: dict[str, Any]) -> str:
    """Format the contacts and fragments of `network`, as "4 contacts in 1 fragment"."""
    counts = ((network["contacts"], "contact"), (network["fragments"], "fragment"))
    return " in ".join(f"{n:,} {word}{'s' * (n != 1)}" for n, word in counts)


def cut_contacts(
    sample: Sample, radius: float | NDArray[np.float64], cell: Cell, other_cell: Cell, factor: float
) -> tuple[int, int]:
    """Count (contacts that are not in `other_cell`, all contacts) of a sample in its own cell.

    factor: distance over the sum of two radii, up to which grains count as touching.
    """
    radii = np.broadcast_to(radius, len(sample)).astype(float)
    pairs = cell.pairs(sample.positions, radii, factor)
    if sample.contacts is not None:
        pairs = pairs_in_contact(sample, None, radii, cell)
    i, j = pairs.T
    apart = np.linalg.norm(other_cell.nearest(sample.positions[i] - sample.positions[j]), axis=1)
    return int(np.count_nonzero(apart > FARTHEST * (radii[i] + radii[j]))), len(pairs)


def _find_first_grains(label: NDArray[np.integer]) -> NDArray[np.integer]:
    """Find the first grain of each fragment, numbered in the order of these grains."""
    return np.flatnonzero(np.diff(np.maximum.accumulate(label), prepend=-1))


def _find_percolation(
    x: NDArray[np.float64], pairs: NDArray[np.integer], label: NDArray[np.integer], cell: Cell
) -> NDArray[np.bool_]:
    """(F, 3) bool: axes along which each unwrapped fragment is connected to its images."""
    out = np.zeros((label.max() + 1, 3), bool)
    rows, axes = np.nonzero(crossings(x, pairs, cell.nearest, cell.period, cell.tilt))
    out[label[pairs[rows, 0]], axes] = True
    return out


def _join_names(axes: Any) -> str:
    return " ".join(name for name, is_present in zip(AXES, axes, strict=True) if is_present)
