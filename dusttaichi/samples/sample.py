"""Samples: grains with positions, velocities and spins, their measures, and largest numbers."""

import os
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.fractal import fit_fractal_dimension
from dusttaichi.physics.geometry import AXES, LYING
from dusttaichi.physics.near import near_pairs

ROUNDING = 1e-9  # of the touching distance: far above rounding, far below the overlap delta0
BYTES = 1000  # least memory of a grain in sample and simulation


class PeriodicCell(Protocol):
    """Edges of the cell of a sample (images.Cell)."""

    @property
    def period(self) -> NDArray[np.float64]: ...
    @property
    def axes(self) -> NDArray[np.intp]: ...


@dataclass(frozen=True)
class Sample:
    """Grains before the first step; everything in SI.

    Notes
    -----
    `contacts` has i, j (C,) int64; pointer_i, pointer_j (C, 3) unit vectors; twist (C,) [rad]; and
    approach (C,) [m/s], the approach speed half a step before. `wall_contacts` has grain, wall (W,)
    int64, the wall's number in geometry.WALLS; pointer (W, 3) unit vectors; foot (W, 3) [m]; twist
    (W,) [rad]; and approach (W,) [m/s].

    `info` may have `period` (3 numbers, m), edges of a periodic sample; `shape`, "cylinder" for an
    upright cylinder about x = y = 0, "lying cylinder" for one about the `axis` "x" or "y" through
    the origin, "sphere" about the origin, "aggregate" for an uncut cluster, which determines the
    volume of the filling factor; `room` (6 numbers, m), positions of walls and faces of the cell in
    the order of geometry.WALLS, NaN where there is none; `start_time` [s] of a continued run;
    `remarks`, sentences for the user; and `reading`, those of them on how a file is read, which are
    also of a sample that is made of this one.
    """

    positions: NDArray[np.float64]  #: [m], (N, 3) float64.
    velocities: NDArray[np.float64]  #: [m/s], (N, 3) float64.
    spins: NDArray[np.float64]  #: [rad/s], (N, 3) float64.
    #: History of existing pair contacts (see Notes); None: contacts are found from the distances.
    contacts: dict[str, NDArray[Any]] | None = None
    #: Plain numbers and texts on origin and measures of the sample.
    info: dict[str, Any] = field(default_factory=dict)
    #: [m], (N,); None where all grains have the radius of their material.
    radii: NDArray[np.float64] | None = None
    #: (N,) int, 0 for the scene's `material`, from 1 on for its `materials` in their order; None
    #: where all are of the first.
    materials: NDArray[np.integer] | None = None
    #: History of the contacts with walls, whose positions are info["room"], or None.
    wall_contacts: dict[str, NDArray[Any]] | None = None

    @classmethod
    def at_rest(cls, positions: np.ndarray, info: dict[str, Any] | None = None) -> "Sample":
        """Grains that neither move nor spin.

        Parameters
        ----------
        positions
            [m], (N, 3).
        info
        """
        positions = np.ascontiguousarray(positions, dtype=np.float64)
        still = np.zeros_like(positions)
        return cls(positions, still, still.copy(), None, dict(info or {}))

    def __len__(self) -> int:
        return len(self.positions)

    def with_remarks(self, *texts: str) -> "Sample":
        """This sample with further sentences for the user."""
        remarks = [*self.info.get("remarks", ()), *texts]
        return replace(self, info=self.info | {"remarks": remarks}) if texts else self

    @property
    def stored_pairs(self) -> NDArray[np.integer] | None:
        """Grains of the existing pair contacts, (C, 2); None without `contacts`."""
        if self.contacts is None:
            return None
        return np.column_stack([self.contacts["i"], self.contacts["j"]])


# The radius [m] of the functions below is one number for all grains, or (N,).


def extent(sample: Sample, radius: float | NDArray[np.float64]) -> np.ndarray:
    """Edges of the smallest upright box around the grains, surfaces included, shape (3,) [m]."""
    if np.ndim(radius):
        surface, x = np.asarray(radius)[:, None], sample.positions
        edges: NDArray[np.float64] = (x + surface).max(axis=0) - (x - surface).min(axis=0)
    else:
        edges = np.ptp(sample.positions, axis=0) + 2 * radius
    return edges


