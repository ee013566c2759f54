"""Faces around a continuum: mirrors, periodic and rigid ones, and their Domain."""

from typing import NamedTuple

import numpy as np

from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.domain.cell import Cell
from dusttaichi.domain.domain import Domain
from dusttaichi.domain.walls import NORMALS, Box
from dusttaichi.physics.geometry import AXES, WALLS

DEPTH = 1.0  # [m] of a scene in two dimensions: forces and energies are per metre


class Surfaces(NamedTuple):
    """Faces and bodies with images or contacts, in the axes of the kernels.

    mirrors: (axis, side, plane [m]) of each; edges: (axis, low, high [m]) of each periodic axis.
    rigid: rows of `rigid` that have a surface.
    """

    mirrors: list
    edges: list
    rigid: tuple


def find_surfaces(scene, particles, bodies):
    """The Surfaces of a scene with its Particles and that many rigid bodies."""
    axes, boundary = list(particles.axes), scene.boundary
    faces = faces_of(boundary, "mirrors")
    mirrors = [(axes.index(k // 2), k % 2, float(particles.room[k // 2, k % 2])) for k in faces]
    periodic = [AXES.index(axis) for axis in boundary.periodic_axes]
    edges = [(axes.index(k), *map(float, particles.room[k])) for k in periodic]
    return Surfaces(mirrors, edges, (*stiff_faces(boundary), *range(FACES, FACES + bodies)))


def faces_of(boundary, *conditions):
    """Numbers of the faces with one of these conditions: "mirrors", "rigid", "layers"."""
    return [WALLS.index(wall) for name in conditions for wall in getattr(boundary, name, ())]


def stiff_faces(boundary):
    """Numbers of the faces at which dust ends as at a rigid plane."""
    return faces_of(boundary, "rigid", "layers")


def pressed_walls(scene, sample):
    """Names of the walls whose force is summed.

    Over particles of a layer, or contacts of a rigid face.
    """
    layers = {WALLS[face] for face in np.unique(sample.face) if face >= 0}
    return layers | set(getattr(scene.boundary, "rigid", ()))


def domain_of(scene, sample, dt):
    """The Domain of a scene at the start; in two dimensions it is a metre deep."""
    boundary, room = scene.boundary, np.array(sample.room)
    if sample.dimension == 2:
        room[1] = -0.5 * DEPTH, 0.5 * DEPTH
    box = cell = None
    if boundary.walls:
        present = np.array([wall in boundary.walls for wall in WALLS], np.int32)
        faces = np.where(np.isnan(room), _extent(sample), room)
        offset = (faces * np.array([1.0, -1.0])).ravel()
        box = Box(NORMALS, offset, np.zeros(6), present.astype(float), present)
    axes = tuple(AXES.index(axis) for axis in boundary.periodic_axes)
    if axes:
        periodic = np.isin(np.arange(3), axes)
        edges = np.where(periodic, room[:, 1] - room[:, 0], 0.0)
        centre = np.where(periodic, room.mean(axis=1), 0.0)
        cell = Cell(edges, np.zeros(3), np.zeros(3), centre, axes)
    density = np.array([material.solid_density for material in scene.all_materials])
    solid = np.sum(sample.mass / density[sample.material])
    return Domain(dt, solid, sample.spacing, box, cell)


def _extent(sample):
    """Lowest and highest place of the particles along each axis [m], (3, 2)."""
    return np.stack([sample.position.min(axis=0), sample.position.max(axis=0)], axis=1)
