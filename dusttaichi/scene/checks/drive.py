"""Conditions on the stages, and on the drive of walls and faces with the boundary."""

from dusttaichi.physics.geometry import AXES
from dusttaichi.scene.boundary import BoxBoundary, PeriodicBoundary, PlatesBoundary, get_drive
from dusttaichi.scene.checks.protocol import Scene
from dusttaichi.scene.drive import FACE_LAWS, LOADS, SHEARS, SPEEDS, Drive
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.stage import StagePlan

NEEDED = {
    "pressure": "nothing that it could move; allowed with kind: box with its top wall, or "
    "kind: periodic, with the top wall among boundary.walls or along all three axes",
    "stress": "no cell that it could strain; allowed with kind: periodic along all three axes",
    "shear_speed": "no top wall that it could move along itself; allowed with kind: box, plates, "
    "or periodic with the top wall among boundary.walls",
    "shear_rate": "no cell that it could shear; allowed with kind: periodic along all three axes",
}


def check_ends(scene: Scene) -> Faults:
    """Check that the run, or each stage, has an end, and each stage a name of its own."""
    if scene.stop is None and not scene.stages:
        yield "stop", "it is missing (when the run ends); give stop, or stages with one each"
    if scene.stop is not None and scene.stages:
        yield "stop", "each of the stages has its own; remove this one"
        return
    names = [stage.name for stage in scene.stages]
    for n, name in enumerate(names):
        if name in names[:n]:
            yield (
                f"stages.{n}.name",
                f'the name "{name}" is used already; every stage needs its own',
            )


def check_stage_drives(scene: Scene) -> Faults:
    """Check that with stages the boundary itself has no drive."""
    drive = get_drive(scene.boundary)
    if scene.stages and drive.moves:
        for key in (*SPEEDS, *LOADS, *SHEARS):
            if getattr(drive, key):
                yield f"boundary.{key}", "with stages it belongs to the drive of each stage"


def check_drive(scene: Scene, path: str, plan: StagePlan) -> Faults:
    """Check that every key of the drive has something to move."""
    boundary = scene.boundary
    key_path = f"{path}drive" if path else "boundary"
    if plan.drive.wall_speed and "wall_speed" not in boundary.drives:
        text = (
            "there is no top wall that could move; allowed with kind: box, plates, or "
            "periodic with the top wall among boundary.walls"
        )
        if isinstance(boundary, BoxBoundary):
            text = (
                'the top wall is left out, so it cannot move; remove wall_speed, or "top" from '
                "boundary.omit"
            )
        yield f"{key_path}.wall_speed", text
    for law in FACE_LAWS:
        values = getattr(plan.drive, law)
        if values is None:
            continue
        if not isinstance(boundary, PeriodicBoundary):
            yield f"{key_path}.{law}", "it moves the faces of kind: periodic only"
        elif isinstance(values, tuple) and len(set(values)) > 1:
            # a single value for all axes is meant for the periodic ones
            pairs = zip(AXES, values, strict=True)
            open_ = [axis for axis, v in pairs if v and axis not in boundary.axes]
            if open_:
                yield f"{key_path}.{law}", f"the axis {open_[0]} is not periodic; give it 0"
    yield from _check_loads(scene, key_path, plan.drive)
    for name in plan.drive.surfaces:
        if text := find_unnamed_surface(scene, name):
            yield f"{key_path}.surfaces.{name}", text


def find_unnamed_surface(scene: Scene, name: str) -> str:
    """Fault of the name of a surface that the scene does not have; "" of one that it has."""
    names = [block.name for block in getattr(scene, "surfaces", ())]
    if name in names:
        return ""
    known = ", ".join(n for n in names if n is not None)
    allowed = f"allowed: {known}" if known else "give one of `surfaces` that name: its key is name"
    return f"there is no surface of that name; {allowed}"


def _check_loads(scene: Scene, key_path: str, drive: Drive) -> Faults:
    """Check that a load has something to move, and a shear something to shear."""
    boundary = scene.boundary
    idle = [k for k in (*LOADS, *SHEARS) if getattr(drive, k) and k not in boundary.drives]
    for key in idle:
        text = f"there is {NEEDED[key]}"
        if hasattr(boundary, "WITHOUT_LOADS"):
            text = boundary.WITHOUT_LOADS
        elif key == "pressure" and isinstance(boundary, PlatesBoundary):
            text = (
                "the sample between plates has no defined area for a pressure; use kind: box, or "
                "periodic with walls: [bottom, top]"
            )
        yield f"{key_path}.{key}", text
    if idle or boundary.periodic_axes != AXES:
        return
    if drive.shear_rate and drive.moving_faces and not drive.controls_load:
        text = "it is not allowed together with faces that move at a prescribed rate; use stress"
        yield f"{key_path}.shear_rate", text
    if drive.pressure is not None:
        for law in ("compression_rate", "face_speed"):
            if getattr(drive, law) is not None:
                text = "the edges follow the pressure; remove it, or give stress in place"
                yield f"{key_path}.{law}", text
        if drive.strain_rate is not None and len(set(drive.strain_rate)) > 1:
            text = "with pressure it is the largest rate of all three edges; give one"
            yield f"{key_path}.strain_rate", text
    if drive.controls_load and not scene.output.stress:
        text = "a controlled pressure or stress must be measured; set output.stress: true"
        yield "output.stress", text
