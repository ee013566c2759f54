"""A straight chain of grains, each in equilibrium contact with the next (PD08 section 3.2)."""

from __future__ import annotations

import numpy as np

from dusttaichi.samples.sample import Sample


def make(spec, radius: float, equilibrium_distance: float) -> Sample:
    """grains at rest along the axis x, y or z, in order, the first at the origin.

    spec: grains and axis, as the scene's ChainSample has them. equilibrium_distance: between
    the centres of neighbours [m]; radius is not needed.
    """
    positions = np.zeros((spec.grains, 3))
    positions[:, "xyz".index(spec.axis)] = np.arange(spec.grains) * equilibrium_distance
    sample = Sample.at_rest(positions)
    sample.info.update(
        kind="chain",
        grains=spec.grains,
        axis=spec.axis,
        equilibrium_distance=float(equilibrium_distance),
    )
    return sample
