"""Where the particles of a body stand: triangular rows, hexagonal layers, or a relaxed glass.

Points fill an upright room without a gap: each takes the same volume, so that the mass of what
fills the room is exact. Lattices are stretched by less than half a spacing over the whole room for
that, and go on across periodic faces.
"""

from __future__ import annotations

import numpy as np
import scipy

from dusttaichi.errors import DustError

BYTES = 1000  # a particle takes in memory with its neighbours, some: what limits a sample
MOST_PARTICLES = 2e7
MOST_GLASS = 3e5  # points that are relaxed within minutes
ROUNDS = 60  # of the relaxation
LATTICES = ("triangular", "hexagonal", "glass")


def volume_of(spacing: float, dimension: int) -> float:
    """Volume that one particle takes in a close packing of nearest neighbours `spacing` apart
    [m^2, or m^3]."""
    return spacing**2 * 3**0.5 / 2 if dimension == 2 else spacing**3 / 2**0.5


def check_count(volume: float, spacing: float, dimension: int, where: str) -> None:
    """Raise DustError where a volume [m^2, or m^3] would hold more particles than memory should."""
    count = volume / volume_of(spacing, dimension)
    if count > MOST_PARTICLES:
        raise DustError(
            f"{where}: it would have {count:.1e} particles, some {count * BYTES / 1e9:.0f} GB; "
            f"allowed: {MOST_PARTICLES:.0e}. Take a longer numerics.spacing or a smaller body."
        )
    if count < 1:
        raise DustError(
            f"{where}: it is smaller than one particle (numerics.spacing = {spacing * 1e6:g} µm); "
            "take a shorter spacing or a larger body."
        )


def fill(size, spacing: float, lattice: str, seed: int = 1) -> np.ndarray:
    """Points that fill a room of edges `size` [m], (2,) or (3,), about its middle; (N, 2 or 3).

    lattice: "triangular" (rows, in two dimensions), "hexagonal" (hcp in three), "glass" (points at
    random that have pushed each other apart, periodic). Raises DustError for too many.
    """
    size = np.asarray(size, dtype=np.float64)
    if lattice == "glass":
        return glass(size, spacing, seed)
    return _rows(size, spacing) if len(size) == 2 else _layers(size, spacing)


def _whole(length: float, pitch: float, even: bool) -> int:
    """How many of a pitch a length takes, rounded; an even number where there is room for two."""
    count = length / pitch
    return max(1, 2 * round(count / 2)) if even and count > 1.5 else max(1, round(count))


def _rows(size, spacing):
    across = _whole(size[0], spacing, even=False)
    up = _whole(size[1], spacing * 3**0.5 / 2, even=True)
    i, j = np.meshgrid(np.arange(across), np.arange(up), indexing="ij")
    # rows a quarter to the left and to the right: both ends alike
    x = (i + 0.25 + 0.5 * (j % 2)) / across
    z = (j + 0.5) / up
    return (np.stack([x.ravel(), z.ravel()], axis=1) - 0.5) * size


def _layers(size, spacing):
    across = _whole(size[0], spacing, even=False)
    along = _whole(size[1], spacing * 3**0.5 / 2, even=True)
    up = _whole(size[2], spacing * (2 / 3) ** 0.5, even=True)
    i, j, k = np.meshgrid(*(np.arange(n) for n in (across, along, up)), indexing="ij")
    x = (i + 0.25 + 0.5 * ((j + k) % 2)) / across
    y = (j + 1 / 3 + (k % 2) / 3) / along
    z = (k + 0.5) / up
    return (np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1) - 0.5) * size


def glass(size, spacing: float, seed: int) -> np.ndarray:
    """Points at random, relaxed in a periodic room: each pushes its neighbours away.

    They are as many as the close packing of that spacing has. Raises DustError for more than
    MOST_GLASS.
    """
    dimension = len(size)
    volume = float(np.prod(size))
    count = max(1, round(volume / volume_of(spacing, dimension)))
    if count > MOST_GLASS:
        raise DustError(
            f"sample.lattice: a glass of {count} points would take too long to relax; allowed: "
            f"{MOST_GLASS:.0e} points. Take lattice: hexagonal, or a longer numerics.spacing."
        )
    rng = np.random.Generator(np.random.PCG64(seed))
    points = rng.random((count, dimension)) * size
    reach = 1.5 * spacing
    if count < 3 or reach >= size.min() / 2:
        return points - size / 2
    for number in range(ROUNDS):
        points = _pushed(points, size, reach, spacing * 0.5 * (1 - number / ROUNDS))
    return points - size / 2


def _pushed(points, size, reach, most):
    """The points after a push by their neighbours, none by more than `most` [m]."""
    tree = scipy.spatial.cKDTree(points, boxsize=size)
    pairs = tree.query_pairs(reach, output_type="ndarray")
    i, j = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
    apart = points[i] - points[j]
    apart -= size * np.round(apart / size)
    distance = np.maximum(np.linalg.norm(apart, axis=1), 1e-12 * reach)
    push = (reach * (1 - distance / reach) ** 2 / distance)[:, None] * apart
    total = np.zeros_like(points)
    np.add.at(total, i, push)
    np.add.at(total, j, -push)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    step = total * np.minimum(0.3, most / np.maximum(length, 1e-30))
    moved = np.mod(points + step, size)
    return np.where(moved >= size, 0.0, moved)


def ball(diameter: float, spacing: float, lattice: str, dimension: int, seed: int = 1):
    """Points inside a disc or sphere about the origin, (N, 2 or 3).

    Of some places for the middle, on a particle and between particles, that whose number of points
    is nearest to the volume. At least one point.
    """
    edge = diameter + 6 * spacing
    cube = fill(np.full(dimension, edge), spacing, lattice, seed)
    near = cube[np.argsort(np.linalg.norm(cube, axis=1), kind="stable")[: 2 * dimension + 2]]
    exact = np.pi / 4 * diameter**2 if dimension == 2 else np.pi / 6 * diameter**3
    exact /= edge**dimension / len(cube)
    best = None
    for middle in (near[0], near[:2].mean(axis=0), near[: dimension + 1].mean(axis=0)):
        inside = cube[np.linalg.norm(cube - middle, axis=1) <= diameter / 2] - middle
        if len(inside) and (best is None or abs(len(inside) - exact) < abs(len(best) - exact)):
            best = inside
    return best if best is not None else np.zeros((1, dimension))


def upright(diameter: float, height: float, spacing: float, lattice: str, dimension: int):
    """Points inside an upright cylinder about the origin, in two dimensions a rectangle."""
    if dimension == 2:
        return fill((diameter, height), spacing, lattice)
    edge = diameter + 4 * spacing
    block = fill((edge, edge, height), spacing, lattice)
    inside = block[np.hypot(block[:, 0], block[:, 1]) <= diameter / 2]
    return inside if len(inside) else np.zeros((1, 3))
