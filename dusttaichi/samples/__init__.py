"""Samples: where the grains are before the first step. One generator a file."""

from dusttaichi.physics.constants import pair_constants
from dusttaichi.samples import explicit, rbd
from dusttaichi.samples.sample import (
    Sample,
    bulk_filling_factor,
    coordination,
    filling_factor,
    touching_pairs,
)

__all__ = [
    "Sample",
    "bulk_filling_factor",
    "coordination",
    "filling_factor",
    "make",
    "touching_pairs",
]


def make(scene) -> Sample:
    """The sample of a scene; everything in SI.

    Raises DustError, naming the place in the YAML, for a file that cannot be used, grains that
    overlap too much, or a cut without grains.
    """
    radius = scene.material.radius
    if scene.sample.kind == "explicit":
        return explicit.make(scene.sample, radius)
    overlap = pair_constants(scene.material, scene.interaction).delta0
    return rbd.make(scene.sample, radius, 2 * radius - overlap)
