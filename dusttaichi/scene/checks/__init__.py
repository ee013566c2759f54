"""Conditions that involve more than one block of a scene, by subject."""

from dusttaichi import method
from dusttaichi.physics.geometry import AXES
from dusttaichi.scene.boundary import bounded_axes
from dusttaichi.scene.checks import drive, stop
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.output import applies


def check(scene) -> Faults:
    """Faults of the blocks that all methods share."""
    found = [*drive.ends(scene), *drive.drive_of_stages(scene)]
    if not found:
        prefixes = [f"stages.{n}." for n in range(len(scene.stages))] or [""]
        for path, plan in zip(prefixes, scene.stage_plans, strict=True):
            found += [*drive.drive(scene, path, plan), *stop.stop(scene, path, plan)]
            found += _intervals(scene, path, plan)
    return [*found, *_stress(scene), *_variables(scene)]


def _intervals(scene, path, plan) -> Faults:
    """Every interval must become due under the drive of the stage."""
    for name in ("series", "profiles", "snapshots"):
        interval = getattr(plan, name)
        if interval is None or interval == "auto":
            continue
        where = f"{path}output.{name}"
        due = applies(interval, scene.boundary, plan.drive)
        if interval.filling_factor is not None and not due:
            text = (
                "the filling factor changes steadily only in a box that is bounded along all axes "
                "and driven in one direction; use strain, steps or time"
            )
            yield f"{where}.filling_factor", text
        if interval.strain is not None and not due:
            yield f"{where}.strain", "nothing is strained; use steps or time"
        step = scene.numerics.time_step
        if interval.time is not None and step != "auto" and interval.time < step:
            yield f"{where}.time", "it is shorter than numerics.time_step"


def _variables(scene) -> Faults:
    """Names of optional outputs must be known."""
    from dusttaichi.results.variables import optional  # with libraries that names do not wait for

    known = [v for v in method.of(scene).variables if optional(v)]
    names = {name for v in known for name in (v.key, v.name)}
    allowed = ", ".join(dict.fromkeys(v.name for v in known))
    for number, name in enumerate(scene.output.variables):
        if name.removeprefix("-") not in names:
            text = f"there is no optional variable of that name; allowed: {allowed}"
            yield f"output.variables.{number}", text


def _stress(scene) -> Faults:
    """A stress needs a volume."""
    if scene.output.stress and bounded_axes(scene.boundary) != AXES:
        text = (
            "a stress needs a volume: a box that is bounded along all axes; "
            "use kind: box without omit or kind: periodic with all axes, or false"
        )
        yield "output.stress", text