def filling_factor(
    sample: Sample, radius: float | NDArray[np.float64], cell: PeriodicCell | None = None
) -> float:
    """Grain volume over the volume of the sample.

    The latter is the smallest upright box around the grains (S12 eq 28), surfaces included, except
    in a periodic cell and for a sample with a `period`, where it is that cell, along axes that are
    not periodic as high as the grains; of shape "cylinder", where it is the smallest upright
    cylinder about the axis x = y = 0; of shape "lying cylinder" or "sphere", where it is the
    smallest one about its axis or the origin; and of shape "aggregate", where it is the sphere of
    radius sqrt(5/3) R_g, because a box about its branches would be mostly empty.

    Parameters
    ----------
    sample
    radius : float or array
        Radii of the grains [m].
    cell : images.Cell, optional
        Periodic cell of the sample.
    """
    grains = len(sample) * 4 / 3 * np.pi * np.mean(radius**3)
    return float(grains / volume(sample, radius, cell)[0])


def volume(
    sample: Sample, radius: float | NDArray[np.float64], cell: PeriodicCell | None = None
) -> tuple[float, str]:
    """Volume [m^3] for the filling factor, and what it is the volume of.

    Arguments as of `filling_factor`.
    """
    if cell is not None and len(cell.axes):
        edges = np.where(np.isfinite(cell.period), cell.period, extent(sample, radius))
        axes = ", ".join(AXES[n] for n in cell.axes)
        name = "periodic cell" if len(cell.axes) == 3 else f"bounding box, periodic along {axes}"
        return float(np.prod(edges)), name
    if "period" in sample.info:
        return float(np.prod(sample.info["period"])), "periodic cell"
    if sample.info.get("shape") == "aggregate":
        characteristic = np.sqrt(5 / 3) * radius_of_gyration(sample, radius)
        return 4 / 3 * np.pi * characteristic**3, "sphere of radius sqrt(5/3) R_g"
    edges, shape = extent(sample, radius), sample.info.get("shape")
    if shape == "sphere":
        reach = (np.linalg.norm(sample.positions, axis=1) + radius).max()
        return 4 / 3 * np.pi * reach**3, "bounding sphere"
    if shape in ("cylinder", LYING):
        along = AXES.index(sample.info.get("axis", "z"))
        reach = (np.hypot(*np.delete(sample.positions, along, axis=1).T) + radius).max()
        return np.pi * reach**2 * edges[along], "bounding cylinder"
    return float(np.prod(edges)), "bounding box"


def radius_of_gyration(sample: Sample, radius: float | NDArray[np.float64]) -> float:
    """Radius of gyration R_g [m]: R_g^2 = mean of |x_i - x_cm|^2, and (3/5) r^2.

    Grains of unequal radii are weighted with their volumes, whatever they are made of.

    Parameters
    ----------
    sample
    radius : float or array
        Radii of the grains [m].
    """
    if np.ndim(radius):
        weight = radius**3 / np.sum(radius**3)
        apart = sample.positions - weight @ sample.positions
        return float(np.sqrt(weight @ ((apart**2).sum(axis=1) + 0.6 * radius**2)))
    apart = sample.positions - sample.positions.mean(axis=0)
    return float(np.sqrt((apart**2).sum(axis=1).mean() + 0.6 * radius**2))


LARGEST_ERROR = 0.15  # of a fractal dimension that is stated


def fractal_dimension(sample: Sample, radius: float | NDArray[np.float64]) -> float:
    """D of N(<R) ~ R^D about grains of the core (physics.fractal.grains_within).

    For a single fractal aggregate it scatters by about 0.2. Small deposits, in which the grains of
    two octants differ, have none.

    Parameters
    ----------
    sample
    radius : float or array
        Radii of the grains [m].

    Returns
    -------
    float
        NaN for a sample that is too small, whose D has an error of LARGEST_ERROR or more, or whose
        density grows outwards: D exceeds 3 by more than two errors.
    """
    gyration = radius_of_gyration(sample, radius)
    dimension, error = fit_fractal_dimension(sample.positions, radius, gyration)
    is_supported = error < LARGEST_ERROR and dimension <= 3.0 + 2.0 * error
    return dimension if is_supported else float("nan")


