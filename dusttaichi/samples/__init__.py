"""Samples: where the grains are before the first step. One kind a file, block and generator."""

from dusttaichi.samples import (  # noqa: F401, each registers its kind
    bcca,
    chain,
    collision,
    explicit,
    lattice,
    pair,
    pca,
    random_packing,
    rbd,
    space_filling,
)
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.push import group_of, pushed
from dusttaichi.samples.registry import AnySample, SampleBlock, made, reads_samples, register
from dusttaichi.samples.sample import (
    Sample,
    bulk_filling_factor,
    coordination,
    describe,
    filling_factor,
    fractal_dimension,
    radius_of_gyration,
    touching_pairs,
)
from dusttaichi.samples.taken import kept_walls

__all__ = [
    "AnySample",
    "Materials",
    "Sample",
    "SampleBlock",
    "bulk_filling_factor",
    "coordination",
    "describe",
    "filling_factor",
    "fractal_dimension",
    "group_of",
    "make",
    "pushed",
    "radius_of_gyration",
    "reads_samples",
    "register",
    "touching_pairs",
]


def make(scene) -> Sample:
    """The sample of a scene, pushed; all in SI. Its info says what it is and what it is like.

    Raises DustError, naming the place in the YAML, for a file that cannot be used, grains that
    overlap too much, a cut without grains, or a sample that would be too large.
    """
    return pushed(scene, kept_walls(scene, made(scene.sample, Materials(scene))))
