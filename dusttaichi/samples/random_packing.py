"""Random packing of spheres in a periodic cell, up to just below random close packing.

Grains start at random points and push each other apart: the energy, a spring for every overlap,
is minimised until no two centres are closer than the equilibrium distance of a contact. Below
random close packing (0.64) such minima without overlap exist and are found. Pairs up to 2 r apart
are nevertheless in contact, slightly stretched, and attract each other when a run starts: about
four per grain at 0.61, three at 0.6, one at 0.55. Without gravity, friction and adhesion, this is
not a model of the formation of a packing.
"""

import math
from typing import Annotated, Any, Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from dusttaichi.errors import DustError
from dusttaichi.samples import cut
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.mixture import Crowd, Grains, MixtureBlock, place_grains
from dusttaichi.samples.sample import Sample, check_grains
from dusttaichi.samples.sample_registry import register
from dusttaichi.samples.values import BoxSize, exactly_one
from dusttaichi.scene.fields import AnyScene, Count, Faults, Field, Number
from dusttaichi.scene.making import Cost, report_progress

MOST_GRAINS = 2e5  # minutes
SECONDS = 2.5e-4  # of a round and a grain
ATTEMPTS = 5  # from other points: tens of grains may jam earlier
MOST_ROUNDS = 40
ROUND = 200  # evaluations between two checks of the remaining overlaps
MARGIN = 0.02  # overlaps delta0: additional reach of the springs, so that no overlap remains


class RandomPackingSample(MixtureBlock):
    """Grains packed at random in a periodic cell, up to just below random close packing."""

    kind: Literal["random_packing"]
    grains: Count | None = Field(
        None, description="number of grains, in a cube; either this or size"
    )
    size: BoxSize | None = Field(
        None, description="[Lx, Ly, Lz] of the cell; either this or grains"
    )
    filling_factor: Annotated[float, Number(gt=0, le=0.62)] = Field(
        0.6, description="grain volume over the volume of the cell"
    )

    def cost(self, scene: AnyScene) -> Cost:
        grains: float = self.grains or 0
        if self.size is not None:
            sphere = 4 / 3 * math.pi * scene.material.radius**3
            grains = self.filling_factor * float(np.prod(self.size)) / sphere
        # rounds of the minimiser, few in a loose packing
        rounds = 1.0 + (self.filling_factor / 0.62) ** 6 * MOST_ROUNDS / 4
        return Cost("N times the steps of a minimiser", SECONDS * grains * rounds)

    def faults(self) -> Faults:
        return exactly_one(self, ("grains", "size"), "grains: 1000")


@register(RandomPackingSample)
def make(spec: RandomPackingSample, materials: Materials) -> Sample:
    """The packing of spec: grains at rest in a periodic cell with a corner at 0.

    No two centres are closer than their equilibrium distance, images included.
    info: period, the edges of the cell [m]; closest, the smallest distance of two centres [m].
    The filling factor is exact to one grain. Raises DustError for a size that is too small, too
    many grains, or a packing that is not found.
    """
    rng = np.random.Generator(np.random.PCG64(spec.seed))
    crowd = Crowd(spec, materials, rng)
    if spec.size is not None:
        period = np.array(spec.size)
        cut.check_size(period, crowd.radius)
        count = spec.filling_factor * float(period.prod()) / (4 / 3 * math.pi * crowd.radius**3)
    else:
        count = spec.grains
    check_grains(count, "sample", MOST_GRAINS, "the packing")
    if crowd.equal or spec.size is None:
        grains = crowd.draw(max(1, int(count + 1e-9)), rng)
    else:  # as many as fill the cell
        grains = crowd.draw(max(1, int(2 * count)), rng)
        filled = np.cumsum(4 / 3 * np.pi * grains.radii**3)
        grains = grains.select(filled <= spec.filling_factor * period.prod())
    if spec.size is None:
        period = np.full(3, (grains.volume() / spec.filling_factor) ** (1 / 3))
    if period.min() < max(4 * crowd.radius, 2 * grains.radii.max(initial=0.0)):
        raise DustError(
            f"sample: the periodic cell, {cut.in_um(period)}, is narrower than two grains; "
            "allowed: more grains or a larger size."
        )
    for _ in range(ATTEMPTS):
        points = rng.random((len(grains), 3)) * period
        positions = _pushed_apart(points, period, grains, crowd)
        if positions is not None:
            break
    else:
        raise DustError(
            f"sample.filling_factor = {spec.filling_factor:g}: no packing without overlaps "
            f"was found with seed {spec.seed}; try a lower filling factor, more grains, or another "
            "seed."
        )
    info = {"kind": "random_packing", "seed": int(spec.seed), "grains": len(positions)}
    info |= {"closest": _closest(positions, period), "period": period.tolist()}
    return place_grains(positions, grains, materials, info)


