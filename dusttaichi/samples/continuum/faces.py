"""Faces of the box: layers of fixed dust, rigid walls, mirror planes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.names import AXES, WALLS
from dusttaichi.samples.continuum.particles import DUST, HELD, Particles

ORDER = ("top", "bottom", "x_min", "x_max", "y_min", "y_max")  # who holds the dust of a corner


def with_faces(particles: Particles, boundary, reach: float = 0.0) -> Particles:
    """The sample in its room, its layers held.

    boundary: open, or the FacesBoundary. reach [m]: of the neighbour lists, which no periodic edge
    may be shorter than. The room of the result ends where something is (of a layer
    its inner face, half way between two rows), and is not a number where a face is open. Raises
    DustError for a layer or a periodic edge that the sample has no room for.
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
                    f"{boundary.layers[wall] * 1e6:g} µm; take at least numerics.spacing, "
                    f"{particles.spacing * 1e6:g} µm."
                )
            role[beyond], face[beyond] = HELD, WALLS.index(wall)
            room[axis, side] = _between(x[beyond], x[role == DUST], side, room[axis, side])
    if not (role == DUST).any() and (particles.role == DUST).any():
        raise DustError("boundary: the layers hold all of the dust; take thinner ones.")
    info = particles.info | {"held": int((role == HELD).sum())}
    return replace(particles, role=role, face=face, room=room, info=info)


def _check_periods(boundary, room, reach) -> None:
    """Raise DustError where a particle would see two images of another along one axis."""
    for name in boundary.periodic_axes:
        edge = np.ptp(room[AXES.index(name)])
        if edge < reach:
            raise DustError(
                f"boundary.periodic: the sample is {edge * 1e6:.4g} µm wide along {name}, and "
                f"particles reach {reach * 1e6:.4g} µm; allowed: no less than that. Take a wider "
                "sample, or a smaller numerics.spacing."
            )


def _between(held, free, side, plane) -> float:
    """Where a layer ends [m]: half way between its last particles and the first ones that move, as
    rows of a lattice are cut; at `plane` where there is none of these."""
    if not len(free):
        return plane
    return 0.5 * (held.max() + free.min() if side == 0 else held.min() + free.max())


def _room(particles: Particles, boundary) -> np.ndarray:
    """Where faces stand [m], (3, 2); not a number where one is open."""
    extent = particles.room
    room = np.full((3, 2), np.nan)
    for number, wall in enumerate(WALLS):
        axis, side = divmod(number, 2)
        repeats = AXES[axis] in boundary.periodic_axes
        if boundary.face(wall) == "open" and not repeats:
            continue
        if not np.isfinite(extent[axis]).all():
            raise DustError(
                f"boundary: the sample has no extent along {AXES[axis]} on which {wall} could "
                "stand; take a block, a sphere or several bodies."
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
