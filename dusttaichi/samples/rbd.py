"""Random ballistic deposition (S12 section 3.1): a cake grown grain by grain, and a cut from it.

Grains fall vertically, one after another, at random x, y, and stick where they first touch a grain
or the floor. The deposit is laterally periodic and wider than the cut, so its growth is not
affected by side faces, and the cut is one through a bulk cake. Its bottom is the deposition floor
(z = 0), whose denser first layers S12 sees in its profiles (section 5.1). The fluffy top is cut
off: the deposit grows until no later grain can come to rest below the cut's top.

Every grain sticks to just one other, so the cake is a forest of trees on the floor, and the cut's
side faces cut off branches: fragments without a connection to the floor. They remain in the sample
and are counted (`loose_grains`, `loose_fragments` in its info): without them the filling factor
would be below the cake's, especially near the side walls; a compression collects them early. It is
a surface effect: a third of 1e3 grains, 15-18 % of 1e4, 12-14 % of 1e5, 10 % of 1e6.

With `periodic` only the top is cut off: the sample is one period of the deposit, all of whose
grains are connected to the floor, across the side faces. With a `base` the first layers are cut off
too: filling factors are 0.24 up to 6 r above the floor, 0.175 up to 15 r, 0.165 up to 30 r.
"""

import functools
import math
from itertools import product
from typing import Annotated, Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.near import near, near_pairs
from dusttaichi.samples import cut
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import Crowd, Grains, MixtureBlock, is_mixture, place_grains
from dusttaichi.samples.sample import ROUNDING, Sample, bulk_filling_factor, check_grains
from dusttaichi.samples.sample_registry import register
from dusttaichi.samples.values import TOO_NARROW, CutGrains, CutSize, edges_of
from dusttaichi.scene.fields import AnyScene, Faults, Field, Number
from dusttaichi.scene.making import report_progress
from dusttaichi.scene.quantities import Quantity

BULK = 0.15  # filling factor of the bulk, S12 section 3.1; only to estimate the width
LEAST_PERIOD = 40.0  # grain radii: a narrower periodic deposit grows as a correlated column
MOST_DROPS = 2e7  # a mistyped size must not fill the memory; 1e6 grains take 1.5e6 drops, 8 s
CELLS = 3  # cells per touching distance in the map of landing heights


class RbdSample(MixtureBlock):
    """A cake grown by random ballistic deposition (S12 section 3.1)."""

    kind: Literal["rbd"]
    shape: Literal["box", "cylinder"] = Field("box", description="shape that is cut from the cake")
    grains: CutGrains = None
    size: CutSize = None
    aspect: Annotated[float, Number(gt=0)] = Field(
        1.0, description="height over width, with grains"
    )
    base: Annotated[float, Quantity("length", ge=0, example="30 um")] = Field(
        "0 um",
        description="height in the deposit at which the sample begins; the first 20 to 30 radii "
        "above its floor are denser",
    )
    periodic: bool = Field(
        False,
        description="periodic along x and y: one period of the deposit, whose sides are not cut",
    )

    def faults(self) -> Faults:
        yield from cut.faults(self)
        if self.periodic and self.shape != "box":
            yield "periodic", f'a {self.shape} is not periodic; it is allowed with shape "box"'

    def conflicts(self, scene: AnyScene) -> Faults:
        yield from super().conflicts(scene)
        if not is_mixture(self) and self.size is not None:
            if min(edges_of(self.size)) < 2 * scene.material.radius:
                yield "size", TOO_NARROW

    def least_room(self, radius: float) -> tuple[tuple[float, float, float], int]:
        edges = (0.0, 0.0, 0.0) if self.size is None else edges_of(self.size)
        return edges, 0 if is_mixture(self) else self.grains or 0


Body = tuple[NDArray[np.float64], Grains]  # positions (N, 3) [m], and the grains


