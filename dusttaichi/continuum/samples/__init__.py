"""Bodies of the continuum: initial positions of the particles. One kind per file."""

from dataclasses import replace

from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.samples import (  # noqa: F401, each registers its kind
    block,
    elastic,
    explicit,
    impact,
    rigid,
    several,
    sphere,
)
from dusttaichi.continuum.samples.body_registry import (
    AnyParticles,
    BodyBlock,
    Matter,
    make_particles,
    reads_particles,
    register,
)
from dusttaichi.continuum.samples.faces import with_faces
from dusttaichi.continuum.samples.initial_stress import at_rest_under_gravity
from dusttaichi.continuum.samples.particle_arrays import COMPONENTS, Body, Particles

__all__ = [
    "COMPONENTS", "AnyParticles", "Body",
    "BodyBlock", "Matter", "Particles", "at_rest_under_gravity", "make", "make_particles",
    "matter_of", "numbers_of", "reads_particles", "register", "with_faces",
]  # fmt: skip


REACH = 2.6  # cutoff of the neighbour lists in smoothing lengths (continuum.particle_search)


def matter_of(scene) -> Matter:
    """Materials of the bodies of a scene."""
    first, *further = (
        Matter(
            dimension=scene.dimension,
            spacing=scene.numerics.spacing,
            solid=material.solid_density,
            filling_factor=material.filling_factor,
            most=MaterialNumbers.from_material(material).phi_2,
            support=scene.numerics.support,
            number=number,
        )
        for number, material in enumerate(scene.all_materials)
    )
    return replace(first, named_matter=dict(zip(scene.materials, further, strict=True)))


def numbers_of(scene, particles) -> MaterialNumbers:
    """MaterialNumbers of each particle, arrays (n,), or those of the only material of a scene."""
    if not scene.materials:
        return MaterialNumbers.from_material(scene.material)
    return MaterialNumbers.together(scene.all_materials).take(particles.material)


def make(scene) -> Particles:
    """The bodies of a scene with its faces and gravity, in SI.

    A block of dust on a bottom starts with the stress of its weight. Raises DustError for bodies
    that do not fit or overlap, or too many particles for the memory.
    """
    particles = make_particles(scene.sample, matter_of(scene))
    weight = scene.gravity.straight_down if scene.gravity else 0.0
    if weight and rests(scene):
        particles = at_rest_under_gravity(particles, weight, numbers_of(scene, particles))
    return with_faces(particles, scene.boundary, REACH * scene.numerics.smoothing_length)


def rests(scene) -> bool:
    """True for a bed: a block, or one as a target, with a face below it."""
    bed = getattr(scene.sample, "target", scene.sample)
    return "bottom" in getattr(scene.boundary, "walls", ()) and bed.kind == "block"
