"""Bodies of the continuum: where its particles are before the first step. One kind a file."""

from dataclasses import replace

from dusttaichi.physics.continuum.numbers import MaterialNumbers
from dusttaichi.samples.continuum import (  # noqa: F401, each registers its kind
    block,
    elastic,
    explicit,
    impact,
    rigid,
    several,
    sphere,
)
from dusttaichi.samples.continuum.faces import with_faces
from dusttaichi.samples.continuum.gravity import at_rest_under_gravity
from dusttaichi.samples.continuum.particles import (
    COMPONENTS,
    DUST,
    ELASTIC,
    HELD,
    RIGID,
    ROLES,
    WALL,
    Body,
    Particles,
)
from dusttaichi.samples.continuum.registry import (
    AnyParticles,
    BodyBlock,
    Matter,
    made,
    reads_particles,
    register,
)

__all__ = [
    "COMPONENTS",
    "DUST",
    "ELASTIC",
    "HELD",
    "RIGID",
    "ROLES",
    "WALL",
    "AnyParticles",
    "Body",
    "BodyBlock",
    "Matter",
    "Particles",
    "at_rest_under_gravity",
    "made",
    "make",
    "matter_of",
    "numbers_of",
    "reads_particles",
    "register",
    "with_faces",
]


REACH = 2.6  # of the neighbour lists in smoothing lengths (continuum.search)


def matter_of(scene) -> Matter:
    """Materials of the bodies of a scene."""
    first, *others = (
        Matter(
            dimension=scene.dimension,
            spacing=scene.numerics.spacing,
            solid=material.solid_density,
            filling_factor=material.filling_factor,
            most=material.compressive.phi_2,
            number=number,
        )
        for number, material in enumerate(scene.all_materials)
    )
    return replace(first, others=dict(zip(scene.materials, others, strict=True)))


def numbers_of(scene, particles) -> MaterialNumbers:
    """MaterialNumbers of the dust of each particle, arrays (n,); those of the material where a
    scene has no other."""
    if not scene.materials:
        return MaterialNumbers.of(scene.material)
    return MaterialNumbers.together(scene.all_materials).taken(particles.material)


def make(scene) -> Particles:
    """The bodies of a scene with what stands at its faces, under gravity where it has any; SI.

    A block of dust on something starts with the stress that its weight makes. Raises DustError for
    what does not fit, bodies that overlap, or more particles than memory should hold.
    """
    particles = made(scene.sample, matter_of(scene))
    weight = scene.gravity.straight_down if scene.gravity else 0.0
    if weight and rests(scene):
        particles = at_rest_under_gravity(particles, weight, numbers_of(scene, particles))
    return with_faces(particles, scene.boundary, REACH * scene.numerics.smoothing_length)


def rests(scene) -> bool:
    """True where a bed lies on something: a block, or one as a target, with a face below it."""
    bed = getattr(scene.sample, "target", scene.sample)
    return "bottom" in getattr(scene.boundary, "walls", ()) and bed.kind == "block"
