"""Stages that are too short for load control to reach the load."""

from dusttaichi.scene import quantities

SETTLING = 15_000
"""Steps within which a load is reached; with or without softening it took 4000 to 13,000
(docs/studies/trade.md). The controller changes the speed after a number of steps, not a time."""


def remarks(scene, dt):
    """Sentences for the user about the stages that end before; dt: time step [s]."""
    return [
        f"stage {plan.name} controls a load for {steps:,} steps: reaching a load takes up to "
        f"{SETTLING:,}; end it with stop.creep, or give stop.time at least "
        f"{quantities.format(SETTLING * dt, 'time', digits=2)}"
        for plan in scene.stage_plans
        if plan.drive.controls_load and (steps := _steps(plan.stop, dt)) < SETTLING
    ]


def _steps(stop, dt):
    """Steps of a stage that ends after a time or a number of steps; infinite for others."""
    given = {key for key in type(stop).model_fields if getattr(stop, key) is not None}
    if not given or not given <= {"time", "steps"}:
        return float("inf")
    known = [stop.steps, None if stop.time is None else round(stop.time / dt)]
    return min(n for n in known if n is not None)
