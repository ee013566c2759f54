"""JKR's contact radius and stiffness by overlap on the host (NumPy; no Taichi).

With s = sqrt(a/a0): delta/delta0 = 3 s^4 - 2 s, F = 4 F_c (s^6 - s^3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.physics.contact.constants import PULL_OFF, S_PULL_OFF


def scaled_radius(overlap: ArrayLike) -> NDArray[np.float64]:
    """s for overlaps in units of delta0 (any shape): 3 s^4 - 2 s = overlap.

    Newton's method starts from above, where it cannot fail: the curve is convex. Below pull-off s
    is that of pull-off.
    """
    d = np.maximum(np.asarray(overlap, float), -PULL_OFF)
    s = (np.maximum(d, 0.0) / 3.0) ** 0.25 + 1.0
    for _ in range(60):
        s = s - (3.0 * s**4 - 2.0 * s - d) / np.maximum(12.0 * s**3 - 2.0, 1e-9)
    radius: NDArray[np.float64] = np.maximum(s, S_PULL_OFF)
    return radius


def slope(s: NDArray[np.float64]) -> NDArray[np.float64]:
    """dF/d delta over its value at equilibrium (s = 1). Near pull-off it is negative: no spring."""
    return 10.0 / 3.0 * (6.0 * s**5 - 3.0 * s**2) / np.maximum(12.0 * s**3 - 2.0, 1e-9)
