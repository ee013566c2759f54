"""Guards of grains: contacts that are too deep, grains beyond their walls."""

import numpy as np

from dusttaichi.errors import GuardStop
from dusttaichi.grains.wall_geometry import name_walls
from dusttaichi.method import moment

LARGEST_OVERLAP = 0.1  # of the radius: JKR is a law for small strains
PACKED = 0.6
"""Filling factor from which a closing box squeezes grains that have no space to move into: a little
below that of a random close packing of equal spheres, since grains beside walls are looser."""
RANDOM_CLOSE = 0.64  # filling factor (Scott & Kilgour 1969)
SQUEEZED = 0.02  # largest overlap over the radius, ten times that of micrometre grains at rest


def validate(measurement, run, motion, contacts, sphere, *, grains=slice(None)):
    """Raise GuardStop if the Measurement of grains is not valid.

    run: the method.Engine, for the message. motion: Motion. contacts: Contacts. sphere:
    MovingSphere, or None. grains: those of the Measurement, by the sample's numbers, of which the
    message counts from the first on.
    """
    strain = measurement.parts["largest_strain"]
    if strain > LARGEST_OVERLAP:
        start = f"At the start {run.suspect}. Otherwise try" if run.suspect else "Try"
        speed = _name_speed(motion, sphere)
        advice = f"{start} {speed}, an earlier stop, or a smaller numerics.time_step."
        if packing := explain_packing(measurement, motion):
            advice = f"{packing[:1].upper()}{packing[1:]}, or {speed}."
        raise GuardStop(
            f"{moment(run)} a contact{_find_deepest(contacts, grains)} overlaps by "
            f"{strain:.3g} of the (smaller) radius, more than {LARGEST_OVERLAP:g}: the contact "
            f"model does not hold there. {advice}"
        )
    _check_inside(run, motion, sphere)


def explain_packing(measurement, motion):
    """Cause and advice, without a full stop, where a closing box squeezes its grains; or ""."""
    environment = motion.environment
    closing = environment.domain.fastest_wall > 0.0 or environment.closing_speed() > 0.0
    if not closing or measurement.parts["largest_strain"] < SQUEEZED:
        return ""
    phi = motion.bodies.volume / np.prod(environment.lengths())
    if not phi >= PACKED:  # not a number in open space
        return ""
    return (
        f"the box is pressed past dense packing: its filling factor is {phi:.3g} "
        f"(random close packing: {RANDOM_CLOSE:g}). Stop earlier, with stop.filling_factor below "
        f"{PACKED:g} or a stop.pressure"
    )


def _name_speed(motion, sphere):
    """Speed to lower: of the walls, of the cell, of the sphere, or of the impact."""
    domain = motion.environment.domain
    if domain.fastest_wall > 0.0:
        return "a lower wall speed"
    if motion.environment.closing_speed() > 0.0:
        return "a lower strain rate"
    return "a lower impact speed" if sphere is None else "a lower speed of the sphere"


def name_invalid(motion, grains=slice(None)):
    """The first of these grains whose position or velocity is not a number, in brackets, or ""."""
    x, v, _ = motion.measure()[:, grains]
    invalid_grains = np.flatnonzero(~np.isfinite(x).all(axis=1) | ~np.isfinite(v).all(axis=1))
    return (
        f" (grain {invalid_grains[0]} first of {len(invalid_grains)})"
        if len(invalid_grains)
        else ""
    )


def _find_deepest(contacts, grains):
    pairs = contacts.measure_pairs()
    i, j, overlap = (pairs[name] for name in ("grain_i", "grain_j", "overlap"))
    first, end, _ = grains.indices(contacts.grain_count)
    inside = (i >= first) & (i < end)
    if not inside.any():
        return " with a wall"
    strain = overlap / contacts.smaller_radius(i, j)
    k = int(np.argmax(np.where(inside, strain, -np.inf)))
    return f" (grains {i[k] - first} and {j[k] - first} the deepest)"


def _check_inside(run, motion, sphere):
    if sphere is not None and (passed := sphere.walls_passed()):
        raise GuardStop(
            f"{moment(run)} the sphere has reached the wall {passed[0]}: contacts of sphere and "
            "walls are not computed. Stop earlier, leave the wall out, or take a larger room."
        )
    if motion.environment.box is None:
        return
    distance, grain, wall = motion.find_nearest_to_walls()
    names = name_walls(motion.environment.domain)
    if distance < 0.0:
        raise GuardStop(
            f"{moment(run)} the centre of grain {grain} has gone through the wall {names[wall]}. "
            "Try a lower speed or a smaller numerics.time_step."
        )
