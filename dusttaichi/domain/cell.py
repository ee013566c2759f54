"""The periodic cell: edges that grow or shrink, and what they must leave room for."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.geometry import pairs_within
from dusttaichi.names import AXES
from dusttaichi.physics.contact.constants import CLOSEST


@dataclass(frozen=True, eq=False)
class Cell:
    """A periodic cell: edge L(t) = start exp(growth t) + rate t along the periodic axes, centred.

    start [um], rate [um/us], growth [1/us], centre [um]: (3,). Along the other axes start is 0.
    """

    start: np.ndarray
    rate: np.ndarray
    growth: np.ndarray
    centre: np.ndarray
    axes: tuple

    @property
    def rows(self):
        """Contents of the `cell` field (kernels.cell)."""
        return np.array([self.start, self.rate, self.growth, self.centre])

    def edges(self, time):
        """Lengths at a time [um], (3,)."""
        return self.start * np.exp(self.growth * time) + self.rate * time

    def speeds(self, time):
        """Their speeds of growth [um/us], (3,)."""
        return self.growth * self.start * np.exp(self.growth * time) + self.rate

    def low(self, time):
        """Lower faces at a time [um], (3,)."""
        return self.centre - 0.5 * self.edges(time)

    def driven(self, drive, time, t_c):
        """The same cell, moving as `drive` says from `time` on; t_c [us]: see Drive."""
        periodic = np.isin(np.arange(3), self.axes)
        growth, rate = np.zeros(3), np.zeros(3)
        if drive.compression_rate is not None:
            growth[:] = -2.0 * drive.compression_rate / t_c
        elif drive.strain_rate is not None:
            growth = np.array(drive.strain_rate) * units.TIME
        elif drive.face_speed is not None:
            rate = 2.0 * np.array(drive.face_speed) / units.SPEED
        growth, rate = np.where(periodic, growth, 0.0), np.where(periodic, rate, 0.0)
        now = self.edges(time)
        start = (now - rate * time) * np.exp(-growth * time)
        return replace(self, start=start, rate=rate, growth=growth)


def check_images(positions, cell, radius):
    """Grains must not lie in the images of others."""
    far = 1e6 * np.max(radius) + np.ptp(positions, axis=0).max()
    edges = np.where(cell.start > 0.0, cell.start, far)
    inside = np.mod(positions - cell.low(0.0), edges)
    inside[inside >= edges] = 0.0  # what rounding has put on the upper face
    if np.ndim(radius):
        nearest = pairs_within(inside, radius, CLOSEST, edges)[2].min(initial=np.inf)
        allowed = np.inf
    else:
        nearest = cKDTree(inside, boxsize=edges).query(inside, k=2)[0][:, 1].min()
        allowed = CLOSEST * 2.0 * radius
    if nearest < allowed:
        raise DustError(
            "boundary.size: the periodic cell is too small: grains of the sample overlap with "
            f"images of others (centres {nearest:.4g} um apart); enlarge it or use size: fit"
        )


def check_edges(edges, axes, radius):
    n = int(np.argmin(edges))
    if edges[n] < 4.0 * radius:
        raise DustError(
            f"boundary: the periodic edge along {AXES[axes[n]]} is {edges[n]:.4g} um, shorter than "
            f"four radii ({4.0 * radius:.4g} um): a grain would touch another twice, across both "
            "faces; take a larger sample or boundary.size, or leave this axis out of boundary.axes"
        )
