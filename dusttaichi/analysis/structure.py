"""Structure of a snapshot: directions and forces of contacts, neighbours, distances of grains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.frame import read_frame
from dusttaichi.analysis.pores import wrap_into_cell
from dusttaichi.errors import DustError
from dusttaichi.physics.near import near

if TYPE_CHECKING:
    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


BINS = 60  #: Bins of the pair correlation, up to FARTHEST diameters.
FARTHEST = 5.0
CENTRES = 10_000  #: Random grains about which g(r) is counted, where there are more.


@dataclass(frozen=True)
class Structure:
    """Structure of a snapshot of N grains with C contacts between them."""

    #: Mean of n n over the contacts, (3, 3), with the unit vector n between the centres: a third of
    #: the unit matrix if isotropic.
    fabric: NDArray[np.float64]
    normal: NDArray[np.float64]  #: These vectors, (C, 3).
    #: Share of the grains that touch 0, 1, ... K - 1 others, (K,).
    coordination: NDArray[np.float64]
    #: Positive for repulsion [N], (C,); empty if the file has none.
    normal_force: NDArray[np.float64]
    distance: NDArray[np.float64]  #: Middles of the bins in mean diameters, (BINS,).
    #: g(r), grains at that distance from a grain over the number expected from the mean density,
    #: (BINS,); NaN unless walls or periodic faces bound all axes, or in a sheared cell.
    correlation: NDArray[np.float64]
    #: Standard error of `correlation`, (BINS,): 0 unless the centres are CENTRES random grains.
    correlation_error: NDArray[np.float64]

    @property
    def anisotropy(self) -> float:
        """Largest less smallest eigenvalue of the fabric tensor: 0 if isotropic."""
        values = np.linalg.eigvalsh(self.fabric)
        return float(values[-1] - values[0])


def measure_structure(run: Run, snapshot: int = -1) -> Structure:
    """Structure of the contacts in a snapshot of a run.

    Parameters
    ----------
    run : Run
    snapshot : int

    Raises
    ------
    DustError
        The result has no contacts.
    """
    frame = read_frame(run, snapshot)
    i, j = frame.pairs.T
    if not len(i):
        raise DustError(f"Snapshot {snapshot} of {run.path} has no contacts.")
    branch = frame.nearest(frame.position[i] - frame.position[j])
    normal = branch / np.linalg.norm(branch, axis=1)[:, None]
    contacts = frame.require_contacts()
    forces = contacts.normal_force.values if "normal_force" in contacts else []
    distance, correlation, error = compute_pair_correlation(frame)
    return Structure(
        fabric=normal.T @ normal / len(normal),
        normal=normal,
        coordination=np.bincount(frame.coordination) / len(frame.radius),
        normal_force=np.asarray(forces, dtype=float),
        distance=distance,
        correlation=correlation,
        correlation_error=error,
    )


def compute_pair_correlation(
    frame: Frame,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """(distance in mean diameters, g(r), its standard error) of a Frame, (BINS,) each.

    Grains near walls have fewer neighbours: only grains farther from every wall than the largest
    distance are centres, of many CENTRES random ones. Periodic edges must be twice that distance.
    """
    diameter = 2.0 * float(frame.radius.mean())
    edges = np.linspace(0.0, FARTHEST, BINS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    unknown = middle, np.full(BINS, np.nan), np.full(BINS, np.nan)
    if not np.isfinite(frame.edges).all() or frame.tilt:
        return unknown
    x, reach = frame.position - frame.cell[:, 0], FARTHEST * diameter
    inside = np.ones(len(x), dtype=bool)
    for axis in np.flatnonzero(~frame.periodic):
        inside &= (x[:, axis] > reach) & (x[:, axis] < frame.edges[axis] - reach)
    if np.any(frame.periodic & (frame.edges < 2.0 * reach)) or not inside.any():
        return unknown
    centres = np.flatnonzero(inside)
    drawn = len(centres) > CENTRES
    if drawn:
        centres = np.random.default_rng(1).choice(centres, CENTRES, replace=False)
    period = np.where(frame.periodic, frame.edges, np.inf)
    x = wrap_into_cell(x, frame.edges, frame.periodic)
    apart = near(x[centres], x, reach, period)[2]
    # a grain is at no distance from itself
    shells = np.bincount(np.searchsorted(edges * diameter, apart), minlength=BINS + 2)[1:-1]
    volume = 4.0 / 3.0 * np.pi * np.diff((edges * diameter) ** 3)
    expected = len(centres) * len(x) / np.prod(frame.edges) * volume
    # pairs of random centres are counted independently of each other
    error = np.sqrt(shells) / expected if drawn else np.zeros(BINS)
    return middle, shells / expected, error
