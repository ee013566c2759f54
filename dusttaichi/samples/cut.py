"""A box or an upright cylinder cut from a larger body, and its connected fragments."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import label_components
from dusttaichi.samples.sample import Sample, extent
from dusttaichi.samples.values import edges_of, exactly_one, shape_of
from dusttaichi.scene.fields import Faults

ADVICE = "Use fewer grains, a smaller size, or an aspect closer to 1."


def faults(block: Any) -> Faults:
    """Conflicts between grains, size, shape and aspect of a block that cuts."""
    yield from exactly_one(block, ("grains", "size"), "grains: 1000")
    if block.size is not None and shape_of(block.size) != block.shape:
        messages = {
            "box": 'a list of 3 lengths is needed with shape "box", for example '
            '["40 um", "40 um", "40 um"]',
            "cylinder": 'diameter and height are needed with shape "cylinder", for example '
            "{diameter: 13.2 um, height: 20 um}",
            "aggregate": 'it is not allowed with shape "aggregate", of which nothing is cut; '
            "set grains, or shape: box or cylinder",
        }
        yield "size", messages[block.shape]
    if block.size is not None and block.aspect != 1.0:
        yield "aspect", "it is allowed only together with grains"


def proportions(spec: Any, radius: float | NDArray[np.float64]) -> np.ndarray:
    """Edges (x, y, z) of the cut [m], shape (3,); with a number of grains only their ratio matters.

    spec: shape, and size or aspect, of the scene. Raises DustError for a size too small for a
    grain.
    """
    if spec.size is None:
        return np.array([1.0, 1.0, spec.aspect])
    size = np.array(edges_of(spec.size), dtype=np.float64)
    check_size(size, radius)
    return size


def check_size(size: np.ndarray, radius: float | NDArray[np.float64]) -> None:
    """Raise DustError for a size (3,) [m] that no grain fits into."""
    if not (np.asarray(size) >= 2 * radius).all():
        raise DustError(
            f"sample.size: {in_um(size)} is too small for a grain; allowed: at least one grain "
            f"diameter, {2e6 * radius:g} µm, in each direction."
        )


def in_um(size: ArrayLike) -> str:
    return " x ".join(f"{1e6 * edge:g}" for edge in np.asarray(size, float)) + " µm"


def nothing_inside(size: ArrayLike, radius: float, seed: int) -> DustError:
    return DustError(
        f"sample.size: {in_um(size)} contains no whole grain of radius {radius * 1e6:g} µm with "
        f"seed {seed}; allowed: a larger size or another seed."
    )


def scale(
    positions: NDArray[np.float64],
    shape: str,
    edges: NDArray[np.float64],
    radius: float | NDArray[np.float64],
    *,
    centred: bool = False,
) -> np.ndarray:
    """Factors (N,) on the edges of the cut with which each grain is just inside.

    The cut's axis is x = y = 0. Its bottom is at z = 0, or with `centred` its middle.
    """
    width, depth, height = edges
    x, y, z = positions.T
    upwards = 2 * (np.abs(z) + radius) / height if centred else (z + radius) / height
    if shape == "cylinder":
        sideways = (np.sqrt(x**2 + y**2) + radius) / width
    else:
        sideways = np.maximum((np.abs(x) + radius) / width, (np.abs(y) + radius) / depth)
    factors: NDArray[np.float64] = np.maximum(2 * sideways, upwards)
    return factors


def measures(
    sample: Sample,
    grains: Any,
    radii: float | NDArray[np.float64],
    period: ArrayLike | None = None,
    on_floor: bool = False,
) -> dict[str, Any]:
    """Connected fragments and edges of a sample, for its info; on_floor: those that lie on z = 0.

    grains: mixture.Grains, radii: theirs, or one number [m]; period: edges (3,) [m] of a periodic
    cell.
    """
    pairs = grains.touching(sample.positions, period)
    fragment_count, labels = label_components(pairs, len(sample))
    info = {"pieces": int(fragment_count), "largest_piece": int(np.bincount(labels).max())}
    if on_floor:
        lowest = sample.positions[:, 2] == radii
        is_supported = np.zeros(fragment_count, dtype=bool)
        is_supported[labels[lowest]] = True
        info |= {
            "floor_grains": int(np.count_nonzero(lowest)),
            "loose_fragments": int(np.count_nonzero(~is_supported)),
            "loose_grains": int(np.count_nonzero(~is_supported[labels])),
        }
    edges = extent(sample, radii).tolist()
    return info | dict(zip(("width", "depth", "height"), edges, strict=True))
