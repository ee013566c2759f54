"""Conditions of `stop`: each must be one that can be met."""

from dusttaichi.physics.geometry import AXES
from dusttaichi.scene.boundary import (
    BoundaryBlock,
    PeriodicBoundary,
    PlatesBoundary,
    bounded_axes,
    filling_direction,
    has_strain,
)
from dusttaichi.scene.checks.drive import find_unnamed_surface
from dusttaichi.scene.checks.protocol import Scene
from dusttaichi.scene.drive import Drive
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.stage import StagePlan


def check_stop(scene: Scene, path: str, plan: StagePlan) -> Faults:
    """Check that the drive of a stage can meet every stop condition."""
    stop, boundary, drive = plan.stop, scene.boundary, plan.drive
    bounded = bounded_axes(boundary) == AXES
    key_path = f"{path}stop"
    if stop.filling_factor is not None:
        yield from _check_filling_factor(boundary, drive, f"{key_path}.filling_factor")
    ends_anyway = stop.time is not None or stop.steps is not None or stop.strain is not None
    if stop.pressure is not None:
        yield from _check_pressure(scene, plan, ends_anyway, f"{key_path}.pressure")
    if stop.stress is not None and not scene.output.stress:
        yield f"{key_path}.stress", "no stress is measured; set output.stress: true"
    ends_anyway = ends_anyway or stop.filling_factor is not None
    if stop.plateau is not None and "top" not in boundary.walls and not scene.output.stress:
        yield f"{key_path}.plateau", "no pressure is measured; use a top wall or output.stress"
    for name in ("rest", "plateau", "creep"):
        if getattr(stop, name) is not None and not ends_anyway:
            text = "it is not guaranteed to occur; add a time or steps as the latest end"
            yield f"{key_path}.{name}", text
    if stop.creep is not None and not (drive.controls_load and bounded):
        text = "no load is controlled in a bounded box; give drive a pressure or a stress"
        yield f"{key_path}.creep", text
    yield from _check_surfaces(scene, plan, ends_anyway, key_path)
    moving = has_strain(boundary, drive)
    if stop.strain is not None and not moving:
        text = "nothing is strained: no wall or face moves; stop by time or steps"
        if drive.controls_load:
            text = "strains follow the load here; stop by time, steps, creep or a filling factor"
        yield f"{key_path}.strain", text
    if stop.past_maximum is not None:
        fault = None
        if not moving:
            fault = "nothing is pulled: no wall or face moves"
        elif not (isinstance(boundary, PlatesBoundary) or scene.output.stress):
            fault = "no tension is measured; use kind: plates or periodic, or output.stress: true"
        elif not ends_anyway:
            fault = "the tension may have no maximum; add strain, time or steps as the latest end"
        if fault is not None:
            yield f"{key_path}.past_maximum", fault


def _check_surfaces(scene: Scene, plan: StagePlan, ends_anyway: bool, key_path: str) -> Faults:
    blocks = {block.name: block for block in getattr(scene, "surfaces", ())}
    for name, bounds in plan.stop.surfaces.items():
        path = f"{key_path}.surfaces.{name}"
        if text := find_unnamed_surface(scene, name):
            yield path, text
            continue
        if blocks[name].pressing_direction is None:
            yield path, f"it is along the direction of {name}, which has none; give it one"
        elif bounds.pressure is not None and not blocks[name].has_area(scene.boundary):
            text = "no area is defined; give the surface one, for example area: 300 um^2, or a "
            yield f"{path}.pressure", text + "force here"
        if not ends_anyway:
            yield path, "it is not guaranteed to occur; add a time or steps as the latest end"


def _check_filling_factor(boundary: BoundaryBlock, drive: Drive, key_path: str) -> Faults:
    if isinstance(boundary, PlatesBoundary):
        if drive.wall_speed:
            return
    elif bounded_axes(boundary) != AXES:
        text = (
            "it is never reached without all six walls; use kind: box without omit, "
            "kind: plates, or kind: periodic, or stop by time or steps"
        )
        yield key_path, text
        return
    elif filling_direction(boundary, drive) or drive.controls_load:
        return
    if isinstance(boundary, PeriodicBoundary):
        text = (
            "it is never reached: no face moves, or some move in and some out; set "
            "compression_rate, strain_rate or face_speed, or stop by strain, time or steps"
        )
    else:
        text = (
            "it is never reached while the top wall is stationary; "
            'set boundary.wall_speed, for example "1 cm/s"'
        )
    yield key_path, text


def _check_pressure(scene: Scene, plan: StagePlan, ends_anyway: bool, key_path: str) -> Faults:
    boundary, drive = scene.boundary, plan.drive
    speed, text = drive.wall_speed or 0.0, None
    if scene.output.stress and bounded_axes(boundary) == AXES and boundary.periodic_axes:
        if not drive.moves and not ends_anyway:
            text = "it may never be reached while no face moves; add a time or steps"
    elif "top" not in boundary.walls:
        text = (
            "it is the pressure on the top wall, and there is none; "
            "use kind: box or plates, or stop by time or steps"
        )
    elif ends_anyway:
        pass
    elif plan.stop.falling and not speed:
        text = "it may never fall while the top wall is stationary; add a time or steps"
    elif not plan.stop.falling and not speed > 0.0:
        text = (
            "it may never be reached while the top wall is stationary; "
            'set boundary.wall_speed, for example "1 cm/s", or add a time or steps'
        )
    elif "bottom" not in boundary.walls:
        text = "it may never be reached without a bottom wall; add a time or steps"
    if text is not None:
        yield key_path, text
