"""Conditions that involve more than one block of a scene, by subject."""

from dusttaichi.scene.checks import drive, output, stop
from dusttaichi.scene.fields import Faults


def check(scene) -> Faults:
    """Faults of the blocks that all methods share."""
    found = [*drive.ends(scene), *drive.drive_of_stages(scene)]
    if not found:
        prefixes = [f"stages.{n}." for n in range(len(scene.stages))] or [""]
        for path, plan in zip(prefixes, scene.stage_plans, strict=True):
            found += [*drive.drive(scene, path, plan), *stop.stop(scene, path, plan)]
            found += output.intervals(scene, path, plan)
    return [*found, *output.stress(scene), *output.variables(scene)]
