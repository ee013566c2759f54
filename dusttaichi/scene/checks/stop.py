"""The conditions of `stop`: each must be one that can be met."""

from dusttaichi.names import AXES
from dusttaichi.scene.boundary import (
    PeriodicBoundary,
    PlatesBoundary,
    bounded_axes,
    filling_direction,
    strains,
)

Found = list[tuple[str, str]]


def stop(scene, path, plan) -> Found:
    """Every condition of a stage must be one that its drive can meet."""
    stop, found = plan.stop, []
    where = f"{path}stop"
    if stop.filling_factor is not None:
        found += _filling_factor(scene.boundary, plan.drive, f"{where}.filling_factor")
    ends_anyway = stop.time is not None or stop.steps is not None or stop.strain is not None
    if stop.pressure is not None:
        found += _pressure(scene, plan, ends_anyway, f"{where}.pressure")
    if stop.stress is not None and not scene.output.stress:
        found.append((f"{where}.stress", "no stress is measured; set output.stress: true"))
    found += _states(scene, stop, ends_anyway or stop.filling_factor is not None, where)
    if stop.creep is not None and not (plan.drive.held and bounded_axes(scene.boundary) == AXES):
        text = "no load is held in a room that is bounded; give drive a pressure or a stress"
        found.append((f"{where}.creep", text))
    moving = strains(scene.boundary, plan.drive)
    if stop.strain is not None and not moving:
        text = "nothing strains: no wall or face moves; stop by time or steps"
        if plan.drive.held:
            text = "strains follow the load here; stop by time, steps, creep or a filling factor"
        found.append((f"{where}.strain", text))
    if stop.past_maximum is not None:
        pulls = isinstance(scene.boundary, PlatesBoundary) or scene.output.stress
        if not moving:
            found.append((f"{where}.past_maximum", "nothing is pulled: no wall or face moves"))
        elif not pulls:
            found.append(
                (
                    f"{where}.past_maximum",
                    "no tension is measured; use kind: plates or periodic, or output.stress: true",
                )
            )
        elif not ends_anyway and stop.filling_factor is None:
            found.append(
                (
                    f"{where}.past_maximum",
                    "the tension may have no maximum; add a strain, "
                    "a time or steps as the latest end",
                )
            )
    return found


def _filling_factor(boundary, drive, where) -> Found:
    if isinstance(boundary, PlatesBoundary):
        if drive.wall_speed:
            return []
    elif bounded_axes(boundary) != AXES:
        return [
            (
                where,
                "it is never reached without all six walls; use kind: box without omit, "
                "kind: plates, or kind: periodic, or stop by time or steps",
            )
        ]
    elif filling_direction(boundary, drive) or drive.held:
        return []
    if isinstance(boundary, PeriodicBoundary):
        text = (
            "it is never reached: no face moves, or some move in and some out; set "
            "compression_rate, strain_rate or face_speed, or stop by strain, time or steps"
        )
        return [(where, text)]
    return [
        (
            where,
            "it is never reached while the top wall rests; "
            'set boundary.wall_speed, for example "1 cm/s"',
        )
    ]


def _states(scene, stop, ends_anyway, where) -> Found:
    """Rest, plateau and creep, which may never come to an end."""
    found = []
    if stop.plateau is not None and "top" not in scene.boundary.walls and not scene.output.stress:
        found.append(
            (f"{where}.plateau", "no pressure is measured; use a top wall or output.stress")
        )
    for name in ("rest", "plateau", "creep"):
        if getattr(stop, name) is not None and not ends_anyway:
            text = "it may never come; add a time or steps as the latest end"
            found.append((f"{where}.{name}", text))
    return found


def _pressure(scene, plan, ends_anyway, where) -> Found:
    boundary, drive, falling = scene.boundary, plan.drive, plan.stop.falling
    if scene.output.stress and bounded_axes(boundary) == AXES and boundary.periodic_axes:
        if drive.moves or ends_anyway:
            return []
        return [(where, "it may never be reached while no face moves; add a time or steps")]
    if "top" not in boundary.walls:
        return [
            (
                where,
                "it is the pressure on the top wall, and there is none; "
                "use kind: box or plates, or stop by time or steps",
            )
        ]
    if falling and not drive.wall_speed and not ends_anyway:
        return [(where, "it may never fall while the top wall rests; add a time or steps")]
    if not falling and not (drive.wall_speed or 0.0) > 0.0 and not ends_anyway:
        text = (
            "it may never be reached while the top wall rests; "
            'set boundary.wall_speed, for example "1 cm/s", or add a time or steps'
        )
        return [(where, text)]
    if "bottom" not in boundary.walls and not ends_anyway:
        return [(where, "it may never be reached without a bottom wall; add a time or steps")]
    return []
