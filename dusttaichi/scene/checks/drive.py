"""Stages, and the drive of walls and faces: what must go together with the boundary."""

from dusttaichi.names import AXES
from dusttaichi.scene.boundary import FACE_LAWS, BoxBoundary, PeriodicBoundary, own_drive

Found = list[tuple[str, str]]


def ends(scene) -> Found:
    if scene.stop is None and not scene.stages:
        return [("stop", "it is missing (when the run ends); give stop, or stages with one each")]
    if scene.stop is not None and scene.stages:
        return [("stop", "each of the stages has its own; remove this one")]
    names = [stage.name for stage in scene.stages]
    return [
        (f"stages.{n}.name", f'the name "{name}" is used already; every stage needs its own')
        for n, name in enumerate(names)
        if name in names[:n]
    ]


def drive_of_stages(scene) -> Found:
    """With stages, the drive belongs to them."""
    if not scene.stages or not own_drive(scene.boundary).moves:
        return []
    drive = own_drive(scene.boundary)
    keys = ("wall_speed", *FACE_LAWS)
    return [
        (f"boundary.{key}", "with stages it belongs to the drive of each stage")
        for key in keys
        if getattr(drive, key)
    ]


def drive(scene, path, plan) -> Found:
    """Every part of the drive must have something to move."""
    boundary, found = scene.boundary, []
    where = f"{path}drive" if path else "boundary"
    if plan.drive.wall_speed and "wall_speed" not in boundary.drives:
        left_out = isinstance(boundary, BoxBoundary)
        text = (
            'the top wall is left out, so it cannot move; remove wall_speed, or "top" from '
            "boundary.omit"
            if left_out
            else "there is no top wall that could move; allowed with kind: box, plates, or "
            "periodic with the top wall among boundary.walls"
        )
        found.append((f"{where}.wall_speed", text))
    for law in FACE_LAWS:
        values = getattr(plan.drive, law)
        if values is None:
            continue
        if not isinstance(boundary, PeriodicBoundary):
            found.append((f"{where}.{law}", "it moves the faces of kind: periodic only"))
        elif isinstance(values, tuple):
            # one value for all axes is meant for those that repeat
            idle = [
                axis
                for axis, v in zip(AXES, values, strict=True)
                if v and axis not in boundary.axes
            ]
            if idle and len(set(values)) > 1:
                found.append((f"{where}.{law}", f"the axis {idle[0]} does not repeat; give it 0"))
    return found
