"""Density of dust: along the axis below a bead, as a map, and as cumulated volume (G09)."""

from dataclasses import dataclass

import numpy as np
import scipy

from dusttaichi.analysis.frame import find_surface
from dusttaichi.continuum.analysis.intrusion import projectile_of
from dusttaichi.continuum.analysis.particle_snapshot import read_particles

NEAR = 0.3e-3  # depth [m] below the bead over which the prototype's median was taken
POINTS, BIN = 400, 0.005  # of a cumulated volume; width of the bins of a histogram
MARGIN = 0.8  # spacings around a particle that a map shows as filled


@dataclass(frozen=True)
class AxisProfile:
    """Filling factor below a bead, in bins one spacing deep, from the top down; SI.

    depth (bins,): of the middle of the bin below the surface of the start; below_bead (bins,):
    below the lowest point of the bead. filling_factor (bins,), not a number of an empty bin.
    nearest: median filling factor within 0.3 mm of the bead. bead: depth of its lowest point.
    """

    depth: np.ndarray
    below_bead: np.ndarray
    filling_factor: np.ndarray
    nearest: float
    bead: float


def axis_profile(run):
    """Filling factor at the end along the axis of a run with a rigid projectile, as G09 Fig 12.

    Dust within one spacing of the vertical through the middle of the projectile counts (in three
    dimensions two). Raises DustError where the run has no projectile.
    """
    bead, frame = projectile_of(run), read_particles(run)
    top, rigid = find_surface(run), frame.is_bead
    centre = np.average(frame.position[rigid], axis=0, weights=frame.mass[rigid])
    low = centre[2] - bead.get("height", bead["diameter"]) / 2.0
    aside = np.hypot(*(frame.position[:, :2] - centre[:2]).T)
    reach = frame.spacing * (1.0 if frame.dimension == 2 else 2.0)
    below = frame.is_dust & (aside < reach) & (frame.position[:, 2] < low)
    z, phi, volume = frame.position[below, 2], frame.filling_factor[below], frame.volume[below]
    depth = low - z
    count = max(1, int(np.ceil(depth.max(initial=0.0) / frame.spacing)))
    number = np.minimum((depth / frame.spacing).astype(int), count - 1)
    weight = np.bincount(number, volume, minlength=count)
    with np.errstate(invalid="ignore"):
        mean = np.bincount(number, volume * phi, minlength=count) / weight
    middle = (np.arange(count) + 0.5) * frame.spacing
    near = phi[depth < max(NEAR, 1.5 * frame.spacing)]
    return AxisProfile(
        depth=top - low + middle,
        below_bead=middle,
        filling_factor=mean,
        nearest=float(np.median(near)) if len(near) else float("nan"),
        bead=float(top - low),
    )


@dataclass(frozen=True)
class CumulatedVolume:
    """Volume of dust denser than a filling factor, in volumes of the bead (G09 Figs 11, 15).

    filling_factor (n,), volume (n,), falling. unit [m^3, m^2]: volume of the bead.
    """

    filling_factor: np.ndarray
    volume: np.ndarray
    unit: float

    def above(self, phi):
        """Volume denser than phi, in volumes of the bead."""
        return float(np.interp(phi, self.filling_factor, self.volume))


def cumulated_volume(run, scatter=0.0):
    """The CumulatedVolume of a Run with a rigid projectile, at its end.

    scatter: standard deviation of a Gaussian with which filling factors are convolved: dust of the
    laboratory scatters before it is compacted (G09 Fig 10), that of a run may not.
    """
    bead, frame = projectile_of(run), read_particles(run)
    dust = frame.is_dust
    phi, volume = frame.filling_factor[dust], frame.volume[dust]
    unit = float(frame.volume[frame.is_bead].sum())
    if not unit:
        unit = bead["mass"] / bead["density"]
    return CumulatedVolume(*denser_than(phi, volume / unit, scatter), unit)


def denser_than(phi, volume, scatter=0.0):
    """Filling factors (POINTS,) and the volume (POINTS,) of particles that are denser."""
    grid = np.linspace(phi.min() - 4 * scatter, phi.max() + 4 * scatter, POINTS)
    if scatter > 0.0:
        fraction = 0.5 * scipy.special.erfc((grid[:, None] - phi[None, :]) / (2**0.5 * scatter))
        return grid, fraction @ volume
    order = np.argsort(phi, kind="stable")
    above = np.append(np.cumsum(volume[order][::-1])[::-1], 0.0)
    return grid, above[np.searchsorted(phi[order], grid, "right")]


def histogram(run, snapshot=-1):
    """Share of the dust's volume by filling factor: edges (n + 1,), share (n,)."""
    frame = read_particles(run, snapshot)
    phi, volume = frame.filling_factor[frame.is_dust], frame.volume[frame.is_dust]
    low, high = np.floor(phi.min() / BIN), np.ceil(phi.max() / BIN + 1e-9)
    edges = BIN * np.arange(low, max(high, low + 1) + 1)
    volume_fractions, _ = np.histogram(phi, edges, weights=volume / volume.sum())
    return edges, volume_fractions


@dataclass(frozen=True)
class Map:
    """A quantity on a grid of the plane x-z; SI.

    values (rows, columns), the lowest row first; not a number where there is nothing. extent: left,
    right, bottom, top [m].
    """

    values: np.ndarray
    extent: tuple


def section(frame, values, extent=None, pixels=400):
    """A Map of `values` (N,) of a ParticleFrame in the plane x-z (in three dimensions at y = 0).

    Each pixel has the value of the nearest particle, no farther than 0.8 of its size. extent: left,
    right, bottom, top [m], default that of the particles. pixels: across the longer side.
    """
    x = frame.position
    near = np.ones(len(x), bool)
    if frame.dimension == 3:
        near = np.abs(x[:, 1] - np.median(x[:, 1])) < 1.5 * frame.spacing
    points, size, values = x[near], frame.size[near], np.asarray(values, dtype=float)[near]
    if extent is None:
        half = frame.spacing / 2.0
        low, high = points.min(axis=0) - half, points.max(axis=0) + half
        extent = (low[0], high[0], low[2], high[2])
    x_begin, x_end, bottom, top = extent
    pitch = max(x_end - x_begin, top - bottom) / pixels
    columns, rows = (max(1, round(d / pitch)) for d in (x_end - x_begin, top - bottom))
    grid = np.stack(
        np.meshgrid(
            x_begin + (np.arange(columns) + 0.5) * (x_end - x_begin) / columns,
            bottom + (np.arange(rows) + 0.5) * (top - bottom) / rows,
        ),
        axis=-1,
    ).reshape(-1, 2)
    middle = np.median(x[:, 1]) if frame.dimension == 3 else 0.0
    space = np.insert(grid, 1, middle, axis=1)
    distance, nearest = scipy.spatial.cKDTree(points).query(space)
    shown = np.where(distance < MARGIN * size[nearest], values[nearest], np.nan)
    return Map(shown.reshape(rows, columns), (x_begin, x_end, bottom, top))


def measure_compacted_mass(frame, start):
    """Share of the dust's mass whose filling factor is above that of a start by 5 % of it."""
    dust = frame.is_dust
    denser = frame.filling_factor[dust] > 1.05 * start.filling_factor[dust]
    return float(frame.mass[dust][denser].sum() / frame.mass[dust].sum())
