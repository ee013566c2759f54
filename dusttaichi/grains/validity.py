"""The guards of grains: contacts too deep, grains beyond their walls, numbers that are none."""

import numpy as np

from dusttaichi.errors import GuardStop
from dusttaichi.grains.contacts import contact_state
from dusttaichi.grains.measure import grain_state, nearest_to_walls
from dusttaichi.method import moment
from dusttaichi.physics.geometry import WALLS

LARGEST_OVERLAP = 0.1  # of the radius: JKR is a law for small strains


def validate(sim, measurement, run):
    """Raise GuardStop if the Measurement of a grain Simulation cannot be trusted.

    run: the method.Simulation, for the message.
    """
    m, when = measurement.parts, moment(run)
    if not np.isfinite(measurement.energy) or not np.isfinite(m["loss"]).all():
        raise GuardStop(
            f"{when} the energy is not a number{_culprit(sim)}: the step is too long for what "
            f"happens. {_start(run)} a smaller numerics.time_step or a lower speed."
        )
    if m["largest_strain"] > LARGEST_OVERLAP:
        raise GuardStop(
            f"{when} a contact{_deepest(sim)} overlaps by {m['largest_strain']:.3g} of the "
            f"(smaller) radius, more than {LARGEST_OVERLAP:g}: adhesive elastic contacts mean "
            f"nothing there. {_start(run)} a lower wall speed, an earlier stop, or a smaller "
            "numerics.time_step."
        )
    _inside(sim, when)


def _start(run):
    """Sentence on the start, if it may be the cause, and the first word of what to try."""
    return f"At the start {run.suspect}. Otherwise try" if run.suspect else "Try"


def _culprit(sim):
    x, v, _ = grain_state(sim)
    bad = np.flatnonzero(~np.isfinite(x).all(axis=1) | ~np.isfinite(v).all(axis=1))
    return f" (grain {bad[0]} first of {len(bad)})" if len(bad) else ""


def _deepest(sim):
    pairs = contact_state(sim)
    if len(pairs["overlap"]) == 0:
        return " with a wall"
    radii = sim.grain_radii
    k = int(
        np.argmax(pairs["overlap"] / np.minimum(radii[pairs["grain_i"]], radii[pairs["grain_j"]]))
    )
    return f" (grains {pairs['grain_i'][k]} and {pairs['grain_j'][k]} the deepest)"


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
