"""Normals of the walls and tube of a Box at points of the room (NumPy; the kernels' surfaces)."""

from types import SimpleNamespace

import numpy as np

from dusttaichi.domain.walls import TUBE
from dusttaichi.physics.surfaces import cylinder


def normals_at(box, wall, x):
    """Unit normals of walls (n,) at points (n, 3), into the room."""
    flat = np.append(box.normal, np.zeros((1, 3)), axis=0)[wall]
    if not box.is_round:
        return flat
    curved = np.stack(cylinder.normal(np.transpose(x), _cylinder(box)), axis=1)
    return np.where((wall == TUBE)[:, None], curved, flat)


def offsets_at(box, wall, x, time):
    """x.normal of the points of walls (n,) that are nearest to points (n, 3) at a time."""
    flat = np.append(box.offsets(time), 0.0)[wall]
    if not box.is_round:
        return flat
    along = np.sum(x * normals_at(box, wall, x), axis=1)
    return np.where(wall == TUBE, along - cylinder.distance(np.transpose(x), _cylinder(box)), flat)


def distances_to(box, wall, x, time):
    """Distances of points (n, 3) from one wall at a time, (n,), negative beyond it."""
    if wall == TUBE:
        return cylinder.distance(np.transpose(x), _cylinder(box))
    return x @ box.normal[wall] - box.offsets(time)[wall]


def _cylinder(box):
    radius, x, y, _ = box.tube
    return SimpleNamespace(radius=radius, x=x, y=y)
