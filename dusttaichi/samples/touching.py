"""Grains that touch but for the rounding of their file: put at their distance in equilibrium.

Generators store touching grains at exactly r1 + r2 and with few digits. A contact needs a distance
of at most r1 + r2, so rounding alone would decide which contacts there are, and by how much they
are compressed: the overlap in equilibrium, delta0, is a seven thousandth of the diameter.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.physics.geometry import label_components
from dusttaichi.samples.description import format_counts
from dusttaichi.samples.images import Cell, find_cell
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import EqualGrains, Grains, Touch
from dusttaichi.samples.sample import ROUNDING, Sample
from dusttaichi.scene import quantities

AUTO = "auto"
AT_REST = 1e-3  # gap over the sum of the radii within which grains of a file at rest touch
COARSEST = 2e-2  # the same of a rounding: what is coarser are not rounded numbers
SETTLED, SHARE = (0.25, 2.0), 0.95  # overlaps over that in equilibrium of most pairs of a sample
# that is in equilibrium, whose chance gaps are none of a rounding
FINEST = 1e-15  # m, of a rounding
MOST = 0.05  # of touch_within
DEEP = 5.0  # overlap over that in equilibrium, beyond which contacts push grains apart
CLOSE = 1e-3  # of delta0: distances in equilibrium are met within this
DAMPING = 0.03  # of the linear equations, over the change of a distance by one of its ends
ROUNDS, TRIES = 60, 8  # steps of Newton's method, and tries to bring all pairs into contact


def rounding(positions: NDArray[np.float64], unit: float) -> float:
    """Spacing [m] of the decimal numbers that positions (N, 3) [m] are; 0 where they have none.

    unit: of the numbers in the file [m].
    """
    for digits in range(16):
        spacing = unit * 10.0**-digits
        if spacing < FINEST:
            break
        numbers = positions / spacing
        near = np.abs(numbers - np.round(numbers)) < 0.01
        if np.all(near) and np.any(np.abs(numbers) > 0.5):
            return spacing
    return 0.0


def put_in_contact(sample: Sample, materials: Materials, within: Any, unit: float | None) -> Sample:
    """Put touching grains into equilibrium contact; the info of the sample describes the change.

    Pairs whose gap or overlap is within a tolerance of the sum of their radii touch. Where some of
    these are apart, all are moved to their distance in equilibrium, each fragment about its centre
    of mass. Samples that bring contacts along are left as they are.

    Parameters
    ----------
    sample
    materials
    within : float or "auto"
        The tolerance; 0: none. By default the rounding of the file, or AT_REST if that is larger,
        for two grains that do not move against each other.
    unit
        Unit of the numbers in the file [m]; None: the positions are typed in the YAML, of two
        grains exactly, of more grains with a rounding as in a file.
    """
    if sample.contacts is not None or len(sample) < 2:
        return sample
    grains = _Grains(sample, materials, find_cell(sample.info, materials))
    tolerances = _choose_tolerances(sample, grains, within, unit)
    change = _move_grains(grains, tolerances, every=within != AUTO) if any(tolerances) else {}
    x = change.pop("positions", sample.positions)
    i, j = grains.cell.pairs(x, grains.radii).T
    fragments = int(label_components(np.column_stack([i, j]), len(sample))[0])
    touching = {"contacts": len(i), "fragments": fragments, **change}
    touching["text"] = format_counts(touching)
    texts = []
    if change:
        touching["done"] = _describe_change(touching)
        texts = [_format_remark(touching)]
    if deep := _describe_deep_overlaps(grains, x, i, j):
        texts.append(f"sample: {deep}")
    sample = sample.with_remarks(*texts)
    return replace(sample, positions=x, info=sample.info | {"touching": touching})


class _Grains:
    """Radii, masses and equilibrium distances of the grains of a sample, and their cell."""

    def __init__(self, sample: Sample, materials: Materials, cell: Cell) -> None:
        self.x, self.mass = sample.positions, materials.masses(sample)
        self.velocities, self.turning = sample.velocities, np.any(sample.spins, axis=1)
        self.radii = np.broadcast_to(materials.radii_of(sample), len(sample)).astype(float)
        if sample.radii is None:
            numbers = np.zeros(len(sample), np.int32)
            self._mixture: Grains = EqualGrains(self.radii, numbers, materials.distance)
        else:
            self._mixture = Grains(self.radii, materials.numbers_of(sample), Touch(materials))
        self.largest = 2.0 * float(self.radii.max())
        self.cell = cell

    def rest(self, i: NDArray[np.integer], j: NDArray[np.integer]) -> Any:
        """Distances of pairs in equilibrium [m]."""
        return np.broadcast_to(self._mixture.distance(i, j), len(i))

    def at_rest(self, i: NDArray[np.integer], j: NDArray[np.integer]) -> Any:
        """True of pairs that do not move against each other."""
        same = np.all(self.velocities[i] == self.velocities[j], axis=1)
        return same & ~(self.turning[i] | self.turning[j])

    def distances(
        self, x: NDArray[np.float64], i: NDArray[np.integer], j: NDArray[np.integer]
    ) -> Any:
        return np.linalg.norm(self.cell.nearest(x[i] - x[j]), axis=1)


def _choose_tolerances(sample: Sample, grains: _Grains, within: Any, unit: Any) -> Any:
    """Choose the gaps [m] of `_tolerances`, or those of the scene."""
    if within == AUTO:
        return _tolerances(sample, grains, unit)
    return (within * grains.largest,) * 2


def _tolerances(sample: Sample, grains: _Grains, unit: Any) -> Any:
    """Gaps [m] within which two grains touch: any, and those that are at rest to each other."""
    least = ROUNDING * grains.largest
    if len(sample) == 2 and unit is None:  # a gap or an overlap that is meant
        return 0.0, least
    spacing = rounding(sample.positions, unit or 1.0)
    # of two ends, each off by half a spacing along three axes
    spread = np.sqrt(3.0) * spacing
    spread = max(least, spread if spread < COARSEST * grains.largest else 0.0)
    if unit is None:
        return 0.0, spread
    return (0.0 if len(sample) == 2 else spread), max(spread, AT_REST * grains.largest)


def contacts_by_distance(
    sample: Sample, materials: Materials, within: Any, unit: Any, cell: Cell
) -> np.ndarray:
    """Pairs (C, 2) of grains that overlap or touch, by the tolerances of `put_in_contact`.

    cell: images.Cell of the positions; the other arguments are those of put_in_contact.
    """
    grains = _Grains(sample, materials, cell)
    tolerances = _choose_tolerances(sample, grains, within, unit)
    least = ROUNDING * grains.largest
    i, j, _, gap, near = _find_near_pairs(grains, tuple(max(gap, least) for gap in tolerances))
    touching = near | (gap <= 0.0)
    values: NDArray[Any] = np.column_stack([i, j])[touching]
    return values


def _find_near_pairs(grains: _Grains, tolerances: Any) -> Any:
    """Find i, j, sums of radii, gaps of pairs up to their tolerances, and True within them."""
    factor = 1.0 + max(tolerances) / (2.0 * grains.radii.min())
    i, j = grains.cell.pairs(grains.x, grains.radii, factor).T
    both = grains.radii[i] + grains.radii[j]
    gap = grains.distances(grains.x, i, j) - both
    allowed = np.where(grains.at_rest(i, j), tolerances[1], tolerances[0])
    near = (np.abs(gap) <= allowed * both / grains.largest) & (allowed > 0.0)
    return i, j, both, gap, near


def _move_grains(grains: _Grains, tolerances: Any, every: bool) -> Any:
    """Move grains into contact: positions and measures of the change, or {} without need.

    tolerances: as of `_tolerances`. every: also where no pair is apart.
    """
    *pairs, near = _find_near_pairs(grains, tolerances)
    i, j, both, gap = (a[near] for a in pairs)
    apart = gap > -ROUNDING * both
    if not (apart.any() or (every and len(i))):
        return {}
    rest_distances = grains.rest(i, j)
    overlap = -gap / (both - rest_distances)
    settled = np.mean((overlap > SETTLED[0]) & (overlap < SETTLED[1]))
    if settled > SHARE and not every:
        return {}
    x, target = grains.x, rest_distances.copy()
    for _ in range(TRIES):  # of loops that cannot close all pairs hold on, some overlap more
        x = _relax_distances(grains, i, j, target)
        open_ = np.maximum(grains.distances(x, i, j) - rest_distances, 0.0)
        if np.all(open_ < both - rest_distances):
            break
        target -= open_
    remains_apart = grains.distances(x, i, j) > both
    moved = np.linalg.norm(x - grains.x, axis=1)
    return {
        "positions": x,
        "within": len(i),
        "apart": int(apart.sum()),
        "largest_gap": float(max(gap.max(), 0.0)),
        "tolerance": float(max(tolerances)),
        "moved": float(moved.max()),
        "still_apart": int(remains_apart.sum()),
    }


def _relax_distances(
    grains: _Grains, i: NDArray[np.integer], j: NDArray[np.integer], target: Any
) -> Any:
    """Relax positions until pairs have these distances, with the least change by mass.

    Newton's method for the distances; its linear equations have the solution of least change, which
    keeps the centre of mass, and where loops cannot close, the least squares of what remains. They
    are damped, so that loops do not buckle: only far along chains this takes more steps.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.linalg import lsmr

    x, weight = grains.x.copy(), np.sqrt(grains.mass.mean() / grains.mass)
    close = CLOSE * (grains.radii[i] + grains.radii[j] - grains.rest(i, j)).min()
    rows = np.repeat(np.arange(len(i)), 6)
    columns = (3 * np.column_stack([i, j])[:, :, None] + np.arange(3)).reshape(-1)
    best, least = x, float("inf")
    for _ in range(ROUNDS):
        d = grains.cell.nearest(x[i] - x[j])
        distance = np.linalg.norm(d, axis=1)
        off = distance - target
        if (size := float(np.linalg.norm(off))) > (1.0 - 1e-5) * least:
            break
        best, least = x.copy(), size
        if np.abs(off).max() < close:
            break
        n = d / distance[:, None]
        values = np.stack([n * weight[i][:, None], -n * weight[j][:, None]], axis=1).reshape(-1)
        J = csr_matrix((values, (rows, columns)), (len(i), 3 * len(x)))
        step = lsmr(J, -off, damp=DAMPING, atol=1e-10, btol=1e-10, maxiter=20 * len(i) + 100)[0]
        x += step.reshape(-1, 3) * weight[:, None]
    return best


