"""The guards of the continuum: dust denser than its solid, bodies that have left through a face."""

import numpy as np

from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.errors import GuardStop
from dusttaichi.method import moment
from dusttaichi.physics.geometry import WALLS

ROUNDING = 1e-9
"""Distance [m] of the centre of a body beyond a face that counts as round-off."""


def validate(measurement, environment):
    """Raise GuardStop if the Measurement in an Environment cannot be trusted."""
    phi_2, phi, unloaded = max(measurement.parts["largest"], key=lambda row: row[1])
    if phi > 1.0:
        raise GuardStop(
            f"{moment(environment)} dust has the filling factor {phi:.4g}, more than its solid "
            f"has. From {phi_2:g} on, the end of its compressive strength, dust is elastic; this "
            f"dust has {unloaded:.3g} without pressure, and its bulk modulus there does not "
            "withstand what happens. Try a lower speed, a larger material.bulk_modulus or "
            "material.exponent, an earlier stop, or a smaller numerics.cfl."
        )


def check_inside(state, environment, names):
    """Raise GuardStop if the centre of a rigid body is beyond a face that is not open.

    state: DustState. environment: Environment. names: of the rigid bodies by their number, without
    those that are faces.
    """
    box = environment.box
    if box is None or not names:
        return
    centres = state.of_bodies("centre")[FACES:][list(names)]
    beyond = box.offsets(environment.time) - centres @ box.normal.T  # (bodies, 6) [m]
    beyond[:, box.present == 0] = -np.inf
    body, wall = np.unravel_index(np.argmax(beyond), beyond.shape)
    if beyond[body, wall] > ROUNDING:
        name, far = list(names.values())[body], 1e3 * beyond[body, wall]
        raise GuardStop(
            f"{moment(environment)} {name} has passed through the {WALLS[wall]}: its centre is "
            f"{far:.3g} mm outside. It has gone through all the dust that there was, and stops in "
            "none. Try a deeper sample, a lower speed, or an earlier stop."
        )
