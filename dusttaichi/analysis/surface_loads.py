"""Loads and displacements of the surfaces of a run along the directions in which they press."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


@dataclass(frozen=True)
class SurfaceCourse:
    """Course of a surface along its direction, SI; arrays (n,) over the records."""

    name: str  #: As in the result.
    time: NDArray[np.float64]  #: (n,).
    load: NDArray[np.float64]  #: Force on the grains, average since the last record, (n,).
    pressure: NDArray[
        np.float64
    ]  #: This over the area of the surface, not a number without one, (n,).
    displacement: NDArray[np.float64]  #: Since the start, (n,).


def measure_surfaces(run: Run) -> list[SurfaceCourse]:
    """SurfaceCourse of each surface of a run of grains that has moved, and has a direction."""
    if "surface_load" not in run.series:
        return []
    blocks, names = run.scene.get("surfaces", ()), run.series.surface.values.tolist()
    displacements, courses = run.series.surface_displacement.values, []
    first = len(names) - len(blocks)  # behind a tube
    for n, block in enumerate(blocks, start=first):
        direction = block.get("direction") or block.get("normal")
        if direction is None or not displacements[:, n].any():
            continue
        unit = np.array(direction, float) / np.linalg.norm(direction)
        course = SurfaceCourse(
            name=names[n],
            time=run.series.time.values,
            load=run.series.surface_load.values[:, n],
            pressure=run.series.surface_pressure.values[:, n],
            displacement=displacements[:, n] @ unit,
        )
        courses.append(course)
    return courses
