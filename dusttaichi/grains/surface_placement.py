"""The surfaces of a scene: the tube of its boundary, then those of the key `surfaces`.

Their walls are numbered in this order behind the six planes. Internal units.
"""

from types import SimpleNamespace

import numpy as np

from dusttaichi import units
from dusttaichi.domain.moving_surfaces import Surfaces
from dusttaichi.errors import DustError
from dusttaichi.physics.surfaces import cylinder
from dusttaichi.physics.surfaces.surface_model import (
    CURVATURE,
    SPIN,
    STRENGTH,
    VELOCITY,
    SurfaceModel,
)
from dusttaichi.scene.forces import find_law
from dusttaichi.scene.surfaces import make_motion

OVERLAP = 0.01  # of the radius, that a grain may overlap with a surface by at the start
UPRIGHT = (0.0, 0.0, 1.0)


def choose_surfaces(scene):
    """The SurfaceModel of a scene."""
    tube = [cylinder] * (scene.boundary.kind == "tube")
    return SurfaceModel((*tube, *(find_law(block) for block in scene.surfaces)))


def place_surfaces(table, positions, radii, overlaps):
    """Surfaces of the scene of a ContactTable around grains at the start; None without any.

    The table gets their curvatures. positions (N, 3); radii, overlaps in equilibrium with a flat
    wall: of the grains, one number or (N,) each.
    Raises DustError where the grains do not fit.
    """
    scene, model = table.scene, choose_surfaces(table.scene)
    if not model:
        return None
    rows, names = np.zeros((len(model), model.row_length)), []
    if tube := scene.boundary.kind == "tube":
        names.append("tube")
        _put_tube(scene.boundary, model, rows[0], positions, (radii, overlaps))
    for n, block in enumerate(scene.surfaces, start=len(names)):
        names.append(block.name or f"surfaces[{n - tube}] ({block.kind})")
        _put_numbers(model, n, rows[n], find_law(block).numbers(block))
        _put_motion(model, rows[n], block.velocity, block.spin, block.strength)
    motions = (*[None] * tube, *(make_motion(block, scene.boundary) for block in scene.surfaces))
    surfaces = Surfaces(model, rows, tuple(names), 0 if tube else None, motions)
    _put_curvatures(surfaces, float(np.max(radii)))
    table.curvatures = [surfaces.curvatures(n) for n in range(len(surfaces))]
    for n in range(tube, len(model)):
        _check_free(surfaces, n, f"surfaces[{n - tube}]", positions, np.ravel(radii))
    return surfaces


def _put_tube(boundary, model, row, positions, grains):
    """The row of the tube of a boundary, whose axis is in the middle of the sample.

    grains: their radii, and their overlaps at rest with a flat wall, one number or (N,) each; those
    with a curved one grow as R^(1/3) of JKR.
    """
    centre = 0.5 * (positions[:, :2].min(axis=0) + positions[:, :2].max(axis=0))
    if boundary.axis is not None:
        centre = np.array(boundary.axis) / units.LENGTH
    away = np.linalg.norm(positions[:, :2] - centre, axis=1)
    radii, overlaps = (np.ravel(a) for a in grains)
    flat = float(np.max(away + radii - overlaps))
    near = flat if boundary.radius == "fit" else boundary.radius / units.LENGTH
    widened = (1.0 - np.minimum(radii / near, 0.9)) ** (-1.0 / 6.0)
    needed = float(np.max(away + radii - overlaps * widened))
    radius = needed if boundary.radius == "fit" else boundary.radius / units.LENGTH
    if radius < needed * (1.0 - 1e-9):
        raise DustError(
            f"boundary.radius: the sample does not fit: it needs {needed:.4g} µm, there are "
            f"{radius:.4g} µm; enlarge it or use radius: fit"
        )
    place = [*(centre * units.LENGTH), 0.0]
    block = SimpleNamespace(radius=radius * units.LENGTH, centre=place, axis=UPRIGHT, side=1.0)
    _put_numbers(model, 0, row, cylinder.numbers(block))
    row[model.columns[0][0][1]] = radius  # without a change of units, which rounds
    row[model.width + model.columns[0][0][1]] = -boundary.closing_speed / units.SPEED
    spin = (0.0, 0.0, boundary.rotation)
    _put_motion(model, row, (0.0, 0.0, boundary.axial_speed), spin, boundary.side_walls)


def _put_numbers(model, n, row, values):
    """Numbers [SI] of surface n into its row."""
    for (name, first, components), number in zip(
        model.columns[n], model.laws[n].NUMBERS.values(), strict=True
    ):
        row[first : first + components] = np.array(values[name]) / units.GRAINS(number.unit)


def _put_motion(model, row, velocity, spin, strength):
    """Velocity [m/s], angular velocity [rad/s] and strength into the row of a surface."""
    for first, values, unit in ((VELOCITY, velocity, units.SPEED), (SPIN, spin, units.SPIN)):
        column = model.motion + first
        row[column : column + 3] = np.array(values) / unit
    row[model.motion + STRENGTH] = strength


def _put_curvatures(surfaces, radius):
    """Principal curvatures into the table; radius: of the largest grain, which must fit."""
    for n, law in enumerate(surfaces.model.laws):
        if not hasattr(law, "curvatures"):
            continue
        bent = law.curvatures(surfaces.numbers(n, 0.0))
        column = surfaces.model.motion + CURVATURE
        surfaces.table[n, column : column + 2] = bent
        if max(bent) * radius >= 1.0:
            raise DustError(
                f"{surfaces.names[n]}: it bends around the grains with a radius of "
                f"{1.0 / max(bent):.4g} µm, and the largest grain has {radius:.4g} µm; make it "
                "wider"
            )


def _check_free(surfaces, n, key, positions, radii):
    """Raise DustError where a grain overlaps with surface n at the start."""
    gap = surfaces.distances(n, positions, 0.0) - radii
    worst = int(np.argmin(gap))
    if gap[worst] < -OVERLAP * np.min(radii):
        raise DustError(
            f"{key}: grain {worst} of the sample, at {positions[worst].round(3).tolist()} µm, "
            f"overlaps with it by {-gap[worst]:.4g} µm; move it, or choose the other side"
        )
