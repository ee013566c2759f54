"""Positions of the particles of a body: triangular rows, hexagonal layers, or a relaxed glass.

Points fill an upright box completely: all have the same volume, so that the mass of the box is
exact. For that, lattices are stretched by less than half a spacing over the whole box, and they
continue across periodic faces.
"""

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.physics.near import near_pairs
from dusttaichi.scene.making import report_progress

BYTES = 1000  # approximate memory of a particle with its neighbours, which limits a sample
MOST_PARTICLES = 2e7
MOST_GLASS = 1e6  # points, relaxed in five minutes
ROUNDS = 60  # of the relaxation


def volume_of(spacing: float, dimension: int) -> float:
    """Volume of a particle in a close packing of this spacing [m^2, or m^3]."""
    return spacing**2 * 3**0.5 / 2 if dimension == 2 else spacing**3 / 2**0.5


def sphere_volume(diameter: float, dimension: int) -> float:
    """Area of a disc [m^2], or volume of a sphere [m^3]."""
    return np.pi / 4 * diameter**2 if dimension == 2 else np.pi / 6 * diameter**3


def check_count(volume: float, spacing: float, dimension: int, path: str) -> None:
    """Raise DustError for a volume [m^2, or m^3] with too many particles, or less than one."""
    count = volume / volume_of(spacing, dimension)
    if count > MOST_PARTICLES:
        raise DustError(
            f"{path}: it would have {count:.1e} particles, about {count * BYTES / 1e9:.0f} GB; "
            f"allowed: {MOST_PARTICLES:.0e}. Use a longer numerics.spacing or a smaller body."
        )
    if count < 1:
        raise DustError(
            f"{path}: it is smaller than one particle (numerics.spacing = {spacing * 1e6:g} µm); "
            "use a shorter spacing or a larger body."
        )


def fill(size, spacing: float, lattice: str = "auto", seed: int = 1) -> np.ndarray:
    """Points that fill a box of edges `size` [m], (2,) or (3,), about its middle; (N, 2 or 3).

    lattice: "glass" (relaxed random points, periodic), otherwise the lattice of the dimension:
    triangular (rows) in two, hexagonal (hcp) in three. Raises DustError for too many points.
    """
    size = np.asarray(size, dtype=np.float64)
    if lattice == "glass":
        return glass(size, spacing, seed)
    return _rows(size, spacing) if len(size) == 2 else _layers(size, spacing)


def _whole(length: float, pitch: float, even: bool) -> int:
    """Number of pitches in a length, rounded, at least one; even if two fit."""
    count = length / pitch
    return max(1, 2 * round(count / 2)) if even and count > 1.5 else max(1, round(count))


def _rows(size, spacing):
    across = _whole(size[0], spacing, even=False)
    up = _whole(size[1], spacing * 3**0.5 / 2, even=True)
    i, j = np.meshgrid(np.arange(across), np.arange(up), indexing="ij")
    # rows are shifted by a quarter to the left and to the right, so that both ends are equal
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
    """Random points, relaxed in a periodic box by mutual repulsion.

    Their number is that of the close packing of that spacing. Raises DustError for more than
    MOST_GLASS.
    """
    dimension = len(size)
    volume = float(np.prod(size))
    count = max(1, round(volume / volume_of(spacing, dimension)))
    if count > MOST_GLASS:
        raise DustError(
            f"sample.lattice: a glass of {count} points would take too long to relax; allowed: "
            f"{MOST_GLASS:.0e} points. Use lattice: hexagonal, or a longer numerics.spacing."
        )
    rng = np.random.Generator(np.random.PCG64(seed))
    points = rng.random((count, dimension)) * size
    reach = 1.5 * spacing
    if count < 3 or reach >= size.min() / 2:
        return points - size / 2
    for number in range(ROUNDS):
        report_progress(number, ROUNDS)
        points = _push_apart(points, size, reach, spacing * 0.5 * (1 - number / ROUNDS))
    return points - size / 2


