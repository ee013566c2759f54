"""Checks that outputs come due and that measurements mean something."""

from dusttaichi import method
from dusttaichi.names import AXES
from dusttaichi.scene.boundary import bounded_axes
from dusttaichi.scene.output import applies

Found = list[tuple[str, str]]


def intervals(scene, path, plan) -> Found:
    """An interval must come due while the stage is driven as it is."""
    found = []
    for name in ("series", "profiles", "snapshots"):
        interval = getattr(plan, name)
        if interval is None or interval == "auto":
            continue
        where = f"{path}output.{name}"
        ready = applies(interval, scene.boundary, plan.drive)
        if interval.filling_factor is not None and not ready:
            text = (
                "the filling factor changes steadily only in a room that is bounded along all axes "
                "and driven one way; use strain, steps or time"
            )
            found.append((f"{where}.filling_factor", text))
        if interval.strain is not None and not ready:
            found.append((f"{where}.strain", "nothing strains; use steps or time"))
        step = scene.numerics.time_step
        if interval.time is not None and step != "auto" and interval.time < step:
            found.append((f"{where}.time", "it is shorter than numerics.time_step"))
    return found


def variables(scene) -> Found:
    """Names of what is written on request, or left out."""
    from dusttaichi.results.variables import optional  # with libraries that names do not wait for

    known = [v for v in method.of(scene).variables if optional(v)]
    names = {name: v for v in known for name in (v.key, v.name)}
    allowed = ", ".join(dict.fromkeys(v.name for v in known))
    found = []
    for number, name in enumerate(scene.output.variables):
        if name.removeprefix("-") not in names:
            text = f"there is nothing of that name to choose; allowed: {allowed}"
            found.append((f"output.variables.{number}", text))
    return found


def stress(scene) -> Found:
    """A stress needs a volume."""
    if scene.output.stress and bounded_axes(scene.boundary) != AXES:
        text = (
            "a stress needs a volume: a room that is bounded along all axes; "
            "use kind: box without omit or kind: periodic with all axes, or false"
        )
        return [("output.stress", text)]
    return []
