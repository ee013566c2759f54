"""How many steps the stages of a scene take at most, before anything is computed."""

from dusttaichi.names import NEVER


def planned(scene, domain):
    """(name, steps at most, reason) of every stage, from the edges that each leaves behind.

    Steps are NEVER where only what is measured ends the stage; there the list ends.
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
