"""Several bodies, each with its own position, velocity and spin."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from dusttaichi.continuum.samples import registry
from dusttaichi.continuum.samples.impact import check_free
from dusttaichi.continuum.samples.particles import Particles, joined
from dusttaichi.scene.fields import Faults


@registry.reads_particles
class SeveralBodies(registry.BodyBlock):
    """Bodies with positions, velocities and spins."""

    is_body: ClassVar[bool] = False

    kind: Literal["several"]
    bodies: tuple[registry.AnySingleBody, ...] = Field(
        description="the bodies, each a block of its kind"
    )

    def faults(self) -> Faults:
        if not self.bodies:
            yield "bodies", "at least one body is needed"

    @property
    def body_blocks(self) -> dict[str, registry.BodyBlock]:
        return {f"bodies.{n}": body for n, body in enumerate(self.bodies)}


@registry.register(SeveralBodies)
def make(spec: SeveralBodies, matter: registry.Matter) -> Particles:
    """The bodies one after another; the room encloses all of them.

    Raises DustError where two of them overlap.
    """
    bodies = [registry.make_particles(body, matter) for body in spec.bodies]
    check_free(bodies, "sample.bodies")
    together = joined(bodies)
    half = matter.spacing / 2
    for axis in together.axes:
        ends = [part.room[axis] for part in bodies]
        ends.append(
            [together.position[:, axis].min() - half, together.position[:, axis].max() + half]
        )
        together.room[axis] = (np.nanmin(ends), np.nanmax(ends))
    together.info["kind"] = "several"
    return together
