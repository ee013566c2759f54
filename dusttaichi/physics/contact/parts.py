"""The load of a contact taken apart: normal and sliding force, rolling and twisting moment (NumPy).

The torques of S12 eqs 11 to 20 are M1 = M_r + r1 n1 x F_s + M_t n and M2 = -M_r + r2 n2 x F_s - M_t
n with n1 = -n2 = -n to first order, so that the sliding force falls out of r2 M1 - r1 M2.
"""

import numpy as np


def pair_parts(normal, load, radii):
    """Parts of the loads of C pairs of grains, as `wall_parts` names them.

    normal: unit vectors from the second to the first grain (C, 3). load: force on the first grain,
    torques on both, (C, 3) each. radii: of both, numbers or (C,).
    """
    force, torque_i, torque_j = load
    r1, r2 = (np.reshape(r, (-1, 1)) for r in radii)
    return _parts(normal, force, torque_i, (r2 * torque_i - r1 * torque_j) / (r1 + r2))


def wall_parts(normal, load, radius):
    """Parts of the loads of C contacts of grains with walls.

    normal: into the room (C, 3). load: force and torque on the grain, (C, 3) each. Returns
    normal_force (C,), positive where it pushes; sliding_force (C, 3); rolling_moment (C, 3) and
    twisting_moment (C,), about the normal, on the (first) grain.
    """
    force, torque = load
    arm = -np.reshape(radius, (-1, 1)) * normal
    return _parts(normal, force, torque, torque - np.cross(arm, force))


def _parts(normal, force, torque, rolling):
    push = np.sum(force * normal, axis=1)
    return {
        "normal_force": push,
        "sliding_force": force - push[:, None] * normal,
        "rolling_moment": rolling - np.sum(rolling * normal, axis=1)[:, None] * normal,
        "twisting_moment": np.sum(torque * normal, axis=1),
    }
