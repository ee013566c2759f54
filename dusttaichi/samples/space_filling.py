"""Dust of a wished filling factor: a tree of grains that explores a volume until that is filled.

A point of the volume is drawn at random, and the next grain is put beside the grain that is
nearest to it, in equilibrium contact, in the direction of the point. As points fall everywhere
alike, the tree reaches all of the volume first and fills it evenly then (a rapidly exploring random
tree, LaValle 1998). A grain that would overlap another, or leave the volume, is not put. All hang
together, whatever the filling factor; above some 0.2 to 0.3 no more grains find room. This is not a
model of how dust comes about.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from dusttaichi.errors import DustError
from dusttaichi.samples import cut
from dusttaichi.samples.limits import check_grains
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import (
    MixtureBlock,
    drawn,
    sized,
)
from dusttaichi.samples.registry import register
from dusttaichi.samples.sample import ROUNDING, Sample
from dusttaichi.samples.values import BoxSize, exactly_one
from dusttaichi.scene.fields import Count, Number, problems

MOST_GRAINS = 30_000  # a minute
POINTS = 32  # drawn at once
TRIES = 100  # times as many points without a grain that finds room: there is none


class SpaceFillingSample(MixtureBlock):
    """A tree of grains in contact that fills a box evenly, to a wished filling factor."""

    kind: Literal["space_filling"]
    grains: Count | None = Field(
        None, description="number of grains, in about a cube; either this or size"
    )
    size: BoxSize | None = Field(None, description="[Lx, Ly, Lz] of the box; either this or grains")
    aspect: Annotated[float, Number(gt=0)] = Field(
        1.0, description="height over width of the box, with grains"
    )
    filling_factor: Annotated[float, Number(gt=0, le=0.4)] = Field(
        0.15, description="grain volume over the volume of the box"
    )

    @model_validator(mode="after")
    def _check(self) -> SpaceFillingSample:
        found = exactly_one(self, ("grains", "size"), "grains: 1000")
        if self.size is not None and self.aspect != 1.0:
            found.append(("aspect", "it is allowed only together with grains"))
        if found:
            raise problems(found)
        return self


@register(SpaceFillingSample)
def make(spec: SpaceFillingSample, materials: Materials) -> Sample:
    """The sample that spec asks for: grains at rest in a box that stands on z = 0, about the axis.

    Grains lie wholly inside. With `grains` the box has just the filling factor, with `size` it is
    met to one grain. Raises DustError for a size without room, too many grains, or a filling factor
    that is not reached.
    """
    rng = np.random.Generator(np.random.PCG64(spec.seed))
    volume = None if spec.size is None else float(np.prod(spec.size))
    count = spec.grains
    if count is None:
        mean = np.mean(_ball(drawn(spec, materials, 10_000, rng).radii))
        count = max(1, round(spec.filling_factor * volume / mean))
    if count > MOST_GRAINS:
        raise DustError(f"sample: {count:.3g} grains are too many; allowed: {MOST_GRAINS}.")
    check_grains(count, "sample")
    grains = drawn(spec, materials, count, rng)
    if spec.size is not None:
        edges = np.array(spec.size)
    else:
        width = (_ball(grains.radii).sum() / spec.filling_factor / spec.aspect) ** (1 / 3)
        edges = width * np.array([1.0, 1.0, spec.aspect])
    cut.check_room(edges, float(grains.radii.max()))
    x = _tree(grains, edges, rng)
    if x is None:
        raise DustError(
            f"sample.filling_factor = {spec.filling_factor:g}: no room is left for more grains in "
            f"{cut.in_um(edges)} with seed {spec.seed}; try a lower one (0.2 to 0.3 is about the "
            "most), or random_packing."
        )
    info = {"kind": "space_filling", "seed": int(spec.seed), "grains": len(x)}
    info |= dict(zip(("width", "depth", "height"), edges.tolist(), strict=True))
    return sized(x - [edges[0] / 2, edges[1] / 2, 0.0], grains, materials, info)


def _ball(radius):
    return 4 / 3 * math.pi * radius**3


def _tree(grains, edges, rng) -> np.ndarray | None:
    """Centres (N, 3) [m] in the box from the origin to `edges`; None where no room is found."""
    radii, x = grains.radii, np.empty((len(grains), 3))
    x[0] = radii[0] + rng.random(3) * (edges - 2 * radii[0])
    for k in range(1, len(grains)):
        touch = grains.distance(k, np.arange(k))
        for _ in range(TRIES):
            x[k] = _beside(x[:k], radii[:k], touch, (edges, radii[k]), rng)
            if np.isfinite(x[k, 0]):
                break
        else:
            return None
    return x


def _beside(x, radii, touch, room, rng):
    """Where the next grain finds room beside the grain nearest to one of some points; else NaN."""
    edges, radius = room
    points = rng.random((POINTS, 3)) * edges
    apart = points[:, None] - x
    distance = np.linalg.norm(apart, axis=2)
    near = (distance - radii).argmin(axis=1)
    row = np.arange(POINTS)
    way = apart[row, near] / np.maximum(distance[row, near], 1e-30)[:, None]
    places = x[near] + way * touch[near][:, None]
    inside = np.all((places >= radius) & (places <= edges - radius), axis=1)
    for place in places[inside]:
        free = np.linalg.norm(x - place, axis=1) >= touch * (1 - ROUNDING)
        if free.all():
            return place
    return np.full(3, np.nan)