def _pushed_apart(
    points: NDArray[np.float64], period: ArrayLike | None, grains: Grains, crowd: Crowd
) -> np.ndarray | None:
    """Points (N, 3) moved until all are at their equilibrium distances or farther, images included.

    None if none are found.
    """
    margin = MARGIN * crowd.overlap
    unit = crowd.distance + margin  # lengths of order one, for the minimiser
    x, box = points / unit, period / unit
    reach = 1.0 if crowd.equal else 2.0 * float(grains.radii.max()) / unit

    def energy(flat: NDArray[np.float64]) -> Any:
        """Sum of (1 - |x_i - x_j|/d_ij)^2 / 2 over pairs closer than d_ij, and its gradient."""
        at = np.mod(flat.reshape(-1, 3), box)
        i, j = _tree(at, box).query_pairs(reach, output_type="ndarray").T
        apart = at[i] - at[j]
        apart -= box * np.round(apart / box)
        length = np.sqrt((apart**2).sum(axis=1))
        equilibrium = (grains.distance(i, j) + margin) / unit
        overlap = np.maximum(1.0 - length / equilibrium, 0.0)
        push = (overlap / np.maximum(length, 1e-12) / equilibrium)[:, None] * apart
        n = len(at)
        gradient = np.column_stack(
            [np.bincount(j, push[:, k], n) - np.bincount(i, push[:, k], n) for k in range(3)]
        )
        return 0.5 * float((overlap**2).sum()), gradient.reshape(-1)

    for number in range(MOST_ROUNDS):
        report_progress(number, MOST_ROUNDS)
        if _apart(x, box, grains, unit):
            values: np.ndarray | None = np.mod(x, box) * unit
            return values
        minimum = scipy.optimize.minimize(
            energy,
            x.reshape(-1),
            jac=True,
            method="L-BFGS-B",
            options={"maxfun": ROUND, "maxiter": ROUND, "ftol": 0.0, "gtol": 0.0, "maxcor": 20},
        )
        x = np.mod(minimum.x.reshape(-1, 3), box)
    return None


def _apart(x: NDArray[np.float64], box: NDArray[np.float64], grains: Grains, unit: float) -> bool:
    """True where no two of the points are closer than their equilibrium distance [m]."""
    x = np.mod(x, box)
    reach = 2.0 * float(grains.radii.max()) / unit
    i, j = _tree(x, box).query_pairs(reach, output_type="ndarray").T
    apart = x[i] - x[j]
    apart -= box * np.round(apart / box)
    return bool((np.sqrt((apart**2).sum(axis=1)) * unit >= grains.distance(i, j)).all())


def _tree(x: NDArray[np.float64], box: NDArray[np.float64]) -> "scipy.spatial.cKDTree":
    # a coordinate that is rounded to the far face belongs on the near one
    return scipy.spatial.cKDTree(np.where(x >= box, 0.0, x), boxsize=box)


def _closest(x: NDArray[np.float64], box: NDArray[np.float64]) -> float:
    """Smallest distance of two points, images included; inf for one point."""
    if len(x) < 2:
        return math.inf
    x = np.mod(x, box)
    return float(_tree(x, box).query(x, k=2)[0][:, 1].min())
