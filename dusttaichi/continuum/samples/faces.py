"""Faces of the box: layers of fixed dust, rigid walls, mirror planes."""

from dataclasses import replace

import numpy as np

from dusttaichi.continuum.samples.particle_arrays import Particles
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES, WALLS
from dusttaichi.results.roles import DUST, FIXED

ORDER = ("top", "bottom", "x_min", "x_max", "y_min", "y_max")  # the dust of a corner is the first's


def with_faces(particles: Particles, boundary, reach: float = 0.0) -> Particles:
    """The sample within its faces, with fixed layers.

    boundary: open, or the FacesBoundary. reach [m]: cutoff of the neighbour lists, the smallest
    allowed periodic edge. `room` of the result has the positions of the faces (the inner one of a
    layer, half way between two rows), NaN where a face is open. Raises DustError for layers or
    periodic edges that do not fit the sample.
    """
    if boundary.kind == "open":
        return replace(particles, room=np.full((3, 2), np.nan))
    room = _room(particles, boundary)
    role, face = particles.role.copy(), particles.face.copy()
    _check_periods(boundary, room, reach)
    for wall in ORDER:
        if wall in boundary.layers:
            axis, side = divmod(WALLS.index(wall), 2)
            x = particles.position[:, axis]
            beyond = x < room[axis, 0] if side == 0 else x > room[axis, 1]
            beyond &= role == DUST
            if not beyond.any():
                raise DustError(
                    f"boundary.{wall}.layer: no particle is in a layer of "
                    f"{boundary.layers[wall] * 1e6:g} µm; use at least numerics.spacing, "
                    f"{particles.spacing * 1e6:g} µm."
                )
            role[beyond], face[beyond] = FIXED, WALLS.index(wall)
            room[axis, side] = _find_layer_end(x[beyond], x[role == DUST], side, room[axis, side])
    if not (role == DUST).any() and (particles.role == DUST).any():
        raise DustError("boundary: the layers contain all of the dust; use thinner ones.")
    info = particles.info | {"fixed": int((role == FIXED).sum())}
    return replace(particles, role=role, face=face, room=room, info=info)


def _check_periods(boundary, room, reach) -> None:
    """Raise DustError where a particle would see two images of another along one axis."""
    for name in boundary.periodic_axes:
        edge = np.ptp(room[AXES.index(name)])
        if edge < reach:
            raise DustError(
                f"boundary.periodic: the sample is {edge * 1e6:.4g} µm wide along {name}, and "
                f"particles reach {reach * 1e6:.4g} µm; allowed: no less than that. Use a wider "
                "sample, or a smaller numerics.spacing."
            )


def _find_layer_end(fixed, free, side, plane) -> float:
    """End of a layer [m]: half way between its last row and the first free one.

    It is at `plane` if no particle is free.
    """
    if not len(free):
        return plane
    return 0.5 * (fixed.max() + free.min() if side == 0 else fixed.min() + free.max())


def _room(particles: Particles, boundary) -> np.ndarray:
    """Positions of the faces [m], (3, 2); NaN where one is open."""
    extent = particles.room
    room = np.full((3, 2), np.nan)
    for number, wall in enumerate(WALLS):
        axis, side = divmod(number, 2)
        repeats = AXES[axis] in boundary.periodic_axes
        if boundary.face(wall) == "open" and not repeats:
            continue
        if not np.isfinite(extent[axis]).all():
            raise DustError(
                f"boundary: the sample has no extent along {AXES[axis]} that would determine the "
                f"position of {wall}; use a block, a sphere or several bodies."
            )
        inward = 1.0 if side == 0 else -1.0
        shift = boundary.layers.get(wall, 0.0)
        if wall in boundary.mirrors or wall in boundary.rigid:
            shift = -boundary.gap
        room[axis, side] = extent[axis, side] + inward * shift
    edges = room[:, 1] - room[:, 0]
    if (edges <= 0).any():
        axis = AXES[int(np.flatnonzero(edges <= 0)[0])]
        raise DustError(f"boundary: nothing is left between its layers along {axis}.")
    return room
