"""The grains of a scene and the constants of their contacts, in SI."""

import numpy as np

from dusttaichi import units
from dusttaichi.domain.walls import glued
from dusttaichi.grains.state import GrainProperties
from dusttaichi.physics.contact import constants


def moving(scene):
    """The scene with grains as heavy as they move: numerics.mass_scaling in their densities."""
    factor = scene.numerics.mass_scaling
    if factor == 1.0:
        return scene

    def heavier(material):
        return material.model_copy(update={"density": factor * material.density})

    return scene.model_copy(
        update={
            "material": heavier(scene.material),
            "materials": {name: heavier(m) for name, m in scene.materials.items()},
            "numerics": scene.numerics.model_copy(update={"mass_scaling": 1.0}),
        }
    )


def contact_constants(scene):
    """ContactConstants of two grains and of a grain and a wall of the scene."""
    scene = moving(scene)
    pair = constants.pair_constants(scene.material, scene.interaction)
    wall = constants.wall_constants(scene.material, scene.interaction)
    return pair, glued(wall, scene.boundary)


def grain_properties(scene, sample):
    """GrainProperties of a sample whose grains are not all alike; None where they are."""
    if sample.radii is None and sample.materials is None:
        return None
    scene = moving(scene)
    kinds = scene.all_materials
    number = np.zeros(len(sample), np.int32) if sample.materials is None else sample.materials
    radius = np.array([m.radius for m in kinds])[number] if sample.radii is None else sample.radii
    mass = constants.sphere_mass(radius, np.array([m.density for m in kinds])[number])
    return GrainProperties(
        radius / units.LENGTH,
        mass / units.MASS,
        0.4 * mass * radius**2 / units.INERTIA,
        number.astype(np.int32),
    )


def size_ranges(scene, polydisperse):
    """(material, smallest, largest radius [m]) of every material that the grains have."""
    radius, out = polydisperse.radius * units.LENGTH, []
    for number in np.unique(polydisperse.material):
        own = radius[polydisperse.material == number]
        out.append((scene.all_materials[number], float(own.min()), float(own.max())))
    return out


def farthest_contacts(scene, polydisperse):
    """ContactConstants of two grains and of a grain and a wall that hold on farthest."""
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
    """Overlap of each grain in equilibrium with a wall [um], (N,)."""
    kinds = scene.all_materials
    overlap = {
        key: constants.wall_constants(
            kinds[key[1]], scene.interaction, key[0] * units.LENGTH, scene.material
        ).delta0
        / units.LENGTH
        for key in set(
            zip(polydisperse.radius.tolist(), polydisperse.material.tolist(), strict=True)
        )
    }
    return np.array(
        [
            overlap[key]
            for key in zip(
                polydisperse.radius.tolist(), polydisperse.material.tolist(), strict=True
            )
        ]
    )
