"""Defaults that a scene of grains should not leave as they are, with the size of the error.

The numbers are those of the table in docs/numerics.md (docs/defaults.py).
"""

COARSE = 0.005
"""Strain between two records, that of `series: auto`, from which a short peak is missed."""
FEW = 2
"""Grains up to which a run costs nothing at a quarter of the step."""


def advice(scene, sample, impact):
    """Sentences for the user, one for each key to set.

    sample: the Sample of the scene; impact: the hardest Impact at the start, or None.
    """
    return [*_damping(scene), *_records(scene), *_step(scene, sample, impact)]


def _damping(scene):
    drives = [plan.drive for plan in scene.stage_plans]
    presses = any(d.moving_faces or d.controls_load or (d.wall_speed or 0.0) > 0.0 for d in drives)
    if "damping" in scene.interaction.model_fields_set or scene.material.poisson_ratio <= 0.0:
        return
    if presses or scene.sample.kind == "collision":
        yield (
            "interaction.damping: viscoelastic. The default, viscous as S12 print it, is less than "
            "a thousandth of critical: dust pressed by a fast wall becomes a gas with few contacts "
            "(200 grains at 20 kPa: filling factor 0.43 instead of 0.37), and colliding aggregates "
            "break up (at 1.5 m/s: growth efficiency -0.9 instead of 0.6)"
        )


def _records(scene):
    for plan in scene.stage_plans:
        interval = getattr(plan.series, "strain", None)
        speed = plan.drive.wall_speed or 0.0
        cut = scene.sample.kind == "cutout" and scene.boundary.kind == "plates" and speed > 0.0
        if (speed < 0.0 or cut) and interval is not None and interval >= COARSE:
            of = f" of {plan.name}" if plan.name else ""
            yield (
                f"output.series{of}: {{strain: 0.001}} or less where a wall is pulled up, or a "
                f"piece is pressed until it breaks. A record is a mean over {interval:g} of "
                "strain: the largest tension of six samples was a quarter too small, the strength "
                "of six discs a seventh, and unloading may end between two records"
            )


def _step(scene, sample, impact):
    rebounds = impact is not None and impact.energy > 1.0
    if rebounds and len(sample.positions) <= FEW and scene.numerics.accuracy != "reference":
        if scene.numerics.time_step == "auto":
            yield (
                "numerics.accuracy: reference for single contacts. With the default step two "
                "grains that collide at three times their sticking speed rebound 2 % too slowly"
            )
