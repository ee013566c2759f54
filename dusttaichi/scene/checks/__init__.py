"""Conditions that involve more than one block of a scene, by what they are about."""

from dusttaichi.scene.checks import drive, output, stop

Found = list[tuple[str, str]]


def check(scene) -> Found:
    """Every problem of the blocks that all methods share, as (dotted path, text)."""
    found = [*drive.ends(scene), *drive.drive_of_stages(scene)]
    if not found:
        for path, plan in zip(_paths(scene), scene.stage_plans, strict=True):
            found += [*drive.drive(scene, path, plan), *stop.stop(scene, path, plan)]
            found += output.intervals(scene, path, plan)
    return [*found, *output.stress(scene), *output.variables(scene)]


def _paths(scene) -> list[str]:
    """Prefix of the path of each stage's blocks."""
    return [f"stages.{n}." for n in range(len(scene.stages))] or [""]
