"""Ballistic cluster-cluster aggregation (BCCA): equal clusters hit and stick, twice as large each.

2^k grains become 2^(k-1) pairs, these 2^(k-2) clusters of four, and so on: a binary tree of
collisions of independent clusters. Both partners of a collision are rotated at random, one flies at
the other along a straight line at a random impact parameter, uniform over the disc whose radius is
the sum of their outer radii, and sticks where it first touches. After a miss both are rotated and
shot again. With a `mass_ratio` below 1 the partners have that ratio of grains, as in the quasi-BCCA
of Okuzumi et al. (2009), but each has grown independently.
"""

from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.samples import ballistic
from dusttaichi.samples.ballistic import first_touch, random_in_disc, random_rotations
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import MixtureBlock, draw_grains, is_mixture, place_grains
from dusttaichi.samples.sample import Sample, check_grains
from dusttaichi.samples.sample_registry import register
from dusttaichi.scene.fields import Count, Field, Number
from dusttaichi.scene.making import report_progress

MOST_GRAINS = 2**20  # a minute or two


class BccaSample(MixtureBlock):
    """An aggregate grown by ballistic collisions of equal clusters (BCCA)."""

    kind: Literal["bcca"]
    grains: Count = Field(
        description="number of grains; if it is not a power of two, clusters are halved as equally "
        "as possible"
    )
    mass_ratio: Annotated[float, Number(ge=0.05, le=1)] = Field(
        1.0,
        description="grains of the smaller over those of the larger of two clusters that meet "
        "(quasi-BCCA); 1: equal ones",
    )


def generations(grains: int, distance: float, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Clusters (C, n, 3) [m] of n = 1, 2, 4, ... grains, C = grains/n of them.

    grains: a power of two; distance: between the centres of grains that touch [m]. Each cluster
    has its centre of mass at the origin. Clusters of one generation are independent.
    """
    clusters = np.zeros((grains, 1, 3))
    yield clusters
    while len(clusters) > 1:
        clusters = collide(clusters[0::2], clusters[1::2], distance, rng)
        report_progress(np.log2(clusters.shape[1]), np.log2(grains))
        yield clusters


def collide(
    targets: np.ndarray, projectiles: np.ndarray, distance: float, rng: np.random.Generator
) -> np.ndarray:
    """Hit and stick: from bodies (C, n, 3) and (C, m, 3) to (C, n + m, 3).

    All bodies are centred at their centres of mass, before and after.
    """
    joined = np.empty((len(targets), targets.shape[1] + projectiles.shape[1], 3))
    waiting = np.arange(len(targets))
    while len(waiting):
        first = _rotate_randomly(targets[waiting], rng)
        second = _rotate_randomly(projectiles[waiting], rng)
        reach = _outer(first) + _outer(second) + distance
        second[..., :2] += (random_in_disc(rng, len(waiting)) * reach[:, None])[:, None]
        flight = first_touch(first, second, distance)
        hit = np.isfinite(flight)
        second[hit, :, 2] -= flight[hit, None]
        joined[waiting[hit]] = np.concatenate([first[hit], second[hit]], axis=1)
        waiting = waiting[~hit]
    values: NDArray[Any] = joined - joined.mean(axis=1, keepdims=True)
    return values


def _rotate_randomly(bodies: Any, rng: np.random.Generator) -> np.ndarray:
    values: NDArray[Any] = np.einsum("cij,cnj->cni", random_rotations(rng, len(bodies)), bodies)
    return values


def _outer(bodies: Any) -> np.ndarray:
    """Distance of the farthest centre from the origin, (C,)."""
    values: NDArray[Any] = np.sqrt((bodies**2).sum(axis=2)).max(axis=1)
    return values


@register(BccaSample)
def make(spec: BccaSample, materials: Materials) -> Sample:
    """The aggregate of spec, at rest, its centre of mass at the origin.

    Raises DustError for too many grains for memory and time.
    """
    if spec.grains > MOST_GRAINS:
        raise DustError(
            f"sample.grains = {spec.grains}: too many for bcca; allowed: at most {MOST_GRAINS}."
        )
    check_grains(spec.grains, "sample.grains")
    rng = np.random.Generator(np.random.PCG64(spec.seed))
    info = {"kind": "bcca", "shape": "aggregate", "seed": int(spec.seed), "grains": spec.grains}
    if is_mixture(spec) or spec.grains & (spec.grains - 1) or spec.mass_ratio != 1.0:
        grains = draw_grains(spec, materials, spec.grains, rng)
        x = ballistic.grow_clusters(grains, rng, spec.mass_ratio, report_progress)
        return place_grains(x, grains, materials, info)
    *_, clusters = generations(spec.grains, materials.distance, rng)
    return Sample.at_rest(clusters[0], info | {"equilibrium_distance": materials.distance})
