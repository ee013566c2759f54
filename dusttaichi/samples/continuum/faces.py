"""What stands at the faces of the room: dust that is held, rows of rigid walls, mirror planes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.names import AXES, WALLS
from dusttaichi.samples.continuum import lattice
from dusttaichi.samples.continuum.particles import DUST, HELD, WALL, Body, Particles, joined
from dusttaichi.samples.continuum.registry import lifted

ORDER = ("top", "bottom", "x_min", "x_max", "y_min", "y_max")  # who holds the dust of a corner


def with_faces(particles: Particles, boundary, support: float) -> Particles:
    """The sample in its room: layers held, rows of rigid walls behind their faces.

    boundary: open, or the FacesBoundary. support [m]: reach of the kernel, which rigid rows fill.
    The room of the result ends where something stands (of a layer its inner face), and is not a
    number where a face is open. Raises DustError for a layer or a periodic edge that the sample has
    no room for.
    """
    if boundary.kind == "open":
        return replace(particles, room=np.full((3, 2), np.nan))
    room = _room(particles, boundary)
    role, face = particles.role.copy(), particles.face.copy()
    for wall in ORDER:
        if wall in boundary.layers:
            axis, side = divmod(WALLS.index(wall), 2)
            x = particles.position[:, axis]
            beyond = x < room[axis, 0] if side == 0 else x > room[axis, 1]
            beyond &= role == DUST
            if not beyond.any():
                raise DustError(
                    f"boundary.{wall}.layer: no particle is in a layer of "
                    f"{boundary.layers[wall] * 1e6:g} um; take at least numerics.spacing, "
                    f"{particles.spacing * 1e6:g} um."
                )
            role[beyond], face[beyond] = HELD, WALLS.index(wall)
    if not (role == DUST).any() and (particles.role == DUST).any():
        raise DustError("boundary: the layers hold all of the dust; take thinner ones.")
    inside = replace(particles, role=role, face=face, room=room)
    rows = [_rows(inside, boundary, wall, support) for wall in boundary.rigid]
    together = joined([inside, *rows]) if rows else inside
    info = particles.info | {"held": int((role == HELD).sum()), "walls": sum(map(len, rows))}
    return replace(together, room=room, info=info)


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


def _rows(particles: Particles, boundary, wall: str, support: float) -> Particles:
    """The rows of a rigid wall: a slab as thick as the kernel reaches, beyond its face."""
    axis, side = divmod(WALLS.index(wall), 2)
    spacing, dimension, room = particles.spacing, particles.dimension, particles.room
    low = particles.position.min(axis=0) - spacing / 2
    high = particles.position.max(axis=0) + spacing / 2
    low, high = np.fmin(low, room[:, 0]), np.fmax(high, room[:, 1])
    for other in particles.axes:
        # corners belong to bottom and top, and to the faces of x before those of y
        first = other != 2 and (axis == 2 or (axis, other) == (0, 1))
        if AXES[other] in boundary.periodic_axes:
            low[other], high[other] = room[other]
        elif first and other != axis:
            open_sides = [boundary.face(WALLS[2 * other + side]) == "open" for side in range(2)]
            more = support + boundary.overhang * np.array(open_sides)
            low[other], high[other] = low[other] - more[0], high[other] + more[1]
    plane = room[axis, side]
    low[axis], high[axis] = (plane - support, plane) if side == 0 else (plane, plane + support)
    axes = list(particles.axes)
    size = (high - low)[axes]
    points = lattice.fill(size, spacing, "triangular" if dimension == 2 else "hexagonal")
    points += ((low + high) / 2)[axes]
    dust = particles.density[particles.role != WALL].mean()
    mass = np.full(len(points), dust * np.prod(size) / len(points))
    still = np.zeros(3)
    body = Body(
        wall, True, float(mass.sum()), (low + high) / 2, still, still, np.zeros((3, 3)), 0.0
    )
    return Particles(
        position=lifted(points),
        mass=mass,
        density=np.full(len(points), dust),
        role=np.full(len(points), WALL, np.int8),
        face=np.full(len(points), WALLS.index(wall), np.int8),
        spacing=spacing,
        dimension=dimension,
        bodies=(body,),
        info={"name": wall},
    )
