"""A straight chain of grains, each in equilibrium contact with the next (PD08 section 3.2)."""

from typing import Literal

import numpy as np

from dusttaichi.physics.geometry import AXES, AxisName
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import MixtureBlock, draw_grains, is_mixture, place_grains
from dusttaichi.samples.sample import Sample, check_grains
from dusttaichi.samples.sample_registry import register
from dusttaichi.samples.values import Seed
from dusttaichi.scene.fields import Count, Field


class ChainSample(MixtureBlock):
    """A straight chain of grains in equilibrium contact."""

    kind: Literal["chain"]
    grains: Count = Field(description="number of grains")
    axis: AxisName = Field("z", description="direction of the chain")
    seed: Seed | None = Field(  # type: ignore[assignment]  # not given by default: equal grains
        None, description="seed of the sizes and materials that are draw_grains, default 1"
    )


@register(ChainSample)
def make(spec: ChainSample, materials: Materials) -> Sample:
    """Grains at rest along the axis x, y or z, in order, the first at the origin."""
    check_grains(spec.grains, "sample.grains")
    positions = np.zeros((spec.grains, 3))
    along = positions[:, AXES.index(spec.axis)]
    info = {"kind": "chain", "grains": spec.grains, "axis": spec.axis}
    if is_mixture(spec):
        seed = 1 if spec.seed is None else int(spec.seed)
        grains = draw_grains(
            spec, materials, spec.grains, np.random.Generator(np.random.PCG64(seed))
        )
        n = np.arange(1, spec.grains)
        along[1:] = np.cumsum(grains.distance(n - 1, n))
        return place_grains(positions, grains, materials, info | {"seed": seed})
    along[:] = np.arange(spec.grains) * materials.distance
    return Sample.at_rest(positions, info | {"equilibrium_distance": materials.distance})