def _format_length(value: Any) -> str:
    return quantities.format(float(f"{value:.3g}"), "length", digits=3)


def _describe_change(touching: Any) -> str:
    gap = touching["largest_gap"]
    text = f"{touching['apart']:,} of {touching['within']:,} pairs of touching grains were "
    text += f"up to {_format_length(gap)} apart" if gap > FINEST else "just at contact"
    text += (
        f"; grains were moved by up to {_format_length(touching['moved'])} into equilibrium contact"
    )
    if touching["still_apart"]:
        text += f", {touching['still_apart']:,} pairs in closed loops stay apart"
    return text


def _format_remark(touching: Any) -> str:
    return (
        f"sample: {touching['done']} (pairs within "
        f"{_format_length(max(touching['tolerance'], FINEST))} of touching; sample.touch_within: 0 "
        "leaves all as is)"
    )


def deep_overlaps(sample: Sample, materials: Materials) -> str:
    """Sentence on grains that overlap by far more than in equilibrium, or "" without these."""
    if len(sample) < 2:
        return ""
    grains = _Grains(sample, materials, find_cell(sample.info, materials))
    return _describe_deep_overlaps(grains, grains.x, *grains.cell.pairs(grains.x, grains.radii).T)


def _describe_deep_overlaps(
    grains: _Grains, x: NDArray[np.float64], i: NDArray[np.integer], j: NDArray[np.integer]
) -> str:
    if not len(i):
        return ""
    both = grains.radii[i] + grains.radii[j]
    overlap, equilibrium_overlap = both - grains.distances(x, i, j), both - grains.rest(i, j)
    times = overlap / equilibrium_overlap
    deepest = int(np.argmax(times))
    if times[deepest] < DEEP:
        return ""
    relative_overlap = overlap[deepest] / both[deepest]
    deep = np.count_nonzero(times > DEEP)
    which = "1 contact overlaps" if len(i) == 1 else f"{deep:,} of {len(i):,} contacts overlap"
    key = ""
    if 1.1 * relative_overlap <= MOST:
        within = f"{1.1 * relative_overlap:.2g}"
        key = (f". If the grains should just touch, sample.touch_within: {within} puts "
               "them into equilibrium contact")  # fmt: skip
    return (
        f"{which} by more than {DEEP:g} times the overlap in equilibrium (grains {i[deepest]} and "
        f"{j[deepest]}: {_format_length(overlap[deepest])}, {relative_overlap:.2g} of their "
        f"diameter, {times[deepest]:.3g} times): they push the grains apart{key}"
    )
