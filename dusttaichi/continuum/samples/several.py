"""Several bodies, each with its own position, velocity and spin."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from dusttaichi.continuum.samples import body_registry
from dusttaichi.continuum.samples.impact import check_free
from dusttaichi.continuum.samples.particle_arrays import Particles, join_bodies
from dusttaichi.scene.fields import Faults


@body_registry.reads_particles
class SeveralBodies(body_registry.BodyBlock):
    """Bodies with positions, velocities and spins."""

    is_body: ClassVar[bool] = False

    kind: Literal["several"]
    bodies: tuple[body_registry.AnySingleBody, ...] = Field(
        description="the bodies, each a block of its kind"
    )

    def faults(self) -> Faults:
        if not self.bodies:
            yield "bodies", "at least one body is needed"

    @property
    def body_blocks(self) -> dict[str, body_registry.BodyBlock]:
        return {f"bodies.{n}": body for n, body in enumerate(self.bodies)}


@body_registry.register(SeveralBodies)
def make(spec: SeveralBodies, matter: body_registry.Matter) -> Particles:
    """The bodies one after another; the room encloses all of them.

    Raises DustError where two of them overlap.
    """
    bodies = [body_registry.make_particles(body, matter) for body in spec.bodies]
    check_free(bodies, "sample.bodies")
    together = join_bodies(bodies)
    half = matter.spacing / 2
    for axis in together.axes:
        ends = [particles.room[axis] for particles in bodies]
        ends.append(
            [together.position[:, axis].min() - half, together.position[:, axis].max() + half]
        )
        together.room[axis] = (np.nanmin(ends), np.nanmax(ends))
    together.info["kind"] = "several"
    return together
