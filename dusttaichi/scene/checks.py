"""Conditions that involve more than one block of a scene."""

import math

from dusttaichi.scene.boundary import BoxBoundary, compresses
from dusttaichi.scene.sample import CylinderSize, ExplicitSample, RbdSample

Found = list[tuple[str, str]]
DENSEST = 0.74  # filling factor of the densest packing of equal spheres


def check(scene) -> Found:
    """Every problem as (dotted path, text)."""
    return [*_drive(scene), *_stop(scene), *_intervals(scene), *_sizes(scene), *_room(scene)]


def _drive(scene) -> Found:
    box = scene.boundary
    if isinstance(box, BoxBoundary) and "top" in box.omit and box.wall_speed > 0:
        return [
            (
                "boundary.wall_speed",
                "the top wall is left out, so it cannot move; "
                'remove wall_speed, or "top" from boundary.omit',
            )
        ]
    return []


def _stop(scene) -> Found:
    box, stop, found = scene.boundary, scene.stop, []
    is_box = isinstance(box, BoxBoundary)
    if stop.filling_factor is not None:
        if not is_box or not box.closed:
            found.append(
                (
                    "stop.filling_factor",
                    "it is never reached without all six walls; "
                    "use kind: box without omit, or stop by time or steps",
                )
            )
        elif box.wall_speed == 0:
            found.append(
                (
                    "stop.filling_factor",
                    "it is never reached while the top wall rests; "
                    'set boundary.wall_speed, for example "1 cm/s"',
                )
            )
    if stop.pressure is None:
        return found
    ends_anyway = stop.time is not None or stop.steps is not None
    if not is_box or "top" in box.omit:
        found.append(
            (
                "stop.pressure",
                "it is the pressure on the top wall, and there is none; "
                "use kind: box with its top wall, or stop by time or steps",
            )
        )
    elif box.wall_speed == 0 and not ends_anyway:
        found.append(
            (
                "stop.pressure",
                "it may never be reached while the top wall rests; "
                'set boundary.wall_speed, for example "1 cm/s", or add a time or steps',
            )
        )
    elif "bottom" in box.omit and not ends_anyway:
        found.append(
            ("stop.pressure", "it may never be reached without a bottom wall; add a time or steps")
        )
    return found


def _intervals(scene) -> Found:
    found = []
    for name in ("series", "profiles", "snapshots"):
        interval = getattr(scene.output, name)
        if interval is None:
            continue
        if interval.filling_factor is not None and not compresses(scene.boundary):
            found.append(
                (
                    f"output.{name}.filling_factor",
                    "the filling factor grows only in a "
                    "box with all six walls and a wall_speed above 0; use steps or time",
                )
            )
        step = scene.numerics.time_step
        if interval.time is not None and step != "auto" and interval.time < step:
            found.append((f"output.{name}.time", "it is shorter than numerics.time_step"))
    return found


def _lengths(size) -> tuple[float, ...]:
    if isinstance(size, CylinderSize):
        return (size.diameter, size.diameter, size.height)
    return size


def _sizes(scene) -> Found:
    diameter = 2 * scene.material.radius
    sizes = {}
    if isinstance(scene.boundary, BoxBoundary) and scene.boundary.size != "fit":
        sizes["boundary.size"] = scene.boundary.size
    if isinstance(scene.sample, RbdSample) and scene.sample.size is not None:
        sizes["sample.size"] = _lengths(scene.sample.size)
    return [
        (path, "every side must be at least as long as a grain is wide (2 x material.radius)")
        for path, size in sizes.items()
        if min(size) < diameter
    ]


def _room(scene) -> Found:
    """The sample must fit into a box whose size is given."""
    box, sample = scene.boundary, scene.sample
    if not isinstance(box, BoxBoundary) or box.size == "fit":
        return []
    radius = scene.material.radius
    grains = 0
    extent = (0.0, 0.0, 0.0)
    if isinstance(sample, RbdSample):
        grains = sample.grains or 0
        extent = _lengths(sample.size) if sample.size is not None else extent
    elif isinstance(sample, ExplicitSample) and sample.positions is not None:
        grains = len(sample.positions)
        columns = list(zip(*sample.positions, strict=True))
        extent = tuple(max(column) - min(column) + 2 * radius for column in columns)
    # The extent is a sum of rounded numbers; a millionth of a millionth is far below any length.
    if any(need > have * (1 + 1e-12) for need, have in zip(extent, box.size, strict=True)):
        return [("boundary.size", 'the sample does not fit into it; make it larger or write "fit"')]
    filling = grains * 4 / 3 * math.pi * radius**3 / math.prod(box.size)
    if filling > DENSEST:
        return [
            (
                "boundary.size",
                f"{grains} grains would fill {filling:.2f} of it, more than "
                f'{DENSEST}; make it larger or write "fit"',
            )
        ]
    return []
