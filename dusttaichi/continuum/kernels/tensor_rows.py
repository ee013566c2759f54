"""Rows of symmetric tensors in the fields of the kernels, and their components.

Samples and results have xx, yy, zz, xy, xz, yz (particle_arrays.COMPONENTS), the fields the rows of
a matrix of the dimension, one after another. In the plane x, z a deviator has yy = -(xx + zz).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

COMPONENT_OF_ROW = {2: (0, 4, 4, 2), 3: (0, 3, 4, 3, 1, 5, 4, 5, 2)}
"""Dimension -> number of the component at each row."""
ROW_OF_COMPONENT = {
    dimension: {component: numbers.index(component) for component in sorted(set(numbers))}
    for dimension, numbers in COMPONENT_OF_ROW.items()
}
"""Dimension -> number of a component -> its first row."""


def write_rows(components: NDArray[np.float64], dimension: int) -> NDArray[np.float64]:
    """Rows (n, dimension^2) of tensors with these components (n, 6)."""
    return components[:, list(COMPONENT_OF_ROW[dimension])]


def read_deviators(rows: NDArray[np.float64], dimension: int) -> NDArray[np.float64]:
    """Components (n, 6) of the deviators of these rows (n, dimension^2)."""
    row_of_component = ROW_OF_COMPONENT[dimension]
    if dimension == 3:
        return rows[:, list(row_of_component.values())]
    components = np.zeros((len(rows), 6))
    components[:, list(row_of_component)] = rows[:, list(row_of_component.values())]
    components[:, 1] = -(components[:, 0] + components[:, 2])
    return components
