"""Several bodies, each where it says it is, with a velocity and a spin of its own."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator

from dusttaichi.samples.continuum.impact import check_free
from dusttaichi.samples.continuum.particles import Particles, joined
from dusttaichi.samples.continuum.registry import (
    AnySingleBody,
    BodyBlock,
    Found,
    Matter,
    made,
    reads_particles,
    register,
)
from dusttaichi.scene.fields import needed


@reads_particles
class SeveralBodies(BodyBlock):
    """Bodies with positions, velocities and spins."""

    is_body: ClassVar[bool] = False

    kind: Literal["several"]
    bodies: tuple[AnySingleBody, ...] = Field(description="the bodies, each a block of its kind")

    @field_validator("bodies", mode="after")
    @classmethod
    def _some(cls, value):
        if not value:
            raise needed("at least one body is needed")
        return value

    @property
    def has_rigid(self) -> bool:
        return any(body.has_rigid for body in self.bodies)

    def conflicts(self, scene) -> Found:
        return [
            (f"bodies.{n}.{path}" if path else f"bodies.{n}", text)
            for n, body in enumerate(self.bodies)
            for path, text in body.conflicts(scene)
        ]


@register(SeveralBodies)
def make(spec: SeveralBodies, matter: Matter) -> Particles:
    """The bodies one after another; the room is what holds them all.

    Raises DustError where two of them overlap.
    """
    parts = [made(body, matter) for body in spec.bodies]
    check_free(parts, "sample.bodies")
    together = joined(parts)
    half = matter.spacing / 2
    for axis in together.axes:
        ends = [part.room[axis] for part in parts]
        ends.append(
            [together.position[:, axis].min() - half, together.position[:, axis].max() + half]
        )
        together.room[axis] = (np.nanmin(ends), np.nanmax(ends))
    together.info["kind"] = "several"
    return together
