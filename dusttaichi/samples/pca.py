"""Particle-cluster aggregation (PCA, BPCA; PD08 section 3.1.1): grain after grain from all sides.

Before each shot the aggregate is rotated at random, a grain flies at it along a straight line at a
random impact parameter, and sticks where it first touches; misses are shot again. A random
orientation of the aggregate is equivalent to a random direction of flight, so the aggregate does
not move and the shots come from all sides. The impact parameter is uniform over a disc that covers
the aggregate; a larger disc only adds misses.

A box or cylinder is cut about the first grain, out of an aggregate that no longer grows there: its
last fifth added less than a thousandth to the cut. Every grain sticks to just one earlier grain, so
a cut has several connected fragments, which remain in the sample and are counted.
"""

import math
from typing import Annotated, Any, Literal, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from dusttaichi.samples import ballistic, cut
from dusttaichi.samples.ballistic import find_perpendicular, random_directions, random_in_disc
from dusttaichi.samples.growing_targets import Targets, land_in_order
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import Crowd, MixtureBlock, draw_grains, is_mixture, place_grains
from dusttaichi.samples.sample import ROUNDING, Sample, check_grains
from dusttaichi.samples.sample_registry import register
from dusttaichi.samples.unequal_aggregate import grow_unequal
from dusttaichi.samples.values import CutGrains, CutSize, shape_of
from dusttaichi.scene.fields import AnyScene, Count, Faults, Field, Number
from dusttaichi.scene.making import Cost, report_progress

BULK = 0.15  # filling factor of the bulk; only to estimate the size of the aggregate to cut from
MOST_GRAINS = 4e6  # of the aggregate: half an hour
SECONDS = 4e-4  # of a grain,
SECONDS_OF_SQUARE = 1.5e-8  # and over the square of their number where each is compared with all
SLOWER = 20  # ratio of run times of these
LAST = 0.2  # part of the aggregate that came last,
FEW = 1e-3  # and the largest number of its grains in a settled cut, relative to all grains of it


