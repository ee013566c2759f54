"""Collision of two bodies: target and projectile, each a sample of its own.

The projectile starts on the side of +x and flies along -x, the target along +x; the impact
parameter is along +y, between the trajectories of the centres of mass. The common centre of mass is
at rest at the origin.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from dusttaichi.samples.ballistic import first_touch, random_rotations
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.sample_registry import (
    AnyBody,
    SampleBlock,
    make_sample,
    reads_samples,
    register,
)
from dusttaichi.samples.side_by_side import join_contacts, join_grains
from dusttaichi.samples.values import ImpactParameter, Seed
from dusttaichi.scene.fields import AnyScene, Faults, Field
from dusttaichi.scene.quantities import Quantity

# Coordinates in which the projectile flies along -z: x, y, z there are y, z, x here.
FLIGHT = [1, 2, 0]


@reads_samples
class CollisionSample(SampleBlock):
    """Collision of two bodies; the projectile flies along -x, the centre of mass is at rest."""

    flies: ClassVar[bool] = True
    is_body: ClassVar[bool] = False

    kind: Literal["collision"]
    target: AnyBody = Field(description="one body: a sample of another kind")
    projectile: AnyBody = Field(
        description="the other body, on the side of +x, which flies along -x"
    )
    speed: Annotated[float, Quantity("speed", ge=0, example="1 m/s")] = Field(
        description="relative speed at the start; the centre of mass is at rest"
    )
    impact_parameter: ImpactParameter = Field(
        0.0, description="along y: a length, or a fraction of the sum of the outer radii"
    )
    orientation: Literal["random", "as given"] = Field(
        "random", description="whether both bodies are rotated at random"
    )
    gap: Annotated[float, Quantity("length", ge=0, example="0.6 um")] | None = Field(
        None, description="gap before first contact along the flight, default a grain radius"
    )
    seed: Seed = Field(1, description="seed of the random orientations")

    @property
    def body_blocks(self) -> Mapping[str, SampleBlock]:
        return {"target": self.target, "projectile": self.projectile}

    def conflicts(self, scene: AnyScene) -> Faults:
        yield from super().conflicts(scene)
        for name, body in self.body_blocks.items():
            if getattr(body, "keep", ()):
                yield f"{name}.keep", "a body that flies has no walls and no time of its own"


@register(CollisionSample)
def make(spec: CollisionSample, materials: Materials) -> Sample:
    """The bodies before they meet; grains of the target come first.

    The mean velocities of target and projectile are subtracted. The impact parameter may be a
    fraction of the sum of the outer radii; an outer radius is that of the smallest sphere about the
    body's centre of mass that encloses it, surfaces included.
    gap: length of the relative flight until two surfaces touch, a radius by default. If the
    bodies miss, it is the distance along x between the planes that bound them.
    info: hit, 1 or 0; gap, impact_parameter, outer radii [m]; time_to_touch [s] of a hit.
    """
    samples = [make_sample(body, materials) for body in (spec.target, spec.projectile)]
    rng = np.random.Generator(np.random.PCG64(spec.seed))
    turns = random_rotations(rng, 2) if spec.orientation == "random" else [np.eye(3)] * 2
    unequal = any(body.radii is not None for body in samples)
    masses = [materials.masses(body) for body in samples]
    radii = [materials.radii_of(body) for body in samples]
    weights = masses if unequal else [None, None]
    bodies = [_centre_body(*rows) for rows in zip(samples, turns, weights, strict=True)]
    outer = [
        float((np.linalg.norm(body.positions, axis=1) + r).max())
        for body, r in zip(bodies, radii, strict=True)
    ]
    impact = spec.impact_parameter.metres(sum(outer))
    gap = materials.radius if spec.gap is None else spec.gap
    separation, hit = _place_projectile([body.positions for body in bodies], radii, impact, gap)
    target_mass, mass = (float(m.sum()) if unequal else len(m) for m in masses)
    grains: dict[str, Any] = join_grains(bodies, radii) if unequal else {}
    velocity = -np.array([spec.speed, 0.0, 0.0])
    colliding = _join_bodies(bodies, separation, velocity, mass / (target_mass + mass), grains)
    colliding.info.update(
        kind="collision",
        seed=int(spec.seed),
        grains=len(colliding),
        target_grains=len(bodies[0]),
        projectile_grains=len(bodies[1]),
        target_outer_radius=outer[0],
        projectile_outer_radius=outer[1],
        speed=float(spec.speed),
        impact_parameter=float(impact),
        orientation=spec.orientation,
        gap=float(gap),
        hit=int(hit),
    )
    if hit and spec.speed > 0:
        colliding.info["time_to_touch"] = float(gap / spec.speed)
    colliding.info.update(target=samples[0].info, projectile=samples[1].info)
    reading = [text for body in samples for text in body.info.get("reading", ())]
    return colliding.with_remarks(*dict.fromkeys(reading))


def _join_bodies(
    bodies: Sequence[Sample],
    separation: NDArray[np.float64],
    velocity: NDArray[np.float64],
    mass_fraction: float,
    grains: dict[str, Any],
) -> Sample:
    """Target and projectile in one sample, whose centre of mass is at rest at the origin.

    separation [m], velocity [m/s]: of the projectile from the target, (3,). mass_fraction: of the
    projectile. grains: radii and materials of unequal grains.
    """
    shifts = -mass_fraction, 1 - mass_fraction
    pairs = list(zip(bodies, shifts, strict=True))
    return Sample(
        np.concatenate([body.positions + shift * separation for body, shift in pairs]),
        np.concatenate([body.velocities + shift * velocity for body, shift in pairs]),
        np.concatenate([body.spins for body in bodies]),
        join_contacts(bodies),
        **grains,
    )


def _place_projectile(
    positions: Sequence[NDArray[np.float64]], radii: Sequence[Any], impact: float, gap: float
) -> tuple[NDArray[np.float64], bool]:
    """Place the projectile: its centre of mass from the target's (3,) [m], and whether it hits.

    positions, radii: of the grains of the target and of the projectile, (N, 3) each, and one number
    or (N,).
    """
    (target, projectile), (r1, r2) = positions, radii
    separation = np.array([0.0, impact, 0.0])
    flight = first_touch(
        target[None, :, FLIGHT],
        (projectile + separation)[None, :, FLIGHT],
        np.max(r1) + np.max(r2),
        (np.broadcast_to(r1, len(target)), np.broadcast_to(r2, len(projectile)))
        if np.ndim(r1) or np.ndim(r2)
        else None,
    )
    hit = bool(np.isfinite(flight[0]))
    touching_distance = (target[:, 0] + r1).max() - (projectile[:, 0] - r2).min()
    if not (np.ndim(r1) or np.ndim(r2)):
        touching_distance = target[:, 0].max() - projectile[:, 0].min() + 2 * r1
    separation[0] = gap - flight[0] if hit else gap + touching_distance
    return separation, hit


def _centre_body(
    sample: Sample, turn: np.ndarray, masses: NDArray[np.float64] | None = None
) -> Sample:
    """Centre a sample about its centre of mass, and rotate it with its contacts."""
    contacts = None
    if sample.contacts is not None:
        contacts = {
            name: values @ turn.T if values.ndim == 2 else values
            for name, values in sample.contacts.items()
        }
    centre, speed = sample.positions.mean(axis=0), sample.velocities.mean(axis=0)
    if masses is not None:
        centre, speed = (masses @ a / masses.sum() for a in (sample.positions, sample.velocities))
    return Sample(
        (sample.positions - centre) @ turn.T,
        (sample.velocities - speed) @ turn.T,
        sample.spins @ turn.T,
        contacts,
        radii=sample.radii,
        materials=sample.materials,
    )
