"""Crystals of grains in equilibrium contact: simple, body-centred, face-centred cubic, CCP.

Whole cells, so that the lattice goes on without a seam where it is repeated after `period`.
"""

from __future__ import annotations

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.samples import cut
from dusttaichi.samples.sample import Sample

MOST_GRAINS = 2e7  # a mistyped size must not fill the memory

# Edges of the cell in distances of nearest neighbours, and its grains in edges.
CELLS = {
    "sc": ((1.0, 1.0, 1.0), ((0.0, 0.0, 0.0),)),
    "bcc": ((2 / 3**0.5,) * 3, ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5))),
    "fcc": (
        (2**0.5,) * 3,
        ((0.0, 0.0, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0)),
    ),
    # fcc with close-packed layers A, B, C across z, in an orthogonal cell.
    "ccp": (
        (1.0, 3**0.5, 6**0.5),
        (
            (0.0, 0.0, 0.0),
            (0.5, 1 / 2, 0.0),
            (0.5, 1 / 6, 1 / 3),
            (0.0, 2 / 3, 1 / 3),
            (0.0, 1 / 3, 2 / 3),
            (0.5, 5 / 6, 2 / 3),
        ),
    ),
}


def make(spec, radius: float, equilibrium_distance: float) -> Sample:
    """The lattice that spec asks for: grains at rest, the first one at the origin.

    spec: structure, and cells, grains or size, as the scene's LatticeSample has them.
    radius [m]; equilibrium_distance: between the centres of nearest neighbours [m].
    `grains` is rounded up to whole cells: from somewhat less than a cube on, the shortest edge
    grows by a cell until there are enough. With `size` there are as many whole cells as the size
    holds, grain surfaces included. info: cells, and period, the edges after which the lattice
    repeats itself [m].
    Raises DustError if no cell fits, or for more grains than the memory should hold.
    """
    edges, basis = (np.array(values) for values in CELLS[spec.structure])
    edges = edges * equilibrium_distance
    cells = _cells(spec, edges, basis, radius)
    if cells.prod() * len(basis) > MOST_GRAINS:
        raise DustError(
            f"sample: the lattice would have {cells.prod() * len(basis):.1e} grains; allowed: "
            f"{MOST_GRAINS:.0e}. Take fewer cells or a smaller size."
        )
    corners = np.stack(np.meshgrid(*(np.arange(n) for n in cells), indexing="ij"), -1)
    positions = (corners.reshape(-1, 1, 3) + basis).reshape(-1, 3) * edges
    sample = Sample.at_rest(positions)
    sample.info.update(
        kind="lattice",
        structure=spec.structure,
        grains=len(sample),
        equilibrium_distance=float(equilibrium_distance),
        cells=cells.astype(int).tolist(),
        period=(cells * edges).tolist(),
    )
    return sample


def _cells(spec, edges, basis, radius) -> np.ndarray:
    """Number of cells along x, y, z, as floats: a mistyped size may be beyond the integers."""
    if spec.cells is not None:
        return np.array(spec.cells, dtype=np.float64)
    if spec.grains is not None:
        cube = (spec.grains / len(basis) * edges.prod()) ** (1 / 3)
        cells = np.maximum(np.floor(cube / edges) - 1, 1.0)  # not enough yet
        while cells.prod() * len(basis) < spec.grains:
            cells[np.argmin(cells * edges)] += 1
        return cells
    size = np.array(spec.size)
    cut.check_room(size, radius)
    # The last grains of the basis stand before the end of their cell.
    over = basis.max(axis=0) * edges
    cells = np.floor((size - 2 * radius - over) / edges * (1 + 1e-12)) + 1
    if not (cells >= 1).all():
        raise DustError(
            f"sample.size: {cut.in_um(size)} holds no whole cell of {spec.structure}; allowed: "
            f"{cut.in_um(over + 2 * radius)} or more."
        )
    return cells
