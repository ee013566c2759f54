"""The Domain of a continuum: its faces as walls, its periodic cell."""

import numpy as np

from dusttaichi import units
from dusttaichi.domain.cell import Cell
from dusttaichi.domain.domain import Domain
from dusttaichi.domain.walls import NORMALS, Box
from dusttaichi.names import AXES, WALLS

DEPTH = 1.0 / units.LENGTH  # of a scene in two dimensions: forces and energies are per metre


def domain_of(scene, sample, dt):
    """The Domain of a scene at the start; in two dimensions it is a metre deep."""
    boundary, room = scene.boundary, np.array(sample.room) / units.LENGTH
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
    radius = sample.spacing / units.LENGTH
    return Domain(dt, solid / units.LENGTH**3, radius, box, cell)


def _extent(sample):
    """Lowest and highest place of the particles along each axis [um], (3, 2)."""
    x = sample.position / units.LENGTH
    return np.stack([x.min(axis=0), x.max(axis=0)], axis=1)
