"""Defaults that a scene of the continuum should not leave as they are, with the size of the error.

The numbers are those of the table in docs/numerics.md (docs/defaults.py).
"""

import numpy as np

from dusttaichi.continuum.dust_placement import stiff_faces
from dusttaichi.scene import quantities

FAST = 1.0
"""Speed [m/s] from which fronts of compaction without viscosity are too dense."""
IMPACT = 2.0
"""Speed [m/s] from which the preset `impact` is that of the validation."""
ACROSS = 12
"""Spacings across an elastic body below which it enters dust by three quarters of its depth."""


def advice(scene, sample):
    """Sentences for the user, one for each key to set; sample: the Particles of the scene."""
    rules = _viscosity, _contact, _tension, _spacing
    return [text for rule in rules for text in rule(scene, sample)]


def _viscosity(scene, sample):
    viscosity = scene.numerics.viscosity
    walls = [abs(plan.drive.wall_speed or 0.0) for plan in scene.stage_plans]
    fastest = max(*walls, float(np.linalg.norm(np.ptp(sample.velocity, axis=0))), _flight(sample))
    if sample.is_dust.any() and not viscosity.by_pairs and fastest >= FAST:
        preset = "front" if fastest < IMPACT else "impact"
        yield (
            f"numerics.viscosity: {preset}. Without viscosity, pressed dust becomes too dense (on "
            "average by 8 % at 2 m/s and 17 % at 5 m/s), and colliding bodies compact 12 to 21 % "
            "too much mass"
        )


def _flight(sample):
    """Largest speed of a body [m/s]."""
    return max((float(np.linalg.norm(body.velocity)) for body in sample.bodies), default=0.0)


def _contact(scene, sample):
    if scene.numerics.contact == "separate" or not _flight(sample):
        return
    stiff = bool(stiff_faces(scene.boundary))
    elastic = sum(body.elastic for body in sample.bodies)
    if elastic and (stiff or elastic > 1):
        yield (
            "numerics.contact: separate, unless elastic bodies shall stick to what they touch, "
            "however hard they are pulled: a rubber disc rebounds from a wall with 0.91 of its "
            "speed instead of 0.97"
        )
    elif stiff and len(sample.bodies) == 1 and not sample.bodies[0].rigid:
        yield (
            "numerics.contact: separate, unless dust shall stick to the wall with its tensile "
            "strength: soft dust at 0.2 m/s rebounds with 0.01 of its speed instead of 0.34"
        )


def _tension(scene, sample):
    """Dust between two faces that hold it and move apart."""
    pulled = any((plan.drive.wall_speed or 0.0) < 0.0 for plan in scene.stage_plans)
    if not pulled or not sample.is_dust.any() or scene.numerics.artificial_stress is not None:
        return
    boundary = scene.boundary
    holding = set(boundary.layers) | {"bottom"} & set(boundary.mirrors)
    if scene.numerics.contact != "separate":
        holding |= set(boundary.rigid)
    if holding >= {"top", "bottom"}:
        yield (
            "numerics.artificial_stress: on, where dust is pulled apart. Without it its particles "
            "pair before it yields (numerical fracture), and a guard stops the run"
        )


def _spacing(scene, sample):
    """Elastic bodies that meet dust."""
    sizes = [body.size for body in sample.bodies if body.elastic]
    if sizes and sample.is_dust.any() and min(sizes) < ACROSS * sample.spacing:
        across = min(sizes) / sample.spacing
        spacing = quantities.format(float(f"{min(sizes) / ACROSS:.2g}"), "length")
        yield (
            f"numerics.spacing: {spacing} or less, and a second run to extrapolate. The smallest "
            f"elastic body is {across:.0f} spacings across: with 7, 10 and 13 of them a bead "
            "entered dust by 0.66, 0.78 and 0.83 of the depth at spacing zero"
        )
