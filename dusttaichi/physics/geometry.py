"""Geometry of samples: axes and walls, projections, volumes, neighbours (NumPy and SciPy).

Lengths are in any common unit. Positions are (N, 3), in the order x, y, z.
"""

from typing import Any, Literal, get_args

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
AxisName = Literal["x", "y", "z"]
WallName = Literal["x_min", "x_max", "y_min", "y_max", "bottom", "top"]
AXES: tuple[AxisName, ...] = get_args(AxisName)
WALLS: tuple[WallName, ...] = get_args(WallName)
LYING = "lying cylinder"  # shape of a sample between two plates


def dot_rows(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scalar products of vectors (n, 3), (n,): the bits of np.sum(a * b, axis=1), in less time."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def measure_rows(a: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths of vectors (n, 3), (n,): the bits of np.linalg.norm(a, axis=1), in less time."""
    lengths: NDArray[np.float64] = np.sqrt(dot_rows(a, a))
    return lengths


def nearest_image(d: ArrayLike, period: ArrayLike, tilt: float = 0.0) -> NDArray[np.float64]:
    """Distance vectors (..., 3) to the nearest image.

    period: edges of the cell (3,), inf along axes that are not periodic. tilt: shift of the image
    above along x.
    """
    vectors, edges = np.array(d, float), np.asarray(period)
    for n in (2, 1, 0):
        if np.isfinite(edges[n]):
            count = np.round(vectors[..., n] / edges[n])
            vectors[..., n] -= edges[n] * count
            if n == 2 and tilt:
                vectors[..., 0] -= tilt * count
    return vectors


def pairs_within(
    positions: Floats, radii: Floats, factor: float = 1.0, period: ArrayLike | None = None
) -> tuple[NDArray[Any], ...]:
    """Pairs i < j no farther apart than `factor` times the sum of their radii: i, j, distance.

    positions: (N, D); radii: (N,); period: edges (D,) of a periodic cell around the positions. The
    search is by octaves of the radii, so that large ones do not extend the search of small ones.
    """
    octave = np.floor(np.log2(radii / np.min(radii))).astype(int)
    groups = [np.flatnonzero(octave == k) for k in np.unique(octave)]
    trees = [scipy.spatial.cKDTree(positions[group], boxsize=period) for group in groups]
    pairs = []
    for a, members in enumerate(groups):
        for b in range(a, len(groups)):
            reach = factor * (radii[members].max() + radii[groups[b]].max())
            near = trees[a].sparse_distance_matrix(trees[b], reach, output_type="ndarray")
            i, j, distance = members[near["i"]], groups[b][near["j"]], near["v"]
            keep = distance <= factor * (radii[i] + radii[j])
            keep &= i < j if a == b else True
            pairs.append((np.minimum(i, j)[keep], np.maximum(i, j)[keep], distance[keep]))
    return tuple(np.concatenate(columns) for columns in zip(*pairs, strict=True))


def union_area(centres, radius):
    """Area of the union of discs [length^2], exact to rounding.

    centres: (N, 2). radius: of every disc, or (N,). The boundary of the union is made of the arcs
    that no other disc covers; Green's theorem, area = 1/2 of the integral of (x dy - y dx) along
    them, gives the area with its holes left out. N log N for a bounded number of overlaps a disc.
    """
    centres = np.asarray(centres, dtype=float).reshape(-1, 2)
    if np.ndim(radius):
        return _union_unequal(centres, np.asarray(radius, dtype=float))
    if not len(centres) or radius <= 0:
        return 0.0
    centres = np.unique(centres, axis=0)  # a disc twice would cover its own boundary
    unit = (centres - centres.mean(axis=0)) / radius
    i, j = scipy.spatial.cKDTree(unit).query_pairs(2.0, output_type="ndarray").T
    owner = np.concatenate([i, j])
    towards = unit[np.concatenate([j, i])] - unit[owner]
    half = np.arccos(np.minimum(0.5 * np.hypot(*towards.T), 1.0))
    disc, start, end = _free_arcs(len(unit), owner, towards, half)
    x, y = unit[disc].T
    integral = end - start
    integral += x * (np.sin(end) - np.sin(start)) - y * (np.cos(end) - np.cos(start))
    return 0.5 * radius**2 * float(integral.sum())


def _union_unequal(centres, radius):
    """Area of the union of discs of radii (N,), without those that are inside another one."""
    sound = radius > 0.0
    if not sound.any():
        return 0.0
    rows = np.unique(np.column_stack([centres, radius])[sound], axis=0)
    centres, r = rows[:, :2] - rows[:, :2].mean(axis=0), rows[:, 2]
    i, j, distance = pairs_within(centres, r)
    within = distance <= np.abs(r[i] - r[j])
    hidden = np.zeros(len(r), dtype=bool)
    hidden[np.where(r[i] < r[j], i, j)[within]] = True
    keep = ~(within | hidden[i] | hidden[j])
    i, j = i[keep], j[keep]
    owner, neighbour = np.concatenate([i, j]), np.concatenate([j, i])
    towards, d = centres[neighbour] - centres[owner], np.tile(distance[keep], 2)
    cosine = (d**2 + (r[owner] - r[neighbour]) * (r[owner] + r[neighbour])) / (2.0 * d * r[owner])
    disc, start, end = _free_arcs(len(r), owner, towards, np.arccos(np.clip(cosine, -1.0, 1.0)))
    open_ = ~hidden[disc]
    disc, start, end = disc[open_], start[open_], end[open_]
    x, y = centres[disc].T
    integral = r[disc] * (end - start)
    integral += x * (np.sin(end) - np.sin(start)) - y * (np.cos(end) - np.cos(start))
    return 0.5 * float(np.sum(r[disc] * integral))


def _free_arcs(count, owner, towards, half):
    """Arcs of `count` circles that no other disc covers: (disc, start, end), each (arcs,).

    owner, towards, half: circle, direction (x, y) of the middle and half angle of covered arcs.
    """
    middle = np.arctan2(towards[:, 1], towards[:, 0])
    start, end = (middle - half) % (2 * np.pi), (middle + half) % (2 * np.pi)
    # an arc over angle 0 is split; an empty one at either end of each circle closes the list
    over = start > end
    every = np.arange(count)
    disc = np.concatenate([owner, owner[over], every, every])
    first, last = np.zeros(len(every)), np.full(len(every), 2 * np.pi)
    starts = np.concatenate([start, np.zeros(over.sum()), first, last])
    ends = np.concatenate([np.where(over, 2 * np.pi, end), end[over], first, last])
    order = np.argsort(disc * len(disc) + _ranks(starts))
    # the largest end so far on each circle, as a running maximum that grows with the circle
    furthest = np.maximum.accumulate((disc * len(disc) + _ranks(ends))[order])
    reached = np.sort(ends)[furthest % len(disc)]
    disc, starts = disc[order], starts[order]
    free = (disc[1:] == disc[:-1]) & (starts[1:] > reached[:-1])
    return disc[1:][free], reached[:-1][free], starts[1:][free]


def _ranks(values):
    """Ranks of values, with which a sort by two keys becomes one of integers."""
    ranks = np.empty(len(values), dtype=np.int64)
    ranks[np.argsort(values)] = np.arange(len(values))
    return ranks


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def cylinder_volume(
    positions: Floats, radius: Any, axis_xy: Floats, cylinder_radius: float, *, low: Any, high: Any
) -> float:
    """Volume of spheres inside an upright cylinder [length^3].

    positions: (N, 3) centres. radius: of every sphere, or (N,). axis_xy: (x, y) of the axis. The
    cylinder extends from z = low to z = high. Overlaps of spheres are counted twice (grains in
    contact overlap by 1e-4 of their radius). Spheres wholly within the mantle are exact; for the
    others the area of the lens of two circles is integrated over z between the heights where its
    form changes, by Gauss-Legendre with nodes concentrated at the ends: error below 1e-10 of the
    volume of a sphere for each sphere that the mantle cuts.
    """
    positions = np.asarray(positions, dtype=float).reshape(-1, 3)
    low, high = ((z - positions[:, 2]).clip(-radius, radius) for z in (low, high))
    distance = np.hypot(*(positions[:, :2] - np.asarray(axis_xy, float)).T)
    inside = distance + radius <= cylinder_radius
    cut = ~inside & (distance < cylinder_radius + radius) & (high > low)
    uncut_volumes = np.maximum(_sphere_below(high, radius) - _sphere_below(low, radius), 0.0)
    volume = uncut_volumes[inside].sum()
    radius = radius[cut][:, None] if np.ndim(radius) else radius
    return float(volume + _cut_volume(low[cut], high[cut], distance[cut], radius, cylinder_radius))


def _sphere_below(height, radius):
    """Volume of a sphere below a plane at `height` above its centre, |height| <= radius."""
    return np.pi * (radius**2 * height - height**3 / 3 + 2 / 3 * radius**3)


def _cut_volume(low, high, distance, radius, cylinder_radius):
    """Volume of n spheres between heights `low` and `high` of their centres and inside a mantle.

    low, high, distance (of the axis): (n,). radius: of all, or (n, 1).
    """

    def height_of(section):  # at which the section of the sphere has this radius; 0 if none has
        return np.sqrt(np.maximum(radius**2 - section**2, 0.0))

    low, high, distance = low[:, None], high[:, None], distance[:, None]
    outer, inner = height_of(distance - cylinder_radius), height_of(distance + cylinder_radius)
    edges = np.stack([low, -outer, -inner, inner, outer, high]).clip(low, high)
    angle = 0.5 * np.pi * (_NODES + 1)
    step = np.diff(edges, axis=0)
    z = edges[:-1] + 0.5 * step * (1 - np.cos(angle))
    weight = 0.25 * np.pi * step * np.sin(angle) * _WEIGHTS
    section = np.sqrt(np.maximum(radius**2 - z**2, 0.0))
    return np.sum(weight * lens_area(section, cylinder_radius, distance))


def lens_area(r1, r2, distance):
    """Area common to two circles of radii `r1`, `r2` (arrays, broadcast) [length^2]."""
    r1, r2, d = np.broadcast_arrays(*(np.asarray(a, float) for a in (r1, r2, distance)))
    apart = d >= r1 + r2
    within = d <= np.abs(r1 - r2)
    d = np.where(d > 0, d, 1.0)  # concentric circles are `within`
    heron = (r1 + r2 + d) * (r1 + r2 - d) * (d + r1 - r2) * (d - r1 + r2)
    chord = np.sqrt(np.maximum(heron, 0.0)) / (2 * d)  # half of it
    difference = (r1 - r2) * (r1 + r2) / (2 * d)
    angle1 = np.arctan2(chord, 0.5 * d + difference)
    angle2 = np.arctan2(chord, 0.5 * d - difference)
    both = r1**2 * (angle1 - 0.5 * np.sin(2 * angle1))
    both += r2**2 * (angle2 - 0.5 * np.sin(2 * angle2))
    return np.where(apart, 0.0, np.where(within, np.pi * np.minimum(r1, r2) ** 2, both))


def neighbours_within(
    positions: ArrayLike, radii_in: ArrayLike, period: Any = None, largest_number: int | None = None
) -> Floats:
    """Mean number of other grains whose centre is nearer than r_in to that of a grain.

    N(r < r_in) of T19 section 4.1 (Fig 10), without the central grain. positions: (N, 3). radii_in,
    result: (radii,). period: edge of the cell along each axis, NaN or None where it is not
    periodic; all images are counted, also a grain's own, so r_in may exceed the cell.
    largest_number: of central grains, random ones of more; None for all.
    """
    positions = np.asarray(positions, dtype=float).reshape(-1, 3)
    radii = np.atleast_1d(np.asarray(radii_in, dtype=float))
    if not len(positions):
        return np.zeros(len(radii))
    lengths = (None,) * 3 if period is None else period
    edges = np.array([np.nan if edge is None else edge for edge in lengths], dtype=float)
    order = np.argsort(radii)  # cKDTree also counts equal distances
    nearer = np.nextafter(radii[order], -np.inf).clip(min=0.0)
    centres, images = _with_images(positions, edges, nearer.max(initial=0.0))
    if largest_number is not None and len(centres) > largest_number:
        centres = np.random.default_rng(1).choice(centres, largest_number, replace=False)
    tree, image_tree = (scipy.spatial.cKDTree(points) for points in (centres, images))
    pair_counts = tree.count_neighbors(image_tree, nearer)
    counts = np.empty(len(radii))
    counts[order] = pair_counts / len(centres) - 1.0
    return counts


def _with_images(positions: Floats, edges: Floats, reach: float) -> tuple[Floats, Floats]:
    """Positions wrapped into the cell, and these with all images nearer than `reach` to them."""
    periodic = np.flatnonzero(np.isfinite(edges))
    positions = positions.copy()
    positions[:, periodic] %= edges[periodic]
    low, high = positions.min(axis=0) - reach, positions.max(axis=0) + reach
    images = positions
    for axis in periodic:
        image_count = int(np.ceil(reach / edges[axis]))
        shifts = edges[axis] * np.arange(-image_count, image_count + 1) * np.eye(3)[axis][:, None]
        images = (images[:, None, :] + shifts.T).reshape(-1, 3)
        images = images[(images[:, axis] >= low[axis]) & (images[:, axis] <= high[axis])]
    return positions, images


def radius_of_gyration(positions: ArrayLike) -> float:
    """Root of the mean square distance of the centres from their mean [length]."""
    positions = np.asarray(positions, dtype=float)
    return float(np.sqrt(np.mean(np.sum((positions - positions.mean(axis=0)) ** 2, axis=1))))


def label_components(pairs: ArrayLike, count: int) -> tuple[int, NDArray[np.intp]]:
    """(number of fragments, fragment of each of `count` points (count,)).

    pairs: (C, 2) connected points. Fragments are numbered in the order of their first points.
    """
    i, j = np.asarray(pairs, int).reshape(-1, 2).T
    first = np.arange(count)  # a point of the same fragment, in the end the first one
    while (first[i] != first[j]).any():
        a, b = first[i], first[j]
        np.minimum.at(first, np.maximum(a, b), np.minimum(a, b))
        while (first != first[first]).any():
            first = first[first]
    is_first = first == np.arange(count)
    return int(is_first.sum()), (np.cumsum(is_first) - 1)[first]


def number_by_first(fragment: NDArray[np.integer]) -> NDArray[np.intp]:
    """Fragments of points (N,), of any numbers, numbered in the order of their first points."""
    _, starts, label = np.unique(fragment, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(starts))[label]


def are_in_same_fragment(label: NDArray[np.integer], masses: Floats, bodies: Any) -> bool:
    """True where one fragment has more than half of the mass of both bodies.

    label, masses: fragment and mass of each point, (N,). bodies: points of each.
    """
    count = label.max() + 1
    masses_by_fragment = [np.bincount(label[b], masses[b], minlength=count) for b in bodies]
    return bool(np.logical_and(*(mass > 0.5 * mass.sum() for mass in masses_by_fragment)).any())


def heaviest_first(label: NDArray[np.integer], masses: NDArray[Any]) -> NDArray[np.intp]:
    """Labels of fragments in order of decreasing mass, equal ones in that of the labels.

    label, masses: fragment and mass of each point, (N,).
    """
    mass = np.bincount(label, masses)
    # equal masses differ by rounding of their sums, which must not decide about their order
    return np.argsort(-np.round(mass / np.min(masses), 6), kind="stable")


def largest_first(label: NDArray[np.intp], masses: NDArray[Any]) -> NDArray[np.intp]:
    """Numbers of the fragments of the points (N,) in that order; arguments as of heaviest_first."""
    return np.argsort(heaviest_first(label, masses))[label]


def rigid_rotation(spin: ArrayLike, x: Floats, mass: Floats) -> Floats:
    """Velocities (n, 3) of a body that turns at `spin` (3,) about its centre of mass.

    x: positions (n, 3), mass (n, 1). Units that match.
    """
    return np.cross(spin, x - (mass * x).sum(axis=0) / mass.sum())
