"""Stages, and the drive of walls and faces: what must go together with the boundary."""

from dusttaichi.names import AXES
from dusttaichi.scene.boundary import BoxBoundary, PeriodicBoundary, PlatesBoundary, own_drive
from dusttaichi.scene.drive import FACE_LAWS, LOADS, SHEARS, SPEEDS

Found = list[tuple[str, str]]

NEEDED = {
    "pressure": "nothing that it could move; allowed with kind: box with its top wall, or "
    "kind: periodic, with the top wall among boundary.walls or along all three axes",
    "stress": "no cell that it could strain; allowed with kind: periodic along all three axes",
    "shear_speed": "no top wall that it could move along itself; allowed with kind: box, plates, "
    "or periodic with the top wall among boundary.walls",
    "shear_rate": "no cell that it could shear; allowed with kind: periodic along all three axes",
}


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
    return [
        (f"boundary.{key}", "with stages it belongs to the drive of each stage")
        for key in (*SPEEDS, *LOADS, *SHEARS)
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
    return found + _loads(scene, where, plan.drive)


def _loads(scene, where, drive) -> Found:
    """A load needs something that it moves, and a shear something that it shears."""
    boundary = scene.boundary
    found = []
    for key in (*LOADS, *SHEARS):
        if not getattr(drive, key) or key in boundary.drives:
            continue
        if hasattr(boundary, "WITHOUT_LOADS"):
            text = boundary.WITHOUT_LOADS
        elif key == "pressure" and isinstance(boundary, PlatesBoundary):
            text = (
                "the sample between plates has no area of its own that a pressure could be that "
                "of; use kind: box, or periodic with walls: [bottom, top]"
            )
        else:
            text = f"there is {NEEDED[key]}"
        found.append((f"{where}.{key}", text))
    if found or boundary.periodic_axes != AXES:
        return found
    moving = drive.moving_faces and drive.stress is None and drive.pressure is None
    if drive.shear_rate and moving:
        text = "it is not allowed together with faces that move at a rate of their own; use stress"
        found.append((f"{where}.shear_rate", text))
    if drive.pressure is not None:
        found += [
            (f"{where}.{law}", "the edges follow the pressure; remove it, or give stress in place")
            for law in ("compression_rate", "face_speed")
            if getattr(drive, law) is not None
        ]
        if drive.strain_rate is not None and len(set(drive.strain_rate)) > 1:
            text = "with pressure it is the largest rate of all three edges; give one"
            found.append((f"{where}.strain_rate", text))
    if drive.held and not scene.output.stress:
        text = "the pressure or stress that is held must be measured; set output.stress: true"
        found.append(("output.stress", text))
    return found
