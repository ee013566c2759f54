"""Dust of a prescribed filling factor: a tree of grains that explores and fills a volume.

A point of the volume is drawn at random, and the next grain is placed beside the grain nearest to
it, in equilibrium contact, in the direction of the point. As points are uniform, the tree first
reaches all of the volume and then fills it evenly (a rapidly exploring random tree, LaValle 1998).
A grain that would overlap another, or leave the volume, is not placed. All grains are connected at
any filling factor; above about 0.2 to 0.3 no further grains fit. This is not a model of the
formation of dust.
"""

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.samples import cut
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import MixtureBlock, draw_grains, place_grains
from dusttaichi.samples.random_tree import grow_tree
from dusttaichi.samples.sample import Sample, check_grains, extent
from dusttaichi.samples.sample_registry import register
from dusttaichi.samples.values import BoxSize, exactly_one
from dusttaichi.scene.fields import Count, Faults, Field, Number

MOST_GRAINS = 1e7  # tens of minutes
LOOSEST = 1.25  # filling factor of the box around the grains over the prescribed one


class SpaceFillingSample(MixtureBlock):
    """A tree of grains in contact that fills a box evenly, to a prescribed filling factor."""

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

    def faults(self) -> Faults:
        yield from exactly_one(self, ("grains", "size"), "grains: 1000")
        if self.size is not None and self.aspect != 1.0:
            yield "aspect", "it is allowed only together with grains"


@register(SpaceFillingSample)
def make(spec: SpaceFillingSample, materials: Materials) -> Sample:
    """The sample of spec: grains at rest in a box with its bottom at z = 0, about the axis.

    Grains are wholly inside. With `grains` the filling factor is exact, with `size` to one grain.
    Raises DustError for a size that is too small, too many grains, or a filling factor that is not
    reached.
    """
    rng = np.random.Generator(np.random.PCG64(spec.seed))
    count = spec.grains or 0
    if spec.size is not None:
        volume = float(np.prod(spec.size))
        mean = np.mean(_compute_volume(draw_grains(spec, materials, 10_000, rng).radii))
        count = max(1, round(spec.filling_factor * volume / mean))
    check_grains(count, "sample", MOST_GRAINS, "the box")
    grains = draw_grains(spec, materials, count, rng)
    if spec.size is not None:
        edges = np.array(spec.size)
    else:
        width = (_compute_volume(grains.radii).sum() / spec.filling_factor / spec.aspect) ** (1 / 3)
        edges = width * np.array([1.0, 1.0, spec.aspect])
    cut.check_size(edges, float(grains.radii.max()))
    x = grow_tree(grains, edges, rng)
    if x is None:
        raise DustError(
            f"sample.filling_factor = {spec.filling_factor:g}: no further grains fit into "
            f"{cut.in_um(edges)} with seed {spec.seed}; try a lower one (0.2 to 0.3 is about the "
            "largest), or random_packing."
        )
    info = {"kind": "space_filling", "seed": int(spec.seed), "grains": len(x)}
    info |= dict(zip(("width", "depth", "height"), edges.tolist(), strict=True))
    sample = place_grains(x - [edges[0] / 2, edges[1] / 2, 0.0], grains, materials, info)
    spanned = _compute_volume(grains.radii).sum() / np.prod(extent(sample, grains.radii))
    if spanned <= LOOSEST * spec.filling_factor:
        return sample
    return sample.with_remarks(
        f"sample.filling_factor = {spec.filling_factor:g}: so few grains do not reach the ends "
        f"of {cut.in_um(edges)}; in the box around them the filling factor is {spanned:.4g}. "
        "Use more grains, or a boundary.size of that box"
    )


def _compute_volume(radius: float | NDArray[np.float64]) -> NDArray[np.float64]:
    return 4 / 3 * math.pi * np.asarray(radius) ** 3
