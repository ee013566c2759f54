"""Samples: where the grains are before the first step. One generator a file."""

from dusttaichi.physics.contact.constants import pair_constants
from dusttaichi.samples import (
    bcca,
    chain,
    collision,
    explicit,
    lattice,
    pair,
    pca,
    random_packing,
    rbd,
)
from dusttaichi.samples.push import pushed
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
from dusttaichi.samples.stock import Stock

__all__ = [
    "Sample",
    "bulk_filling_factor",
    "coordination",
    "describe",
    "filling_factor",
    "fractal_dimension",
    "make",
    "pushed",
    "radius_of_gyration",
    "touching_pairs",
]

# One entry a kind: make(spec, radius [m], equilibrium distance [m]) -> Sample.
GENERATORS = {
    "bcca": bcca.make,
    "chain": chain.make,
    "lattice": lattice.make,
    "pca": pca.make,
    "random_packing": random_packing.make,
    "rbd": rbd.make,
}
# The same of those whose grains may differ: make(spec, radius, equilibrium distance, stock).
UNLIKE = {
    "explicit": lambda spec, radius, distance, stock: explicit.make(spec, radius, stock),
    "pair": pair.make,
}


def make(scene) -> Sample:
    """The sample of a scene, pushed; all in SI. Its info says what it is and what it is like.

    Raises DustError, naming the place in the YAML, for a file that cannot be used, grains that
    overlap too much, a cut without grains, or a sample that would be too large.
    """
    radius = scene.material.radius
    overlap = pair_constants(scene.material, scene.interaction).delta0
    return pushed(scene, _made(scene.sample, radius, 2 * radius - overlap, Stock(scene)))


def _made(spec, radius: float, distance: float, stock: Stock) -> Sample:
    if spec.kind == "collision":
        bodies = [_made(body, radius, distance, stock) for body in (spec.target, spec.projectile)]
        sample = collision.make(spec, *bodies, radius, stock)
    elif spec.kind in UNLIKE:
        sample = UNLIKE[spec.kind](spec, radius, distance, stock)
    else:
        sample = GENERATORS[spec.kind](spec, radius, distance)
    # Grains that overlap at the start are in contact.
    touch = 2 * radius if sample.radii is None else None
    sample.info.update(describe(sample, stock.radii_of(sample), touch))
    return sample
