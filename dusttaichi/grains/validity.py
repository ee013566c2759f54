"""The guards of grains: contacts too deep, grains beyond their walls, numbers that are none."""

import numpy as np

from dusttaichi.errors import GuardStop
from dusttaichi.grains.contacts import contact_state
from dusttaichi.grains.measure import grain_state, nearest_to_walls
from dusttaichi.method import moment
from dusttaichi.physics.geometry import WALLS

LARGEST_OVERLAP = 0.1  # of the radius: JKR is a law for small strains


def validate(sim, measurement, run, grains=slice(None)):
    """Raise GuardStop if the Measurement of a grain Simulation cannot be trusted.

    run: the method.Simulation, for the message. grains: those of the Measurement, by the sample's
    numbers, of which the message counts from the first on.
    """
    m, when = measurement.parts, moment(run)
    if not np.isfinite(measurement.energy) or not np.isfinite(m["loss"]).all():
        raise GuardStop(
            f"{when} the energy is not a number{_culprit(sim, grains)}: the step is too long for "
            f"what happens. {_start(run)} a smaller numerics.time_step or a lower speed."
        )
    if m["largest_strain"] > LARGEST_OVERLAP:
        raise GuardStop(
            f"{when} a contact{_deepest(sim, grains)} overlaps by {m['largest_strain']:.3g} of the "
            f"(smaller) radius, more than {LARGEST_OVERLAP:g}: adhesive elastic contacts mean "
            f"nothing there. {_start(run)} a lower wall speed, an earlier stop, or a smaller "
            "numerics.time_step."
        )
    _inside(sim, when)


def _start(run):
    """Sentence on the start, if it may be the cause, and the first word of what to try."""
    return f"At the start {run.suspect}. Otherwise try" if run.suspect else "Try"


def _culprit(sim, grains):
    x, v, _ = grain_state(sim)[:, grains]
    bad_rows = np.flatnonzero(~np.isfinite(x).all(axis=1) | ~np.isfinite(v).all(axis=1))
    return f" (grain {bad_rows[0]} first of {len(bad_rows)})" if len(bad_rows) else ""


def _deepest(sim, grains):
    pairs, (first, end, _) = contact_state(sim), grains.indices(sim.grains)
    i, j, overlap = (pairs[name] for name in ("grain_i", "grain_j", "overlap"))
    inside = (i >= first) & (i < end)
    if not inside.any():
        return " with a wall"
    radii = sim.grain_radii
    k = int(np.argmax(np.where(inside, overlap / np.minimum(radii[i], radii[j]), -np.inf)))
    return f" (grains {i[k] - first} and {j[k] - first} the deepest)"


def _inside(sim, when):
    if sim.sphere is not None and (passed := sim.sphere.walls_passed()):
        raise GuardStop(
            f"{when} the sphere has reached the wall {passed[0]}: contacts of sphere and walls are "
            "not computed. Stop earlier, leave the wall out, or take a larger room."
        )
    if sim.box is None:
        return
    distance, grain, wall = nearest_to_walls(sim)
    if distance < 0.0:
        raise GuardStop(
            f"{when} the centre of grain {grain} has gone through the wall {WALLS[wall]}. "
            "Try a lower speed or a smaller numerics.time_step."
        )
