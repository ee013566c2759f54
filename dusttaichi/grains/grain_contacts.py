"""The grains of a scene and the constants of their contacts, in SI."""

from dataclasses import replace

import numpy as np

from dusttaichi.grains.state import GrainProperties
from dusttaichi.physics.contact import constants


def scaled(scene):
    """The scene with its materials as they are computed.

    numerics.mass_scaling is in their densities, stiffness_scaling in their moduli. A scene that
    this has made is returned as it is.
    """
    factors = scene.numerics.mass_scaling, scene.numerics.stiffness_scaling
    if factors == (1.0, 1.0) and scene.material.unscaled is scene.material:
        return scene
    kinds = {name: m.scaled(*factors) for name, m in scene.materials.items()}
    return scene.model_copy(
        update={"material": scene.material.scaled(*factors), "materials": kinds}
    )


def contact_constants(scene):
    """ContactConstants of two grains and of a grain and a wall of the scene's material."""
    return farthest_contacts(scene, None)


def glued(wall, boundary):
    """Constants of a wall contact [SI] with the normal force of glued plates."""
    return replace(wall, glue=boundary.glue if boundary.kind == "plates" else 1.0)


def grain_properties(scene, sample):
    """GrainProperties of a sample whose grains differ; None where they are equal."""
    if sample.radii is None and sample.materials is None:
        return None
    scene = scaled(scene)
    kinds = scene.all_materials
    number = np.zeros(len(sample), np.int32) if sample.materials is None else sample.materials
    radius = np.array([m.radius for m in kinds])[number] if sample.radii is None else sample.radii
    mass = constants.sphere_mass(radius, np.array([m.density for m in kinds])[number])
    return GrainProperties(radius, mass, 0.4 * mass * radius**2, number.astype(np.int32))


def equal_properties(material):
    """GrainProperties of equal grains of a material."""
    mass, inertia = constants.grain_mass(material), constants.moment_of_inertia(material)
    return GrainProperties(material.radius, mass, inertia)


def size_ranges(scene, polydisperse):
    """(material, smallest, largest radius [m]) of every material that the grains have.

    polydisperse: GrainProperties, None of equal grains.
    """
    if polydisperse is None:
        return [(scene.material, scene.material.radius, scene.material.radius)]
    out = []
    for number in np.unique(polydisperse.material):
        own = polydisperse.radius[polydisperse.material == number]
        out.append((scene.all_materials[number], float(own.min()), float(own.max())))
    return out


def radius_ends(scene, polydisperse):
    """(material, radius [m]) of the ends of the radii of every material."""
    ranges = size_ranges(scene, polydisperse)
    return [(material, r) for material, *radii in ranges for r in sorted(set(radii))]


def farthest_contacts(scene, polydisperse):
    """ContactConstants of two grains and of a grain and a wall that hold on farthest.

    polydisperse: GrainProperties, or None of equal grains.
    """
    scene = scaled(scene)
    kinds, interaction = size_ranges(scene, polydisperse), scene.interaction
    pairs = [
        constants.mixed_constants(a, r1, b, r2, interaction)
        for a, _, r1 in kinds
        for b, _, r2 in kinds
    ]
    walls = [constants.wall_constants(a, interaction, r, scene.material) for a, _, r in kinds]
    pair, wall = (max(some, key=lambda c: c.delta0) for some in (pairs, walls))
    return pair, glued(wall, scene.boundary)


def wall_overlaps(scene, polydisperse):
    """Overlap of each grain in equilibrium with a wall [m], (N,)."""
    scene = scaled(scene)
    kinds, out = scene.all_materials, {}
    grains = list(zip(polydisperse.radius.tolist(), polydisperse.material.tolist(), strict=True))
    for radius, number in set(grains):
        wall = constants.wall_constants(kinds[number], scene.interaction, radius, scene.material)
        out[radius, number] = wall.rest_overlap
    return np.array([out[grain] for grain in grains])
