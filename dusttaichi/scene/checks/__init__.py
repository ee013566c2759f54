"""Conditions that involve more than one block of a scene, by subject."""

from dusttaichi import method
from dusttaichi.physics.geometry import AXES
from dusttaichi.scene.boundary import bounded_axes
from dusttaichi.scene.checks import drive, stop
from dusttaichi.scene.checks.protocol import Scene
from dusttaichi.scene.fields import Block, Faults
from dusttaichi.scene.output import becomes_due
from dusttaichi.scene.stage import StagePlan


def check(scene: Scene) -> Faults:
    """Faults of the blocks that all methods share."""
    faults = [*drive.check_ends(scene), *drive.check_stage_drives(scene)]
    if not faults:
        prefixes = [f"stages.{n}." for n in range(len(scene.stages))] or [""]
        for path, plan in zip(prefixes, scene.stage_plans, strict=True):
            faults += [*drive.check_drive(scene, path, plan), *stop.check_stop(scene, path, plan)]
            faults += _check_intervals(scene, path, plan)
    faults += _check_ignored_keys(scene)
    return [*faults, *_check_stress(scene), *_check_variables(scene)]


def _check_ignored_keys(scene: Scene) -> Faults:
    """Refuse keys of the common blocks that the method of the scene does not read."""
    blocks: list[tuple[str, str, Block | None]] = [("output", "output", scene.output)]
    blocks.append(("stop", "stop", scene.stop))
    for n, stage in enumerate(scene.stages):
        blocks.append(("drive", f"stages.{n}.drive", stage.drive))
        blocks.append(("stop", f"stages.{n}.stop", stage.stop))
    for name, path, block in blocks:
        for key, item in type(block).model_fields.items() if block is not None else ():
            text = scene.IGNORED.get(f"{name}.{key}")
            if text is not None and getattr(block, key) != item.get_default():
                yield f"{path}.{key}", text


def _check_intervals(scene: Scene, path: str, plan: StagePlan) -> Faults:
    """Check that outputs of every interval become due under the drive of the stage."""
    for name in ("series", "profiles", "snapshots"):
        interval = getattr(plan, name)
        if interval is None or interval == "auto":
            continue
        key_path = f"{path}output.{name}"
        is_due = becomes_due(interval, scene.boundary, plan.drive)
        if interval.filling_factor is not None and not is_due:
            text = (
                "the filling factor changes steadily only in a box that is bounded along all axes "
                "and driven in one direction; use strain, steps or time"
            )
            yield f"{key_path}.filling_factor", text
        if interval.strain is not None and not is_due:
            yield f"{key_path}.strain", "nothing is strained; use steps or time"
        step = scene.numerics.time_step
        if interval.time is not None and step != "auto" and interval.time < step:
            yield f"{key_path}.time", "it is shorter than numerics.time_step"


def _check_variables(scene: Scene) -> Faults:
    """Check the names of optional outputs."""
    optional_variables = [v for v in method.find_method(scene).variables if v.is_optional]
    names = {name for v in optional_variables for name in (v.key, v.name)}
    allowed = ", ".join(dict.fromkeys(v.name for v in optional_variables))
    for number, name in enumerate(scene.output.variables):
        if name.removeprefix("-") not in names:
            text = f"there is no optional variable of that name; allowed: {allowed}"
            yield f"output.variables.{number}", text


def _check_stress(scene: Scene) -> Faults:
    """Check that a stress has a volume."""
    if scene.output.stress and bounded_axes(scene.boundary) != AXES:
        text = (
            "a stress needs a volume: a box that is bounded along all axes; "
            "use kind: box without omit or kind: periodic with all axes, or false"
        )
        yield "output.stress", text
