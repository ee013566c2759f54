"""The guards of the continuum.

Numbers that are none, dust denser than its laws allow, bodies that have left through a face.
"""

import numpy as np

from dusttaichi import units
from dusttaichi.continuum.kernels.store import CENTRE, FACES
from dusttaichi.errors import GuardStop
from dusttaichi.method import moment
from dusttaichi.names import WALLS

BEYOND = 1.1
"""Density over that of phi_2 above which the elastic strain is too large for a linear law."""
ROUNDING = 1e-3
"""Distance [um] of the centre of a body beyond a face that counts as round-off."""


def validate(sim, measurement):
    """Raise GuardStop if the Measurement of a Simulation cannot be trusted."""
    m = measurement.parts
    when = moment(sim)
    if not np.isfinite(measurement.energy) or not np.isfinite(m["loss"]).all():
        raise GuardStop(
            f"{when} the energy is not a number: the step is too long for what happens. Try a "
            "smaller numerics.cfl, a larger numerics.viscosity.grid or a lower speed."
        )
    # of the dust that is nearest to its limit
    most, phi, unloaded = max(
        m["largest"], key=lambda row: max(row[1] / BEYOND / row[0], row[2] / row[0])
    )
    if phi > BEYOND * most or unloaded > most:
        raise GuardStop(
            f"{when} dust has the filling factor {phi:.4g}, and {unloaded:.4g} without "
            f"pressure; the model ends at {BEYOND * most:.4g}, and at {most:g} without pressure "
            "(material.compressive.phi_2), where its compressive strength has no bound. Try a "
            "lower speed, an earlier stop, or a smaller numerics.cfl."
        )


def check_inside(sim, box, names):
    """Raise GuardStop if the centre of a rigid body is beyond a face that is not open.

    box: domain.walls.Box of the moment, None where all is open. names: of the rigid bodies by their
    number, without those that are faces.
    """
    if box is None or not names:
        return
    centres = sim.rigid(CENTRE)[FACES:][list(names)] / units.LENGTH
    beyond = box.offsets(sim.time) - centres @ box.normal.T  # (bodies, 6) [um]
    beyond[:, box.present == 0] = -np.inf
    body, wall = np.unravel_index(np.argmax(beyond), beyond.shape)
    if beyond[body, wall] > ROUNDING:
        name, far = list(names.values())[body], 1e-3 * beyond[body, wall]
        raise GuardStop(
            f"{moment(sim)} {name} has passed through the {WALLS[wall]}: its centre is {far:.3g} "
            "mm outside. It has gone through all the dust that there was, and stops in none. Try a "
            "deeper sample, a lower speed, or an earlier stop."
        )
