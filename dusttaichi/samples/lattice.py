"""Crystals of grains in equilibrium contact: simple, body-centred, face-centred cubic, CCP.

Close packing from which grains are extracted at random (CPE of Wada et al. 2011) has `vacancies`.

A lattice consists of whole cells, so that it continues seamlessly with the `period`.
"""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator

from dusttaichi.errors import DustError
from dusttaichi.samples import cut
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample, check_grains
from dusttaichi.samples.sample_registry import SampleBlock, register
from dusttaichi.samples.values import BoxSize, Seed, exactly_one
from dusttaichi.scene.fields import Count, Faults, Field, Number, build_value_error

MOST_GRAINS = 2e7  # a mistyped size must not fill the memory

# Edges of the cell in distances of nearest neighbours, and its grains in edges.
CELLS = {
    "sc": ((1.0, 1.0, 1.0), ((0.0, 0.0, 0.0),)),
    "bcc": ((2 / 3**0.5,) * 3, ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5))),
    "fcc": ((2**0.5,) * 3, ((0.0, 0.0, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0))),
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


class LatticeSample(SampleBlock):
    """A crystal of grains in equilibrium contact that can be repeated without a seam."""

    refused: ClassVar[dict[str, str]] = dict.fromkeys(
        ("sizes", "shares"),
        "unequal grains cannot all touch at the sites of a lattice: some would overlap, others be "
        "apart; use random_packing, rbd, pca or bcca, or list positions (kind: explicit)",
    )

    kind: Literal["lattice"]
    structure: Literal["sc", "bcc", "fcc", "ccp"] = Field(
        description="simple cubic, body-centred cubic, face-centred cubic, or that with its "
        "close-packed layers across z"
    )
    cells: tuple[Count, Count, Count] | None = Field(
        None, description="number of cells along x, y, z; this, grains or size"
    )
    grains: Count | None = Field(
        None, description="number of grains, rounded up to whole cells in about a cube"
    )
    size: BoxSize | None = Field(
        None, description="[Lx, Ly, Lz] that is filled with as many whole cells as possible"
    )
    vacancies: Annotated[float, Number(ge=0, lt=1)] = Field(
        0.0, description="share of the sites without a grain, drawn at random"
    )
    seed: Seed | None = Field(
        None, description="seed of the vacancies, default 1; only with vacancies"
    )

    @field_validator("cells", mode="before")
    @classmethod
    def _three(cls, value: Any) -> Any:
        if value is not None and not (isinstance(value, (list, tuple)) and len(value) == 3):
            raise build_value_error(
                "a list of 3 whole numbers of at least 1 is needed, such as [10, 10, 10]"
            )
        return value

    def faults(self) -> Faults:
        yield from exactly_one(self, ("cells", "grains", "size"), "cells: [10, 10, 10]")
        if self.seed is not None and not self.vacancies:
            yield "seed", "it is allowed only together with vacancies"


@register(LatticeSample)
def make(spec: LatticeSample, materials: Materials) -> Sample:
    """The lattice of spec: grains at rest, the first one at the origin.

    `grains` is rounded up to whole cells: from somewhat less than a cube on, the shortest edge
    grows by a cell until there are enough. With `size` there are as many whole cells as fit into
    it, grain surfaces included. Vacancies leave out a share of the grains, also of the first one;
    that share is rounded to whole grains, and one grain remains. info: cells, and period, the edges
    of the periodic lattice [m].
    Raises DustError if no cell fits, or for too many grains.
    """
    edges, basis = (np.array(values) for values in CELLS[spec.structure])
    edges = edges * materials.distance
    cells = _cells(spec, edges, basis, materials.radius)
    count = cells.prod() * len(basis)
    check_grains(count, "sample", MOST_GRAINS, "the lattice", "Use fewer cells or a smaller size.")
    corners = np.stack(np.meshgrid(*(np.arange(n) for n in cells), indexing="ij"), -1)
    positions = (corners.reshape(-1, 1, 3) + basis).reshape(-1, 3) * edges
    if spec.vacancies:
        remaining_count = max(1, round(len(positions) * (1.0 - spec.vacancies)))
        rng = np.random.default_rng(1 if spec.seed is None else spec.seed)
        positions = positions[np.sort(rng.permutation(len(positions))[:remaining_count])]
    info = {"kind": "lattice", "structure": spec.structure, "grains": len(positions)}
    info |= {"cells": cells.astype(int).tolist(), "period": (cells * edges).tolist()}
    return Sample.at_rest(positions, info | {"equilibrium_distance": materials.distance})


def _cells(
    spec: LatticeSample, edges: NDArray[np.float64], basis: Any, radius: float | NDArray[np.float64]
) -> np.ndarray:
    """Number of cells along x, y, z, as floats: a mistyped size may be beyond the integers."""
    if spec.cells is not None:
        return np.array(spec.cells, dtype=np.float64)
    if spec.grains is not None:
        cube = (spec.grains / len(basis) * edges.prod()) ** (1 / 3)
        cells = np.maximum(np.floor(cube / edges) - 1, 1.0)  # not enough yet
        while cells.prod() * len(basis) < spec.grains:
            cells[np.argmin(cells * edges)] += 1
        return np.asarray(cells)
    size = np.array(spec.size)
    cut.check_size(size, radius)
    # the last grains of the basis are before the end of their cell
    over = basis.max(axis=0) * edges
    cells = np.floor((size - 2 * radius - over) / edges * (1 + 1e-12)) + 1
    if not (cells >= 1).all():
        raise DustError(
            f"sample.size: {cut.in_um(size)} contains no whole cell of {spec.structure}; allowed: "
            f"{cut.in_um(over + 2 * radius)} or more."
        )
    return np.asarray(cells)
