"""Walls and surfaces of a Domain at points of the room."""

import numpy as np

from dusttaichi.grains.kernels.store import PLANES
from dusttaichi.physics.geometry import WALLS, dot_rows


def name_walls(domain):
    """Names of the six walls, then of the surfaces, by their numbers."""
    return (*WALLS, *(() if domain.surfaces is None else domain.surfaces.names))


def list_present(domain):
    """True for each present wall, surfaces included."""
    count = 0 if domain.surfaces is None else len(domain.surfaces)
    return np.array([*(domain.box.present == 1), *[True] * count])


def normals_at(domain, wall, x, time):
    """Unit normals of walls (n,) at points (n, 3), into the sample."""
    out = domain.box.normal[np.minimum(wall, PLANES - 1)]
    return _put_surfaces(
        domain, wall, out, lambda n, rows: domain.surfaces.normals(n, x[rows], time)
    )


def offsets_at(domain, wall, x, time):
    """x.normal of the points of walls (n,) that are nearest to points (n, 3) at a time."""
    out = domain.box.offsets(time)[np.minimum(wall, PLANES - 1)]

    def offsets(n, rows):
        normal = domain.surfaces.normals(n, x[rows], time)
        return dot_rows(x[rows], normal) - domain.surfaces.distances(n, x[rows], time)

    return _put_surfaces(domain, wall, out, offsets)


def distances_to(domain, wall, x, time):
    """Distances of points (n, 3) from one wall or surface at a time, (n,)."""
    if wall >= PLANES:
        return domain.surfaces.distances(wall - PLANES, x, time)
    return x @ domain.box.normal[wall] - domain.box.offsets(time)[wall]


def strengths_at(domain, wall):
    """Factors on the springs of contacts with walls (n,)."""
    surfaces = [] if domain.surfaces is None else domain.surfaces.strengths()
    return np.append(domain.box.strength, surfaces)[wall]


def reduced_radii_at(domain, wall, radius):
    """Reduced radii of contacts of grains of radius (n,) with walls (n,)."""
    out = np.array(radius, float)
    return _put_surfaces(
        domain, wall, out, lambda n, rows: domain.surfaces.reduced_radius(n, radius[rows])
    )


def _put_surfaces(domain, wall, out, values_of):
    """out, with values_of(number of the surface, rows) in the rows of each surface."""
    for n in range(0 if domain.surfaces is None else len(domain.surfaces)):
        rows = wall == PLANES + n
        if rows.any():
            out[rows] = values_of(n, rows)
    return out
