"""Surfaces in a periodic cell: those that do not cross its faces, or are the same at each image."""

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES
from dusttaichi.scene.surfaces import list_motions

POINTS = 201  # of a face along each edge, at which distances are computed
SAME = 1e-9  # of the edge, by which distances of images may differ
CLEAR = 2.0  # radii of the largest grain, that a surface must be away from faces


def check_in_cell(surfaces, cell, grains, scene):
    """Raise DustError for Surfaces that a periodic Cell would cut, now or as they move.

    Either may be None. grains: positions (N, 3) of the sample and the largest radius.
    """
    if surfaces is None or cell is None:
        return
    if cell.tilt:
        raise DustError(
            "surfaces: the cell of the other run has been sheared, and a surface is not; allowed: "
            "sample.keep without box"
        )
    for n, name in enumerate(surfaces.names):
        for axis in cell.axes:
            if not is_repeated(surfaces, n, cell, axis):
                _check_rest(scene, name, n, axis)
                _check_faces(surfaces, n, cell, axis, grains)


def is_repeated(surfaces, n, cell, axis):
    """True where surface n is the same at the images along a periodic axis."""
    edge, shift = cell.edges(0.0)[axis], np.zeros(3)
    shift[axis] = edge
    x = np.random.default_rng(0).uniform(-edge, edge, (200, 3))
    here, beyond = (surfaces.distances(n, at, 0.0) for at in (x, x + shift))
    return bool(np.abs(beyond - here).max() < SAME * edge)


def _check_rest(scene, name, n, axis):
    for motions in list_motions(scene):
        motion = motions[n]
        presses = motion.load is not None and motion.direction[axis]
        if motion.velocity[axis] or presses:
            raise DustError(
                f"{name}: it moves along {AXES[axis]}, which is periodic, towards the faces of the "
                "cell; allowed: motion along other axes, or of a surface that is the same along "
                f"{AXES[axis]}"
            )


def _check_faces(surfaces, n, cell, axis, grains):
    """Raise DustError where a surface is near the faces across an axis; grains: see above."""
    (positions, radius), low, edges = grains, cell.low(0.0), cell.edges(0.0)
    periodic = np.isin(np.arange(3), cell.axes)
    low = np.where(periodic, low, positions.min(axis=0))
    high = np.where(periodic, low + edges, positions.max(axis=0))
    # along open axes as far as the surface is, which may move there
    away = abs(surfaces.distances(n, 0.5 * (low + high)[None], 0.0)[0]) + edges.max()
    low, high = np.where(periodic, low, low - away), np.where(periodic, high, high + away)
    ends = [np.linspace(low[other], high[other], POINTS) for other in range(3)]
    others = [other for other in range(3) if other != axis]
    face = np.empty((POINTS, POINTS, 3))
    face[..., others[0]], face[..., others[1]] = np.meshgrid(*(ends[k] for k in others))
    nearest = np.inf
    for end in (low[axis], high[axis]):
        face[..., axis] = end
        distances = surfaces.distances(n, face.reshape(-1, 3), 0.0)
        nearest = min(nearest, float(np.abs(distances).min()))
    # distances between the points of the grid
    nearest -= 0.5 * np.hypot(*(ends[k][1] - ends[k][0] for k in others))
    if nearest < CLEAR * radius:
        raise DustError(
            f"{surfaces.names[n]}: it crosses the faces of the cell across {AXES[axis]}, or is "
            f"nearer to them than a grain; allowed: a distance of {CLEAR * radius:.4g} µm and "
            f"more, or a surface that is the same along {AXES[axis]}, as a cylinder along it"
        )
