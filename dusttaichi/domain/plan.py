"""Largest number of steps of the stages of a scene, before anything is computed."""

from dusttaichi.names import NEVER


def planned(scene, domain):
    """(name, largest number of steps, reason) of every stage.

    Steps are NEVER where only a measured quantity ends the stage; there the list ends.
    """
    first, out = 0, []
    for plan in scene.stage_plans:
        domain = domain.driven(plan.drive, first)
        end, reason = domain.clock(first).last_step(plan.stop)
        out.append((plan.name, end - first if end < NEVER else NEVER, reason))
        if end == NEVER:
            break
        first = end
    return out