class PcaSample(MixtureBlock):
    """An aggregate grown grain by grain from all sides (PD08 section 3.1.1), or a cut from one."""

    kind: Literal["pca"]
    shape: Literal["aggregate", "box", "cylinder"] = Field(
        "aggregate",
        description="the whole aggregate, or the shape that is cut from a larger one; by default "
        "that of size",
    )
    grains: CutGrains = None
    size: CutSize = None
    aspect: Annotated[float, Number(gt=0)] = Field(
        1.0, description="height over width of a cut, with grains"
    )
    cluster: Count = Field(
        1, description="number of grains of each projectile: 1, or those of a small cluster (BCCA)"
    )
    impact_parameter: Annotated[float, Number(ge=0, lt=1)] | None = Field(
        None,
        description="impact parameter of every shot over the sum of the outer radii; by default "
        "uniform over the disc",
    )

    @model_validator(mode="before")
    @classmethod
    def _shape_of_size(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("size") is not None:
            return {"shape": shape_of(data["size"]), **data}
        return data

    def cost(self, scene: AnyScene) -> Cost:
        radius, grains = scene.material.radius, float(self.grains or 0)
        if self.shape != "aggregate":
            grains = _guessed_grains(self, radius, cut.proportions(self, radius))
        if self.compares_all:
            return Cost("N^2", SECONDS * grains + SECONDS_OF_SQUARE * grains**2)
        return Cost("N log N", SECONDS * grains)

    @property
    def compares_all(self) -> bool:
        """True where each shot is compared with all grains: cuts of unequal ones, clusters ..."""
        is_unequal_cut = is_mixture(self) and self.shape != "aggregate"
        return is_unequal_cut or self.cluster > 1 or self.impact_parameter is not None

    def faults(self) -> Faults:
        yield from cut.faults(self)
        if self.shape == "aggregate" and self.size is None and self.aspect != 1.0:
            yield "aspect", "it is allowed only with shape box or cylinder"
        if self.cluster > 1 and self.shape != "aggregate":
            yield "cluster", "it is allowed only with shape aggregate"


class Aggregate:
    """A cluster that grows by hit and stick; distance: between the centres of grains that touch.

    Shots are processed in batches: first hits on the aggregate for all of them at once, then, in
    their order, earlier hits on grains of the same batch. The result is that of one shot at a time.
    """

    def __init__(self, distance: float) -> None:
        self.distance = distance
        self.targets = Targets(np.zeros((1, 3)))
        self.reach = 0.0  # of the farthest centre from the first grain

    @property
    def positions(self) -> NDArray[np.float64]:
        """Centres (N, 3) [m], the first at the origin, in the order of the hits."""
        return self.targets.positions

    def shoot(self, rng: np.random.Generator) -> None:
        """Let a batch of grains fly at the aggregate."""
        distance = self.distance
        shots = int(np.clip(len(self.positions) // 20, 16, 2000))
        # The disc has a margin for the growth of the aggregate; once that is used up, the remaining
        # shots are discarded, which is allowed because they are independent of earlier ones.
        cover = 1.05 * self.reach + 2 * distance
        directions = random_directions(rng, shots)
        off = random_in_disc(rng, shots) * cover
        u, v = find_perpendicular(directions)
        starts = off[:, :1] * u + off[:, 1:] * v - cover * directions
        hits = self.targets.first_hits(starts, directions, distance, 2 * cover)
        landed = land_in_order(starts, directions, hits, distance)
        landed = landed[np.isfinite(landed[:, 0])]
        far = np.linalg.norm(landed, axis=1) > self.reach * (1 - ROUNDING)
        for row in np.flatnonzero(far):
            self.reach = max(self.reach, float(np.linalg.norm(landed[row])))
            if self.reach + distance > cover:
                landed = landed[: row + 1]
                break
        self.targets.add(landed)


@register(PcaSample)
def make(spec: PcaSample, materials: Materials) -> Sample:
    """The sample of spec: grains at rest.

    An aggregate has its centre of mass at the origin. A cut has its bottom at z = 0 and its axis at
    x = y = 0: with `size` it has all grains that are wholly inside, with `grains` it is the
    smallest of the same proportions with that number.
    Raises DustError if the size is too small for a grain, or the aggregate would be too large.
    """
    rng = np.random.Generator(np.random.PCG64(spec.seed))
    if is_mixture(spec) or spec.cluster > 1 or spec.impact_parameter is not None:
        return _one_by_one(spec, materials, rng)
    aggregate = Aggregate(materials.distance)
    if spec.shape == "aggregate":
        count = cast(int, spec.grains)
        _check_grains(count)
        while len(aggregate.positions) < count:
            aggregate.shoot(rng)
            report_progress(len(aggregate.positions), count)
        positions = aggregate.positions[: spec.grains]
        positions = positions - positions.mean(axis=0)
    else:
        positions = _grow_cut(spec, materials.radius, aggregate, rng)
    grains = Crowd(spec, materials, rng).draw(len(positions), rng)
    info = {"kind": "pca", "shape": spec.shape, "seed": int(spec.seed), "grains": len(positions)}
    info["aggregated"] = len(aggregate.positions)
    sample = place_grains(positions, grains, materials, info)
    sample.info.update(cut.measures(sample, grains, materials.radius))
    return sample


def _one_by_one(spec: PcaSample, materials: Materials, rng: np.random.Generator) -> Sample:
    """The sample of unequal grains, of clusters, or at an impact parameter: shot after shot."""
    info = {"kind": "pca", "shape": spec.shape, "seed": int(spec.seed)}
    if spec.shape == "aggregate":
        count = cast(int, spec.grains)
        _check_grains(count * (SLOWER if spec.compares_all else 1))
        grains = draw_grains(spec, materials, count, rng)
        if spec.compares_all:
            x = ballistic.grow_aggregate(grains, rng, spec.cluster, spec.impact_parameter)
        else:
            x = grow_unequal(grains, rng)
        return place_grains(x, grains, materials, info | {"grains": len(x)})
    radius = float(np.mean(draw_grains(spec, materials, 10_000, rng).radii ** 3) ** (1 / 3))
    edges = cut.proportions(spec, radius)
    _check_grains(_guessed_grains(spec, radius, edges) * SLOWER)
    grown = ballistic.Aggregate(draw_grains(spec, materials, 1, rng), spec.impact_parameter)
    factor = None
    while factor is None:
        report_progress(len(grown.positions))
        for _ in range(max(20, len(grown.positions) // 10)):
            grown.add(np.zeros((1, 3)), draw_grains(spec, materials, 1, rng), rng)
        scale = cut.scale(grown.positions, spec.shape, edges, grown.grains.radii, centred=True)
        factor = _find_settled_factor(spec, edges, scale, grown.reach)
    inside = np.flatnonzero(scale <= factor)
    if len(inside) == 0:
        raise cut.nothing_inside(edges, radius, spec.seed)
    x = grown.positions[inside] + [0.0, 0.0, factor * edges[2] / 2]
    info |= {"grains": len(inside), "aggregated": len(scale)}
    return place_grains(x, grown.grains.select(inside), materials, info)


def _grow_cut(
    spec: PcaSample,
    radius: float,
    aggregate: Aggregate,
    rng: np.random.Generator,
) -> np.ndarray:
    edges = cut.proportions(spec, radius)
    _check_grains(_guessed_grains(spec, radius, edges))
    factor, scale = None, np.empty(0)
    while factor is None:
        aggregate.shoot(rng)
        report_progress(len(aggregate.positions))
        landed = aggregate.positions[len(scale) :]
        of_landed = cut.scale(landed, spec.shape, edges, radius, centred=True)
        scale = np.concatenate([scale, of_landed])
        factor = _find_settled_factor(spec, edges, scale, aggregate.reach)
    values: NDArray[Any] = aggregate.positions[scale <= factor] + [0.0, 0.0, factor * edges[2] / 2]
    return values


def _find_settled_factor(
    spec: PcaSample, edges: NDArray[np.float64], scale: NDArray[np.float64], reach: float
) -> float | None:
    """Factor on the edges of the cut, once no more grains come to rest in it; None before.

    scale: smallest factor for each grain; reach: of the aggregate [m].
    """
    if spec.grains is None:
        factor = 1.0
    elif len(scale) > spec.grains:
        factor = np.partition(scale, spec.grains - 1)[spec.grains - 1]
    else:
        return None
    last = scale[int((1 - LAST) * len(scale)) :]
    # corners of the cut beyond the reach of the aggregate would be empty
    corner = factor * np.linalg.norm(edges * _corner(spec.shape)) / 2
    latecomers = np.count_nonzero(last <= factor)
    is_settled = reach > corner and latecomers <= FEW * np.count_nonzero(scale <= factor)
    return factor if is_settled else None


def _corner(shape: str) -> np.ndarray:
    """Half edges that add up to the distance of the farthest corner."""
    return np.array([1.0, 0.0 if shape == "cylinder" else 1.0, 1.0])


def _guessed_grains(spec: PcaSample, radius: float, edges: NDArray[np.float64]) -> float:
    """Grains of a sphere at bulk density about the cut, with 10 r of growing surface around it."""
    grain = 4 / 3 * math.pi * radius**3
    if spec.grains is not None:
        area = math.pi / 4 if spec.shape == "cylinder" else 1.0
        volume = edges.prod() * area
        edges = edges * (spec.grains * grain / BULK / volume) ** (1 / 3)
    corner = np.linalg.norm(edges * _corner(spec.shape)) / 2
    return float(BULK * (corner / radius + 10) ** 3)


def _check_grains(grains: float) -> None:
    check_grains(grains, "sample", MOST_GRAINS, "the aggregate", cut.ADVICE)
