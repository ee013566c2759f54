"""Constants of every contact that the grains of a scene can have, each computed once, in SI."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from dusttaichi.grains.grain_properties import grain_properties, scale_materials
from dusttaichi.physics.contact import constants
from dusttaichi.physics.surfaces.surface_model import reduced_radius
from dusttaichi.scene.sphere import SMOOTH
from dusttaichi.units import LENGTH


def glue_wall(wall, boundary):
    """Constants of a wall contact [SI] with the normal force of glued plates."""
    return replace(wall, glue=boundary.glue if boundary.kind == "plates" else 1.0)


def surface_of(scene):
    """(Material with the sphere's density, factor on the surface energy), None without a sphere."""
    if scene.sphere is None:
        return None
    material = scene.sphere.surface(scene.all_materials, scene.material_names)
    return material, scene.sphere.adhesion or SMOOTH


class ContactTable:
    """ContactConstants of the grains of a scene with each other, with walls and with the sphere.

    Grains are given as (number of the material, radius [m]).

    scene: as it is computed (grain_properties.scale_materials). properties: GrainProperties, None
    of equal grains. curvatures: principal ones of each surface [1/um], once surfaces are placed.
    """

    def __init__(self, scene, properties=None):
        self.scene, self.properties = scale_materials(scene), properties
        self._computed, self.curvatures = {}, []

    @classmethod
    def for_sample(cls, scene, sample):
        """The table of a scene with the grains of a Sample."""
        return cls(scene, grain_properties(scene, sample))

    # -- single contacts -------------------------------------------------------------------------

    def pair(self, first, second):
        """ContactConstants of two grains."""
        return self._once(("pair", first, second), self._make_pair)

    def wall(self, grain):
        """ContactConstants of a grain and a wall, which is of the scene's material."""
        return self._once(("wall", grain), self._make_wall)

    def surface(self, grain, n):
        """ContactConstants of a grain and surface n: those of a wall with a reduced radius."""
        return self._once(("surface", grain, *self.curvatures[n]), self._make_surface)

    def sphere(self, grain):
        """ContactConstants of a grain and the rigid sphere of the scene."""
        return self._once(("sphere", grain), self._make_sphere)

    def _once(self, key, make):
        if key not in self._computed:
            self._computed[key] = make(*key[1:])
        return self._computed[key]

    def _make_pair(self, first, second):
        (a, r1), (b, r2) = first, second
        materials = self.scene.all_materials
        return constants.mixed_constants(materials[a], r1, materials[b], r2, self.scene.interaction)

    def _make_wall(self, grain):
        return glue_wall(self._make_bare_wall(grain), self.scene.boundary)

    def _make_bare_wall(self, grain):
        return constants.wall_constants(
            self.scene.all_materials[grain[0]],
            self.scene.interaction,
            grain[1],
            self.scene.material,
        )

    def _make_surface(self, grain, *curvatures):
        R = reduced_radius(grain[1], [k / LENGTH for k in curvatures])
        return replace(self._make_bare_wall(grain), R=R)

    def _make_sphere(self, grain):
        number, radius = grain
        scene, (surface, adhesion) = self.scene, surface_of(self.scene)
        contact = constants.mixed_constants(
            scene.all_materials[number], radius, surface, scene.sphere.radius, scene.interaction
        )
        return replace(contact, gamma=adhesion * contact.gamma)

    # -- extremes --------------------------------------------------------------------------------

    @cached_property
    def size_ranges(self):
        """(number of the material, smallest, largest radius [m]) of the materials of the grains."""
        if self.properties is None:
            radius = self.scene.material.radius
            return [(0, radius, radius)]
        ranges = []
        for number in np.unique(self.properties.material).tolist():
            radii = self.properties.radius[self.properties.material == number]
            ranges.append((number, float(radii.min()), float(radii.max())))
        return ranges

    @cached_property
    def extreme_grains(self):
        """The smallest and the largest grain of each material."""
        return [(number, r) for number, *radii in self.size_ranges for r in sorted(set(radii))]

    @cached_property
    def largest_grains(self):
        """The largest grain of each material."""
        return [(number, radius) for number, _, radius in self.size_ranges]

    @property
    def extreme_pairs(self):
        """ContactConstants of every two of the extreme grains."""
        return [self.pair(a, b) for a in self.extreme_grains for b in self.extreme_grains]

    @property
    def extreme_walls(self):
        """ContactConstants of the extreme grains and a wall, or a surface."""
        return [self.wall(grain) for grain in self.extreme_grains] + [
            self.surface(grain, n) for grain in self.extreme_grains for n in self.surface_numbers
        ]

    @property
    def surface_numbers(self):
        return range(len(self.curvatures))

    @cached_property
    def farthest_on_surfaces(self):
        """ContactConstants of the grain with the longest reach on each surface."""
        return [
            max((self.surface(grain, n) for grain in self.largest_grains), key=lambda c: c.delta0)
            for n in self.surface_numbers
        ]

    @property
    def extreme_spheres(self):
        """ContactConstants of the extreme grains and the sphere; none without one."""
        return [
            self.sphere(grain) for grain in self.extreme_grains if self.scene.sphere is not None
        ]

    @cached_property
    def farthest_pair(self):
        """ContactConstants of the two grains with the longest reach."""
        pairs = (self.pair(a, b) for a in self.largest_grains for b in self.largest_grains)
        return max(pairs, key=lambda c: c.delta0)

    @cached_property
    def farthest_wall(self):
        """ContactConstants of the grain and a wall with the longest reach."""
        return max(map(self.wall, self.largest_grains), key=lambda c: c.delta0)

    @cached_property
    def farthest_sphere(self):
        """ContactConstants of a grain and the sphere with the longest reach; None without one."""
        return max(self.extreme_spheres, key=lambda c: c.delta0, default=None)

    # -- all grains ------------------------------------------------------------------------------

    def wall_overlaps(self):
        """Overlap of each grain in equilibrium with a wall [m], (N,), or of equal grains."""
        if self.properties is None:
            return self.farthest_wall.rest_overlap
        numbers, radii = self.properties.material.tolist(), self.properties.radius.tolist()
        grains = list(zip(numbers, radii, strict=True))
        # constants of as many contacts as grains would take much memory
        overlaps = {grain: self._make_wall(grain).rest_overlap for grain in set(grains)}
        return np.array([overlaps[grain] for grain in grains])
