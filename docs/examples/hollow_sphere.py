"""A sample of one's own: a hollow sphere, cut from a random ballistic deposit.

The block says what the YAML may hold, the function makes the grains. Quantities carry their
dimension and their bounds; errors with path and line, `dust schema` and the resolved scene follow
from the block.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dusttaichi import samples
from dusttaichi.samples import rbd
from dusttaichi.samples.values import Seed
from dusttaichi.scene import from_yaml
from dusttaichi.scene.quantities import Quantity


class HollowSphere(samples.SampleBlock):
    """A sphere of a deposited cake without its middle."""

    kind: Literal["hollow_sphere"]
    outer: Annotated[float, Quantity("length", gt=0, example="8 um")] = Field(
        description="outer radius"
    )
    inner: Annotated[float, Quantity("length", ge=0, example="4 um")] = Field(
        "0 um", description="radius of the hollow"
    )
    seed: Seed = Field(1, description="seed of the random numbers")


@samples.register(HollowSphere)
def make(spec, materials):
    """The grains between the two radii, about the origin; spec in SI, materials of the scene."""
    cube = rbd.RbdSample(kind="rbd", size=3 * [f"{2 * spec.outer} m"], seed=spec.seed)
    positions = rbd.make(cube, materials).positions - [0.0, 0.0, spec.outer]
    distance = np.linalg.norm(positions, axis=1)
    radius = materials.radius
    inside = (distance + radius <= spec.outer) & (distance - radius >= spec.inner)
    return samples.Sample.at_rest(positions[inside], {"shape": "aggregate"})


if __name__ == "__main__":  # as an extension of a scene the file only registers
    scene = from_yaml("""
    name: hollow
    material: silicate_s12
    sample: {kind: hollow_sphere, outer: 8 um, inner: 4 um}
    boundary: {kind: open}
    stop: {time: 1 us}
    """)
    sample = samples.make(scene)
    print(len(sample), "grains, filling factor", round(sample.info["filling_factor"], 3))
