"""The load of a contact taken apart: normal and sliding force, rolling and twisting moment (NumPy).

The torques of S12 eqs 11 to 20 are M1 = M_r + r1 n1 x F_s + M_t n and M2 = -M_r + r2 n2 x F_s - M_t
n with n1 = -n2 = -n to first order, so that the sliding force falls out of r2 M1 - r1 M2.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.physics.geometry import dot_rows

PARTS = ("normal_force", "sliding_force", "rolling_moment", "twisting_moment")


def pair_parts(
    normal: NDArray[np.float64],
    load: Sequence[NDArray[np.float64]],
    radii: Sequence[ArrayLike],
    names: Collection[str] = PARTS,
) -> dict[str, NDArray[np.float64]]:
    """Parts of the loads of C pairs of grains, by PARTS, as `wall_parts` has them.

    normal: unit vectors from the second to the first grain (C, 3). load: force on the first grain,
    torques on both, (C, 3) each. radii: of both, numbers or (C,). names: of PARTS that are wanted.
    """
    force, torque_i, torque_j = load
    r1, r2 = (np.reshape(r, (-1, 1)) for r in radii)

    def turn() -> NDArray[np.float64]:
        moments: NDArray[np.float64] = (r2 * torque_i - r1 * torque_j) / (r1 + r2)
        return moments

    return _parts(normal, force, torque_i, turn, names)


def wall_parts(
    normal: NDArray[np.float64],
    load: Sequence[NDArray[np.float64]],
    radius: ArrayLike,
    names: Collection[str] = PARTS,
) -> dict[str, NDArray[np.float64]]:
    """Parts of the loads of C contacts of grains with walls, by PARTS.

    normal: into the room (C, 3). load: force and torque on the grain, (C, 3) each. Returns
    normal_force (C,), positive where it pushes; sliding_force (C, 3); rolling_moment (C, 3) and
    twisting_moment (C,), about the normal, on the (first) grain.
    """
    force, torque = load

    def turn() -> NDArray[np.float64]:
        return torque - np.cross(-np.reshape(radius, (-1, 1)) * normal, force)

    return _parts(normal, force, torque, turn, names)


def _parts(
    normal: NDArray[np.float64],
    force: NDArray[np.float64],
    torque: NDArray[np.float64],
    turn: Callable[[], NDArray[np.float64]],
    names: Collection[str],
) -> dict[str, NDArray[np.float64]]:
    """turn(): the torques without those of the sliding force, (C, 3)."""
    push = dot_rows(force, normal)

    def roll() -> NDArray[np.float64]:
        rolling = turn()
        return rolling - dot_rows(rolling, normal)[:, None] * normal

    makers: tuple[Callable[[], NDArray[np.float64]], ...] = (
        lambda: push,
        lambda: force - push[:, None] * normal,
        roll,
        lambda: dot_rows(torque, normal),
    )
    return {name: make() for name, make in zip(PARTS, makers, strict=True) if name in names}