class Deposit:
    """A laterally periodic deposit of spheres on the floor z = 0.

    period: (2,) [m], at least two distances of any grains that touch. crowd: the mixture.Crowd that
    its grains are drawn from. positions: (M, 3) [m], x and y in [0, period), and grains: in the
    order of the drops.

    A drop's height is max(its radius, max over earlier grains j closer than d_j laterally of
    z_j + sqrt(d_j^2 - l_j^2)), with d_j the distance at which both touch. Drops are processed in
    batches: first the support by earlier batches, then the mutual support of its members, repeated
    until nothing changes. Only maxima of the same sums are used, so the result is bitwise identical
    to that of one drop at a time.

    Earlier grains that no later drop can reach are left out of the search. A map of cells has a
    lower bound of the height at which a drop comes to rest anywhere in the cell.
    """

    def __init__(self, period: Any, crowd: Crowd) -> None:
        self.period = np.broadcast_to(np.asarray(period, dtype=np.float64), 2).copy()
        self.crowd, self.grains = crowd, crowd.draw(0, np.random.default_rng(0))
        self.largest = crowd.largest
        if not (self.period >= 2 * self.widest).all():
            raise ValueError("the period must be at least two touching distances")
        self.positions = np.empty((0, 3))
        self._reachable = np.empty(0, dtype=np.int64)
        cells = np.ceil(CELLS * self.period / crowd.distance).astype(int)
        edges = self.period / cells
        self._half_diagonal = 0.5 * float(np.hypot(*edges))
        self._cell_edges = edges
        self._landing = np.full(cells, crowd.smallest, dtype=np.float64)

    @property
    def widest(self) -> float:
        """Largest distance of two grains in contact [m]."""
        return float(self.crowd.distance if self.crowd.equal else 2.0 * self.largest)

    @property
    def complete_below(self) -> float:
        """No later drop can come to rest below this height [m]."""
        return float(self._landing.min() - ROUNDING * self.crowd.distance)

    def drop(self, xy: np.ndarray, grains: Grains) -> None:
        """Let grains fall at xy (n, 2) [m], in this order."""
        start = len(self.positions)
        if grains.radii.max(initial=0.0) > self.largest:  # it may reach covered grains
            self.largest = float(grains.radii.max())
            if (self.period < 2 * self.widest).any():
                raise DustError(
                    f"sample.sizes: a grain of {1e6 * self.largest:g} µm is too large for the "
                    "cake; allowed: a smaller largest radius, or more grains."
                )
            self._reachable = np.arange(start)
        self.grains = self.grains.join([grains])
        self.positions = np.concatenate([self.positions, np.column_stack([xy, grains.radii])])
        z = self.positions[start:, 2]
        reach = self.widest * (1 + ROUNDING)
        if len(self._reachable):
            below = self.positions[self._reachable, :2]
            i, j, _ = near(xy, below, reach, self.period)
            i, j, rise = self._support(i + start, self._reachable[j])
            np.maximum.at(z, i - start, self.positions[j, 2] + rise)
        earlier, later, _ = near_pairs(xy, reach, self.period)
        i, j, rise = self._support(later + start, earlier + start)
        i, j = i - start, j - start
        moved = np.ones(len(z), bool)
        while True:
            rows = np.flatnonzero(moved[j])  # only what they support can change
            raised = z.copy()
            np.maximum.at(raised, i[rows], z[j[rows]] + rise[rows])
            moved = raised != z
            if not moved.any():
                break
            z[:] = raised
        self._raise_landing(xy, z, grains)
        self._reachable = np.append(self._reachable, np.arange(start, len(self.positions)))
        self._forget_covered()

    def _support(
        self, upper: NDArray[np.intp], lower: NDArray[np.intp]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
        """Pairs of grains that can touch, and the height of the upper above the lower one then."""
        square = np.zeros(len(upper))
        for axis, period in enumerate(self.period):
            x = self.positions[:, axis]
            apart = x[upper] - x[lower]
            apart -= period * np.round(apart / period)
            square += apart**2
        touch = self.grains.distance(upper, lower)
        square_height = touch**2 - square
        able = square_height > 0
        return upper[able], lower[able], np.sqrt(square_height[able])

    def _raise_landing(self, xy: np.ndarray, z: np.ndarray, grains: Grains) -> None:
        least = self.crowd.least(grains)
        within = least - self._half_diagonal
        if within.max(initial=0.0) <= 0.0:
            return
        cell_reaches = np.ceil(within.max() / self._cell_edges + 0.5).astype(int)
        numbers, squares = zip(*map(self._cells_beside, (0, 1), xy.T, cell_reaches), strict=True)
        for m, n in product(*(range(2 * cell_reach + 1) for cell_reach in cell_reaches)):
            apart = np.sqrt(squares[0][m] + squares[1][n])
            rows = np.flatnonzero(apart <= within)
            reached = (apart[rows] + self._half_diagonal) ** 2
            rise = np.sqrt(np.maximum(least[rows] ** 2 - reached, 0.0))
            cells = numbers[0][m][rows] * self._landing.shape[1] + numbers[1][n][rows]
            np.maximum.at(self._landing.reshape(-1), cells, z[rows] + rise)

    def _cells_beside(
        self, axis: int, x: NDArray[np.float64], cell_reach: int
    ) -> tuple[list[NDArray[Any]], list[NDArray[Any]]]:
        """Cells up to `cell_reach` from that of each x, and squares of their distances [m^2]."""
        cells, period = self._landing.shape[axis], self.period[axis]
        at, numbers, squares = (x / self._cell_edges[axis]).astype(int), [], []
        for shift in range(-cell_reach, cell_reach + 1):
            number = (at + shift) % cells
            apart = np.abs(x - (number + 0.5) * self._cell_edges[axis])
            numbers.append(number)
            squares.append(np.minimum(apart, period - apart) ** 2)
        return numbers, squares

    def _forget_covered(self) -> None:
        """Remove grains out of reach: all around them drops rest higher than on their tops."""
        cell_reaches = np.ceil(self.widest / self._cell_edges).astype(int)
        lowest = self._landing
        for axis, cell_reach in enumerate(cell_reaches):
            shifts = (np.roll(lowest, n, axis) for n in range(-cell_reach, cell_reach + 1))
            lowest = functools.reduce(np.minimum, shifts)
        x, y, z = self.positions[self._reachable].T
        cell_x = np.minimum((x / self._cell_edges[0]).astype(int), lowest.shape[0] - 1)
        cell_y = np.minimum((y / self._cell_edges[1]).astype(int), lowest.shape[1] - 1)
        heights = self.crowd.most(self.grains.select(self._reachable), self.largest)
        top = z + heights * (1 + ROUNDING)
        self._reachable = self._reachable[lowest[cell_x, cell_y] < top]


@register(RbdSample)
def make(spec: RbdSample, materials: Materials) -> Sample:
    """The sample of spec: grains at rest, bottom at z = 0, axis x = y = 0.

    Grains in contact are at their equilibrium distance. With `grains`, the cut is the smallest of
    the same proportions about the axis with that number of grains, so the number is exact. With
    `size`, it has all grains that are wholly inside. Pairs between the equilibrium distance and the
    sum of their radii are rare (the width of that shell is delta0) and not in contact here.
    Raises DustError if the size is too small for a grain, no grain is in it, or the deposit would
    be too large for the memory.
    """
    if spec.periodic:
        return _one_period(spec, materials)
    width = None
    while True:
        rng = np.random.Generator(np.random.PCG64(spec.seed))
        crowd = Crowd(spec, materials, rng)
        edges, least = cut.proportions(spec, crowd.radius), LEAST_PERIOD * crowd.radius
        least = max(least, 8.0 * crowd.largest)
        if spec.grains is None:
            period, height, factor = np.maximum(edges[:2], least), edges[2], 1.0
        else:
            width = width or _guessed_width(spec, crowd.radius)
            period, height, factor = max(1.1 * width, least), spec.aspect * width, math.inf
        _check_drops(np.broadcast_to(period, 2), spec.base + height, crowd.radius)
        deposit = Deposit(period, crowd)
        while deposit.complete_below <= spec.base + factor * edges[2] - crowd.smallest:
            _drop_batch(deposit, rng)
            report_progress(deposit.complete_below, spec.base + min(factor * edges[2], height))
            if spec.grains is not None and len(deposit.positions) >= spec.grains:
                scale, last = _scale(deposit, spec, edges), spec.grains - 1
                factor = np.partition(scale, last)[last]
        if spec.grains is None or factor <= period:
            break
        width = 1.5 * max(period, min(factor, 2 * period))
    scale = _scale(deposit, spec, edges)
    inside = scale <= 1.0
    if spec.grains is not None:
        inside = np.sort(np.argsort(scale, kind="stable")[: spec.grains])
    positions, grains = _place_about_axis(deposit, spec)[inside], deposit.grains.select(inside)
    if len(positions) == 0:
        raise cut.nothing_inside(edges, crowd.radius, spec.seed)
    return _sample(spec, materials, (positions, grains), {"deposited": len(scale)})


def _one_period(spec: RbdSample, materials: Materials) -> Sample:
    """One period of the deposit, as wide as the size, or for `grains` as high as `aspect` asks.

    With `grains` these are the lowest ones, so the number is exact and the aspect approximate.
    info: period, the edges of the sample if it is periodic along z too [m].
    """
    rng = np.random.Generator(np.random.PCG64(spec.seed))
    crowd = Crowd(spec, materials, rng)
    edges = cut.proportions(spec, crowd.radius)
    if spec.grains is not None:
        edges = edges * _guessed_width(spec, crowd.radius, margin=0.0)
    if edges[:2].min() < 4.0 * crowd.largest:
        raise DustError(
            f"sample.periodic: the deposit, {cut.in_um(edges[:2])} wide, is narrower than two "
            "grains; allowed: more grains, a smaller aspect or a larger size."
        )
    _check_drops(edges[:2], spec.base + edges[2], crowd.radius)
    deposit, top = Deposit(edges[:2], crowd), edges[2] if spec.grains is None else math.inf
    while deposit.complete_below <= spec.base + top - crowd.smallest:
        _drop_batch(deposit, rng)
        report_progress(deposit.complete_below, spec.base + min(top, edges[2]))
        if spec.grains is not None and len(deposit.positions) >= spec.grains:
            top = np.partition(_tops(deposit, spec), spec.grains - 1)[spec.grains - 1]
    x, tops = _place_about_axis(deposit, spec), _tops(deposit, spec)
    lowest = np.flatnonzero(tops <= top)
    if spec.grains is not None:
        lowest = np.sort(np.argsort(tops, kind="stable")[: spec.grains])
    if len(lowest) == 0:
        raise cut.nothing_inside(edges, crowd.radius, spec.seed)
    period = [*map(float, edges[:2]), float(tops[lowest].max() - crowd.overlap)]
    body = x[lowest], deposit.grains.select(lowest)
    return _sample(spec, materials, body, {"deposited": len(tops), "period": period})


def _sample(spec: RbdSample, materials: Materials, body: Body, info: dict[str, Any]) -> Sample:
    """The Sample of a body (positions, Grains), with its info."""
    positions, grains = body
    info |= {"kind": "rbd", "shape": spec.shape, "seed": int(spec.seed), "grains": len(positions)}
    sample = place_grains(positions, grains, materials, info)
    radii = materials.radius if sample.radii is None else grains.radii
    period = info.get("period")
    if period is not None:
        period = period * np.array([1.0, 1.0, 2.0])  # no image of the floor above the top
    sample.info.update(cut.measures(sample, grains, radii, period, on_floor=not spec.base))
    if sample.radii is None:
        sample.info["bulk_filling_factor"] = bulk_filling_factor(sample, materials.radius)
    return sample


def _scale(deposit: Deposit, spec: RbdSample, edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Factors (N,) on the edges of the cut with which each grain is just inside."""
    x, radii = _place_about_axis(deposit, spec), deposit.grains.radii
    return np.where(x[:, 2] >= radii, cut.scale(x, spec.shape, edges, radii), math.inf)


def _tops(deposit: Deposit, spec: RbdSample) -> NDArray[np.float64]:
    """Heights (N,) of the tops of all grains above the base, inf of those below it [m]."""
    z, radii = deposit.positions[:, 2] - spec.base, deposit.grains.radii
    return np.where(z >= radii, z + radii, math.inf)


def _check_drops(period: Any, height: float, radius: float) -> None:
    """Raise DustError for too many drops; the fluffy top above the cut takes about 30 r."""
    drops = BULK * np.prod(period) * (height + 30 * radius) / (4 / 3 * math.pi * radius**3)
    check_grains(drops, "sample", MOST_DROPS, "the cake to cut from", cut.ADVICE)


def _drop_batch(deposit: Deposit, rng: np.random.Generator) -> None:
    """Drop four grains per squared touching distance: several layers, few rounds of support."""
    n = math.ceil(4 * float(np.prod(deposit.period)) / deposit.crowd.distance**2)
    grains = deposit.crowd.draw(n, rng)
    below = np.nextafter(deposit.period, 0)  # x = period would be outside [0, period)
    deposit.drop(np.minimum(rng.random((n, 2)) * deposit.period, below), grains)


def _place_about_axis(deposit: Deposit, spec: RbdSample) -> np.ndarray:
    """Positions (N, 3) [m] about the axis, above the base."""
    return np.asarray(deposit.positions - np.append(deposit.period / 2, spec.base))


def _guessed_width(spec: RbdSample, radius: float, margin: float = 2.0) -> float:
    """Width of the cut at bulk density; whole grains need 2 r beside their centres."""
    area = math.pi / 4 if spec.shape == "cylinder" else 1.0
    centres = cast(int, spec.grains) * 4 / 3 * math.pi / (BULK * area * spec.aspect)
    return float(radius * max(centres ** (1 / 3) + margin, 2.0 / spec.aspect))