def _push_apart(points, size, reach, largest):
    """The points after a push by their neighbours, none by more than `largest` [m]."""
    i, j, _ = near_pairs(points, reach, size)
    keys = np.sort(i * len(points) + j)
    i, j = np.divmod(keys, len(points))
    push = points[i] - points[j]
    push -= size * np.round(push / size)
    distance = np.maximum(np.linalg.norm(push, axis=1), 1e-12 * reach)
    push *= (reach * (1 - distance / reach) ** 2 / distance)[:, None]
    both, count = np.concatenate([i, j]), len(points)
    total = np.stack(
        [np.bincount(both, np.concatenate([along, -along]), count) for along in push.T], axis=1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    step = total * np.minimum(0.3, largest / np.maximum(length, 1e-30))
    moved = np.mod(points + step, size)
    return np.where(moved >= size, 0.0, moved)


def hollow_sphere(spec, matter, path: str, lattice: str = "auto", seed: int = 1):
    """Points (N, 2 or 3) of a sphere (spec.diameter, spec.hole), and its volume [m^2, or m^3].

    Raises DustError as check_count.
    """
    dimension = matter.dimension
    volume = sphere_volume(spec.diameter, dimension) - sphere_volume(spec.hole, dimension)
    check_count(volume, matter.spacing, dimension, path)
    if lattice == "circles":
        return circles(spec.diameter, spec.hole, matter.spacing), float(volume)
    points = sphere(spec.diameter, matter.spacing, dimension, lattice, seed)
    return points[np.linalg.norm(points, axis=1) >= spec.hole / 2], float(volume)


def sphere(diameter: float, spacing: float, dimension: int, lattice: str = "auto", seed: int = 1):
    """Points inside a disc or sphere about the origin, (N, 2 or 3), at least one.

    The centre is on a particle or between particles, whichever gives the best number of points.
    """
    edge = diameter + 6 * spacing
    cube = fill(np.full(dimension, edge), spacing, lattice, seed)
    near = cube[np.argsort(np.linalg.norm(cube, axis=1), kind="stable")[: 2 * dimension + 2]]
    exact = sphere_volume(diameter, dimension) / (edge**dimension / len(cube))
    best = None
    for middle in (near[0], near[:2].mean(axis=0), near[: dimension + 1].mean(axis=0)):
        inside = cube[np.linalg.norm(cube - middle, axis=1) <= diameter / 2] - middle
        if len(inside) and (best is None or abs(len(inside) - exact) < abs(len(best) - exact)):
            best = inside
    return best if best is not None else np.zeros((1, dimension))


def circles(diameter: float, hole: float, spacing: float) -> np.ndarray:
    """Points (N, 2) on concentric circles of a disc or ring about the origin.

    Rims are half a distance of neighbouring circles away; a disc has a point in its middle.
    """
    pitch = spacing * 3**0.25 / 2**0.5  # a square of that edge is as large as a particle
    inner, outer = hole / 2, diameter / 2
    if hole:
        count = max(1, round((outer - inner) / pitch))
        pitch = (outer - inner) / count
        radii = inner + pitch * (np.arange(count) + 0.5)
    else:
        count = max(0, round(outer / pitch - 0.5))
        pitch = outer / (count + 0.5)
        radii = pitch * np.arange(count + 1)
    along = volume_of(spacing, 2) / pitch
    out = []
    for number, radius in enumerate(radii):
        points = max(1, round(2 * np.pi * radius / along))
        angle = 2 * np.pi * (np.arange(points) + 0.5 * (number % 2)) / points
        out.append(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return np.concatenate(out)


def cylinder(diameter: float, height: float, spacing: float, dimension: int):
    """Points inside an upright cylinder about the origin, in two dimensions a rectangle."""
    if dimension == 2:
        return fill((diameter, height), spacing)
    edge = diameter + 4 * spacing
    block = fill((edge, edge, height), spacing)
    inside = block[np.hypot(block[:, 0], block[:, 1]) <= diameter / 2]
    return inside if len(inside) else np.zeros((1, 3))
