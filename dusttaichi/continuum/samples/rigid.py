"""A rigid body: a bead of glass (G09 section 4.1), or an upright cylinder."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dusttaichi.continuum.samples import lattice
from dusttaichi.continuum.samples.body_registry import FreeBody, Matter, lift_to_space, register
from dusttaichi.continuum.samples.particle_arrays import Body, Particles
from dusttaichi.results.roles import RIGID
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.quantities import Density, Quantity


class RigidSample(FreeBody):
    """A rigid body about the origin, with an exact surface; its particles are for display."""

    @property
    def has_rigid(self) -> bool:
        return True

    kind: Literal["rigid"]
    shape: Literal["sphere", "cylinder"] = Field(
        "sphere",
        description="sphere, in two dimensions a disc; or upright cylinder, there a rectangle",
    )
    diameter: Annotated[float, Quantity("length", gt=0, example="1.1 mm")] = Field(
        description="diameter of the body"
    )
    height: Annotated[float, Quantity("length", gt=0, example="1 mm")] | None = Field(
        None, description="height of the cylinder"
    )
    density: Density = Field(description="density of the body")

    def faults(self) -> Faults:
        if (self.height is None) == (self.shape == "cylinder"):
            text = "a length is needed" if self.height is None else "it is for the cylinder only"
            yield "height", text


@register(RigidSample)
def make(spec: RigidSample, matter: Matter) -> Particles:
    """The rigid body of spec; mass and moments of inertia are those of the shape.

    Raises DustError for too many particles for the memory, or a body smaller than one.
    """
    dimension, spacing = matter.dimension, matter.spacing
    if spec.shape == "sphere":
        volume = float(lattice.sphere_volume(spec.diameter, dimension))
        lattice.check_count(volume, spacing, dimension, "rigid body: diameter")
        points = lattice.sphere(spec.diameter, spacing, dimension)
    else:
        area = spec.diameter if dimension == 2 else np.pi / 4 * spec.diameter**2
        volume = float(area * spec.height)
        lattice.check_count(volume, spacing, dimension, "rigid body: diameter, height")
        points = lattice.cylinder(spec.diameter, spec.height, spacing, dimension)
    mass = spec.density * volume
    still = np.zeros(3)
    inertia = mass * _gyration(spec, dimension)
    size = max(spec.diameter, spec.height or 0.0)
    name = "bead" if spec.shape == "sphere" else "punch"
    extent = {"radius": spec.diameter / 2, "half_height": (spec.height or 0.0) / 2}
    body = Body(name, True, mass, still, still, still, inertia, size, spec.shape, **extent)
    # the volumes of the points are scaled, and their middle is the body's
    points = points - points.mean(axis=0)
    count = len(points)
    particles = Particles(
        position=lift_to_space(points),
        mass=np.full(count, mass / count),
        density=np.full(count, float(spec.density)),
        role=np.full(count, RIGID, np.int8),
        spacing=spacing,
        dimension=dimension,
        bodies=(body,),
        info={
            "name": name,
            "shape": spec.shape,
            "diameter": spec.diameter,
            "density": spec.density,
            "mass": mass,
        }
        | ({"height": spec.height} if spec.height else {}),
    )
    return spec.place_particles(particles)


def _gyration(spec: RigidSample, dimension: int) -> np.ndarray:
    """Moments of inertia over the mass [m^2], (3, 3): closed forms of the shapes."""
    r2 = spec.diameter**2 / 4
    if dimension == 2:
        about_y = r2 / 2 if spec.shape == "sphere" else (spec.diameter**2 + spec.height**2) / 12
        return np.diag([0.0, about_y, 0.0])
    if spec.shape == "sphere":
        return 0.4 * r2 * np.eye(3)
    across = r2 / 4 + spec.height**2 / 12
    return np.diag([across, across, r2 / 2])
