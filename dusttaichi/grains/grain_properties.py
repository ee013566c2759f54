"""The grains of a scene: materials as they are computed, radii and masses, in SI."""

import numpy as np

from dusttaichi.grains.state import GrainProperties
from dusttaichi.physics.contact import constants


def scale_materials(scene):
    """The scene with its materials as they are computed.

    numerics.mass_scaling is in their densities, stiffness_scaling in their moduli. A scene that
    this has made is returned as it is.
    """
    factors = scene.numerics.mass_scaling, scene.numerics.stiffness_scaling
    if factors == (1.0, 1.0) and scene.material.unscaled is scene.material:
        return scene
    materials = {name: m.with_scaling(*factors) for name, m in scene.materials.items()}
    return scene.model_copy(
        update={"material": scene.material.with_scaling(*factors), "materials": materials}
    )


def grain_properties(scene, sample):
    """GrainProperties of a sample whose grains differ; None where they are equal."""
    if sample.radii is None and sample.materials is None:
        return None
    scene = scale_materials(scene)
    materials = scene.all_materials
    number = np.zeros(len(sample), np.int32) if sample.materials is None else sample.materials
    radius = sample.radii
    if radius is None:
        radius = np.array([material.radius for material in materials])[number]
    density = np.array([material.density for material in materials])[number]
    mass = constants.sphere_mass(radius, density)
    return GrainProperties(radius, mass, 0.4 * mass * radius**2, number.astype(np.int32))


def equal_properties(material):
    """GrainProperties of equal grains of a material."""
    mass, inertia = constants.grain_mass(material), constants.moment_of_inertia(material)
    return GrainProperties(material.radius, mass, inertia)
