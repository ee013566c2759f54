"""Particle-cluster aggregation (PCA, BPCA; PD08 section 3.1.1): grain after grain from all sides.

The aggregate is turned at random before each shot, a grain flies at it along a straight line at
a random impact parameter, and stays where it first touches; misses are shot again. To turn the
aggregate evenly over all orientations is to choose the direction of the flight evenly over the
sphere, so the aggregate stays and the shots come from all sides. The impact parameter is even
over a disc that covers the aggregate. Which disc does not matter: a larger one only adds misses.

A box or cylinder is cut about the first grain, out of an aggregate that has stopped growing in
there: its last fifth added less than a thousandth to the cut. Every grain sticks to just one
earlier grain, so the cut leaves pieces that hang together with nothing else in it; they are kept
and counted.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from dusttaichi.errors import DustError
from dusttaichi.samples import cut, shots
from dusttaichi.samples.ballistic import (
    across,
    arrival,
    first_hits,
    random_directions,
    random_in_disc,
)
from dusttaichi.samples.limits import check_grains
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import (
    Crowd,
    MixtureBlock,
    drawn,
    mixed,
    sized,
)
from dusttaichi.samples.registry import register
from dusttaichi.samples.sample import Sample, extent
from dusttaichi.samples.values import CutGrains, CutSize, shape_of
from dusttaichi.scene.fields import Count, Number, problems

BULK = 0.15  # filling factor of the bulk; only to guess how large an aggregate to cut from
MOST_GRAINS = 2e6  # of the aggregate: minutes
LAST = 0.2  # part of the aggregate that came last,
SLOWER = 50  # times as long, where grains are not all alike
FEW = 1e-3  # and grains of it that may have come to rest in a cut, as a part of the cut's


class PcaSample(MixtureBlock):
    """An aggregate grown grain by grain from all sides (PD08 section 3.1.1), or a cut from one."""

    kind: Literal["pca"]
    shape: Literal["aggregate", "box", "cylinder"] = Field(
        "aggregate",
        description="the aggregate as it grew, or the shape that is cut from a larger one; "
        "with size that of size",
    )
    grains: CutGrains = None
    size: CutSize = None
    aspect: Annotated[float, Number(gt=0)] = Field(
        1.0, description="height over width of a cut, with grains"
    )
    cluster: Count = Field(
        1,
        description="grains of what is shot at the aggregate: 1, or a small cluster (BCCA) of so "
        "many",
    )
    impact_parameter: Annotated[float, Number(ge=0, lt=1)] | None = Field(
        None,
        description="of every shot, over the sum of the outer radii; by default any, even over the "
        "disc",
    )

    @model_validator(mode="before")
    @classmethod
    def _shape_of_size(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("size") is not None:
            return {"shape": shape_of(data["size"]), **data}
        return data

    @model_validator(mode="after")
    def _check(self) -> PcaSample:
        found = cut.problems(self)
        if self.shape == "aggregate" and self.size is None and self.aspect != 1.0:
            found.append(("aspect", "it is allowed only with shape box or cylinder"))
        if self.cluster > 1 and self.shape != "aggregate":
            found.append(("cluster", "it is allowed only with shape aggregate"))
        if found:
            raise problems(found)
        return self


class Aggregate:
    """A cluster that grows by hit and stick; distance: between the centres of grains that touch.

    positions: (N, 3) [m], the first at the origin, in the order of the hits.

    Shots are worked off in batches: the aggregate as it stands for all of them at once, then in
    their order those that a grain of the same batch stops earlier. The result is that of one
    shot at a time.
    """

    def __init__(self, distance: float):
        self.distance = distance
        self.positions = np.zeros((1, 3))
        self.reach = 0.0  # of the farthest centre from the first grain

    def shoot(self, rng) -> None:
        """Let a batch of grains fly at the aggregate."""
        distance = self.distance
        shots = int(np.clip(len(self.positions) // 20, 16, 2000))
        # The disc leaves some room for the aggregate to grow; once that is used up, the shots
        # that are left are dropped, which, being independent of what came before, they may be.
        cover = 1.05 * self.reach + 2 * distance
        directions = random_directions(rng, shots)
        off = random_in_disc(rng, shots) * cover
        u, v = across(directions)
        starts = off[:, :1] * u + off[:, 1:] * v - cover * directions
        hits = first_hits(self.positions, starts, directions, distance, 2 * cover)
        new = np.empty((shots, 3))
        count = 0
        for start, direction, hit in zip(starts, directions, hits, strict=True):
            apart = new[:count] - start
            along = apart @ direction
            across_squared = ((apart - along[:, None] * direction) ** 2).sum(axis=1)
            hit = arrival(along, across_squared, distance).min(initial=hit)
            if hit == np.inf:
                continue
            new[count] = start + hit * direction
            self.reach = max(self.reach, float(np.linalg.norm(new[count])))
            count += 1
            if self.reach + distance > cover:
                break
        self.positions = np.concatenate([self.positions, new[:count]])


@register(PcaSample)
def make(spec: PcaSample, materials: Materials) -> Sample:
    """The sample that spec asks for: grains at rest.

    An aggregate has its centre of mass at the origin. A cut stands on z = 0 with its axis at
    x = y = 0: with `size` all grains that lie wholly inside, with `grains` the smallest of the
    cuts of the same proportions that holds that many.
    Raises DustError if the size leaves no room for a grain, or the aggregate would be too large.
    """
    radius, equilibrium_distance = materials.radius, materials.distance
    rng = np.random.Generator(np.random.PCG64(spec.seed))
    if mixed(spec) or spec.cluster > 1 or spec.impact_parameter is not None:
        return _one_by_one(spec, materials, rng)
    aggregate = Aggregate(equilibrium_distance)
    if spec.shape == "aggregate":
        _check_grains(spec.grains)
        while len(aggregate.positions) < spec.grains:
            aggregate.shoot(rng)
        positions = aggregate.positions[: spec.grains]
        positions = positions - positions.mean(axis=0)
    else:
        positions = _cut(spec, radius, aggregate, rng)
    sample = Sample.at_rest(positions)
    count, piece = cut.pieces(positions, Crowd(spec, materials, rng).draw(len(positions), rng))
    sample.info.update(
        kind="pca",
        shape=spec.shape,
        seed=int(spec.seed),
        grains=len(sample),
        equilibrium_distance=float(equilibrium_distance),
        aggregated=len(aggregate.positions),
        pieces=int(count),
        largest_piece=int(np.bincount(piece).max()),
    )
    sample.info.update(
        zip(("width", "depth", "height"), extent(sample, radius).tolist(), strict=True)
    )
    return sample


def _one_by_one(spec, materials: Materials, rng) -> Sample:
    """The same of grains that are not all alike, of clusters, at an impact parameter: shot after
    shot."""
    info = {"kind": "pca", "shape": spec.shape, "seed": int(spec.seed)}
    if spec.shape == "aggregate":
        _check_grains(spec.grains * SLOWER)
        grains = drawn(spec, materials, spec.grains, rng)
        x = shots.aggregate(grains, rng, spec.cluster, spec.impact_parameter)
        return sized(x, grains, materials, info | {"grains": len(x)})
    radius = float(np.mean(drawn(spec, materials, 10_000, rng).radii ** 3) ** (1 / 3))
    edges = cut.proportions(spec, radius)
    _check_grains(_guessed_grains(spec, radius, edges) * SLOWER)
    grown = shots.Aggregate(drawn(spec, materials, 1, rng), spec.impact_parameter)
    needed = None
    while needed is None:
        for _ in range(max(20, len(grown.positions) // 10)):
            grown.add(np.zeros((1, 3)), drawn(spec, materials, 1, rng), rng)
        scale = cut.scale(grown.positions, spec.shape, edges, grown.grains.radii, centred=True)
        needed = _settled(spec, edges, scale, grown.reach)
    kept = np.flatnonzero(scale <= needed)
    if len(kept) == 0:
        raise cut.nothing_inside(edges, radius, spec.seed)
    x = grown.positions[kept] + [0.0, 0.0, needed * edges[2] / 2]
    info |= {"grains": len(kept), "aggregated": len(scale)}
    return sized(x, grown.grains.taken(kept), materials, info)


def _cut(spec, radius, aggregate: Aggregate, rng) -> np.ndarray:
    edges = cut.proportions(spec, radius)
    _check_grains(_guessed_grains(spec, radius, edges))
    needed = None
    while needed is None:
        aggregate.shoot(rng)
        scale = cut.scale(aggregate.positions, spec.shape, edges, radius, centred=True)
        needed = _settled(spec, edges, scale, aggregate.reach)
    return aggregate.positions[scale <= needed] + [0.0, 0.0, needed * edges[2] / 2]


def _settled(spec, edges, scale, reach) -> float | None:
    """By how much the cut is to be scaled, once no more grains come to rest in it; None before.

    scale: of the cut that each grain needs; reach: of the aggregate [m].
    """
    if spec.grains is None:
        needed = 1.0
    elif len(scale) > spec.grains:
        needed = np.partition(scale, spec.grains - 1)[spec.grains - 1]
    else:
        return None
    last = scale[int((1 - LAST) * len(scale)) :]
    # Corners of the cut that the aggregate has not reached yet would stay empty too.
    corner = needed * np.linalg.norm(edges * _corner(spec.shape)) / 2
    latecomers = np.count_nonzero(last <= needed)
    done = reach > corner and latecomers <= FEW * np.count_nonzero(scale <= needed)
    return needed if done else None


def _corner(shape: str) -> np.ndarray:
    """Half edges that add up to the distance of the farthest corner."""
    return np.array([1.0, 0.0 if shape == "cylinder" else 1.0, 1.0])


def _guessed_grains(spec, radius, edges) -> float:
    """Grains of a ball at bulk density about the cut, some 10 r of growing surface around it."""
    grain = 4 / 3 * math.pi * radius**3
    if spec.grains is not None:
        area = math.pi / 4 if spec.shape == "cylinder" else 1.0
        volume = edges.prod() * area
        edges = edges * (spec.grains * grain / BULK / volume) ** (1 / 3)
    corner = np.linalg.norm(edges * _corner(spec.shape)) / 2
    return BULK * (corner / radius + 10) ** 3


def _check_grains(grains: float) -> None:
    if grains > MOST_GRAINS:
        raise DustError(
            f"sample: the aggregate would have some {grains:.1e} grains; allowed: "
            f"{MOST_GRAINS:.0e}. Take fewer grains, a smaller size, or an aspect nearer to 1."
        )
    check_grains(grains, "sample")
