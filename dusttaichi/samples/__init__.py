"""Samples: initial positions of the grains. One kind per file, with its block and generator."""

from dataclasses import replace

import numpy as np

from dusttaichi.samples import (  # noqa: F401, each registers its kind
    bcca,
    chain,
    collision,
    cutout,
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
    ROUNDING,
    Sample,
    bulk_filling_factor,
    coordination,
    describe,
    filling_factor,
    fractal_dimension,
    radius_of_gyration,
    smallest_gap,
    touching_pairs,
)
from dusttaichi.samples.taken import with_walls_of
from dusttaichi.scene import quantities

__all__ = [
    "AnySample", "Materials", "Sample", "SampleBlock", "bulk_filling_factor", "coordination",
    "describe", "filling_factor", "fractal_dimension", "group_of", "make", "pushed",
    "radius_of_gyration", "reads_samples", "register", "smallest_gap", "touching_pairs",
]  # fmt: skip


def make(scene) -> Sample:
    """Sample of a scene with its pushes, in SI; its info has its origin and its measures.

    Raises
    ------
    DustError
        A file cannot be used, grains overlap too much, a cut has no grains, or the sample would be
        too large; with the path in the YAML.
    """
    sample = made(scene.sample, Materials(scene))
    block = getattr(scene.sample, "of", scene.sample)  # of a cutout
    own = type(block).__module__.startswith(f"{__name__}.")
    if block.kind == "explicit" or not own:
        sample = _remark_on_gaps(sample, scene)
    return pushed(scene, with_walls_of(scene, sample))


def _remark_on_gaps(sample: Sample, scene) -> Sample:
    """The sample, with a remark if no two grains touch: a unit or a radius may be wrong."""
    touching = sample.info.get("touching", {}).get("contacts", 0)  # across faces too
    if len(sample) < 2 or touching or sample.info.get("coordination") != 0.0:
        return sample
    radius = scene.material.radius if sample.radii is None else sample.radii
    gap = smallest_gap(sample.positions, radius)
    if gap <= ROUNDING * np.min(radius):
        return sample
    text = (
        f"sample: no two of its {len(sample):,} grains touch (the nearest leave "
        f"{quantities.format(gap, 'length', digits=3)} between them); are lengths and radii in "
        "the units you meant?"
    )
    info = sample.info | {"remarks": [*sample.info.get("remarks", ()), text]}
    return replace(sample, info=info)