def bulk_filling_factor(
    sample: Sample, radius: float, *, side: float = 2.0, bottom: float = 20.0, top: float = 2.0
) -> float:
    """Filling factor away from the surfaces; NaN if nothing is left there.

    It counts the grain centres in an upright cylinder in the middle of the sample, which is
    unbiased: the probability of a centre to be inside does not depend on the position of its
    surface.

    Parameters
    ----------
    sample
    radius
        Radius of the grains [m].
    side
        Excluded layer at the sides, from the outermost grain centres, in grain radii, as the next
        two.
    bottom
        The default is the extent of the denser first layers of a deposit (in its profile: 0.20 at
        the floor, about 5 % above the bulk further up, decaying slowly).
    top
        Excluded layer at the top.
    """
    low, high = sample.positions.min(axis=0), sample.positions.max(axis=0)
    floor, ceiling = low[2] + bottom * radius, high[2] - top * radius
    reach = (high - low)[:2].min() / 2 - side * radius
    if reach <= 0 or ceiling <= floor:
        return float("nan")
    off_axis = np.hypot(*(sample.positions - (low + high) / 2)[:, :2].T)
    z = sample.positions[:, 2]
    inside = np.count_nonzero((off_axis < reach) & (z >= floor) & (z < ceiling))
    return float(inside * 4 / 3 * radius**3 / (reach**2 * (ceiling - floor)))


def touching_pairs(
    positions: np.ndarray, distance: float, period: NDArray[np.float64] | None = None
) -> np.ndarray:
    """Pairs i < j of grains whose centres are no farther apart than a distance.

    Parameters
    ----------
    positions
        [m], (N, 3).
    distance
        [m].
    period
        Edges of a periodic cell [m], (3,); None: no images.

    Returns
    -------
    array
        (C, 2) int.
    """
    if period is not None:
        positions = np.mod(positions, period)
        # a coordinate that is rounded to the far face belongs on the near one
        positions = np.where(positions >= period, 0.0, positions)
    return np.column_stack(near_pairs(positions, distance, period)[:2])


def smallest_gap(positions: np.ndarray, radius: float | NDArray[np.float64]) -> float:
    """Smallest distance of two surfaces among the four nearest neighbours of each grain [m].

    Parameters
    ----------
    positions
        [m], (N, 3).
    radius : float or array
        Radii of the grains [m].
    """
    neighbour_count = min(5, len(positions))
    distance, neighbour = scipy.spatial.cKDTree(positions).query(positions, k=neighbour_count)
    radii = np.broadcast_to(radius, len(positions))
    gaps = distance - radii[:, None] - radii[neighbour]
    return float(gaps[:, 1:].min())


def memory() -> float:
    """Memory of this machine in bytes; infinite where it is unknown."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return float("inf")


def check_grains(
    grains: float,
    origin: str,
    max_grains: float = np.inf,
    object_name: str = "",
    advice: str = "Use fewer grains.",
) -> None:
    """Raise DustError for too many grains for the memory, or more than `max_grains`.

    origin: key or file that the grains are from.
    object_name: of which there would be more, for the message; advice: for its end.
    """
    if grains > max_grains:
        raise DustError(
            f"{origin}: {object_name} would have some {grains:.1e} grains; allowed: "
            f"{max_grains:.0e}. {advice}"
        )
    max_grains = memory() / BYTES
    if grains > max_grains:
        raise DustError(
            f"{origin}: {grains:.3g} grains need {grains * BYTES / 1e9:.3g} GB of memory at least, "
            f"and this machine has {memory() / 1e9:.3g}; allowed: at most {max_grains:.2g}. "
            "Use fewer grains."
        )
