"""A projectile above a target, about to touch it: a bead on dust (G09 section 4.1)."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dusttaichi.continuum.samples import body_registry
from dusttaichi.continuum.samples.particle_arrays import Particles, displace, join_bodies
from dusttaichi.errors import DustError
from dusttaichi.scene.quantities import Quantity


@body_registry.reads_particles
class ImpactSample(body_registry.BodyBlock):
    """A projectile that falls on a target; the target does not move, its particles come first."""

    is_body: ClassVar[bool] = False

    kind: Literal["impact"]
    target: body_registry.AnySingleBody = Field(
        description="the body that is hit: a block, a sphere ..."
    )
    projectile: body_registry.AnySingleBody = Field(
        description="the body that hits: rigid, or dust; from above, its middle at x = y = 0"
    )
    speed: Annotated[float, Quantity("speed", ge=0, example="0.65 m/s")] = Field(
        "0 m/s",
        description="speed downwards at first contact; a fall from the height h gives sqrt(2 g h)",
    )
    velocity: body_registry.Motion | None = Field(
        None, description="further velocity of the projectile"
    )
    offset: body_registry.Place | None = Field(
        None, description="displacement of the projectile from there, such as [0.2 mm, 0 mm]"
    )
    gap: Annotated[float, Quantity("length", ge=0, example="0.1 mm")] | None = Field(
        None, description="initial distance of both surfaces, default numerics.spacing"
    )

    @property
    def body_blocks(self) -> dict[str, body_registry.BodyBlock]:
        return {"target": self.target, "projectile": self.projectile}


@body_registry.register(ImpactSample)
def make(spec: ImpactSample, matter: body_registry.Matter) -> Particles:
    """Target and projectile, with a gap between their upper and lower ends.

    Raises DustError where both overlap nevertheless (an offset into the target).
    """
    target, projectile = (
        body_registry.make_particles(spec.target, matter),
        body_registry.make_particles(spec.projectile, matter),
    )
    gap = matter.spacing if spec.gap is None else spec.gap
    top, bottom = target.room[2, 1], lower_end(projectile)
    shift = np.array([0.0, 0.0, top + gap - bottom]) + body_registry.in_space(spec.offset)
    velocity = body_registry.in_space(spec.velocity) - [0.0, 0.0, spec.speed]
    projectile = displace(projectile, shift, velocity)
    check_free([target, projectile], "sample.offset")
    together = join_bodies([target, projectile])
    together.room[:] = target.room
    together.info.update(
        kind="impact",
        speed=spec.speed,
        gap=gap,
        surface=float(top),
        target=target.info,
        projectile=projectile.info,
    )
    return together


def lower_end(body: Particles) -> float:
    """Height of the lowest point of a body [m], from its shape if known."""
    low = body.room[2, 0]
    if np.isfinite(low):
        return float(low)
    info, centre = body.info, body.bodies[0].centre[2]
    extent = info.get("height") or info.get("diameter")
    return float(centre - extent / 2)


def check_free(bodies: list[Particles], path: str) -> None:
    """Raise DustError where particles of two bodies are closer than half a spacing."""
    from scipy.spatial import cKDTree

    for n, first_body in enumerate(bodies):
        for second_body in bodies[n + 1 :]:
            distance, _ = cKDTree(first_body.position).query(second_body.position)
            if distance.min() < 0.5 * first_body.spacing:
                raise DustError(
                    f"{path}: two bodies overlap: two of their particles are "
                    f"{distance.min() * 1e6:.4g} µm apart; allowed: at least half of "
                    f"numerics.spacing, {0.5e6 * first_body.spacing:.4g} µm. Move them apart."
                )
