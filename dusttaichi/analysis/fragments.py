"""Fragments: grains connected by contacts, their mass spectrum, growth and compaction."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.frame import read_frame, read_grain_masses
from dusttaichi.errors import DustError
from dusttaichi.physics.fractal import grains_within, power
from dusttaichi.physics.geometry import (
    label_components,
    largest_first,
)
from dusttaichi.physics.unwrap import unwrap_fragments

if TYPE_CHECKING:
    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


Body = NDArray[np.integer] | Sequence[int]  # numbers of its grains
Bodies = Sequence[Body]
# radius of the uniform sphere over its radius of gyration
CHARACTERISTIC = float(np.sqrt(5.0 / 3.0))


@dataclass(frozen=True)
class FragmentMasses:
    """Grains and masses of F fragments, largest mass first, in SI."""

    label: NDArray[np.integer]  #: Fragment of each grain, (N,); 0 is the largest.
    grains: NDArray[np.integer]  #: Number of grains, (F,).
    mass: NDArray[np.float64]  #: [kg], (F,).

    def __len__(self) -> int:
        return len(self.grains)


@dataclass(frozen=True)
class Fragments(FragmentMasses):
    """The F fragments of one snapshot, largest mass first, in SI.

    Notes
    -----
    The radius of gyration treats grains as points at their centres, weighted by mass (Wada et al.
    2008): 0 for a single grain. In a periodic cell the centre may be outside of the cell; for a
    fragment that spans the cell, centre and radius depend on the place at which it is cut open.
    Images have the velocity of their grain.
    """

    volume: NDArray[np.float64]  #: Volume of the grains [m^3], (F,).
    centre: NDArray[np.float64]  #: Centre of mass [m], (F, 3).
    velocity: NDArray[np.float64]  #: Velocity of the centre of mass [m/s], (F, 3).
    #: About the centre of mass, with the spins [kg m^2/s], (F, 3).
    angular_momentum: NDArray[np.float64]
    radius_of_gyration: NDArray[np.float64]  #: [m], (F,).

    @property
    def characteristic_radius(self) -> NDArray[np.float64]:
        """sqrt(5/3) R_g [m], (F,): of the uniform sphere with that radius of gyration."""
        return CHARACTERISTIC * self.radius_of_gyration

    @property
    def filling_factor(self) -> NDArray[np.float64]:
        """Grain volume over that of the sphere of the characteristic radius (Mukai 1992), (F,).

        It is not a number for a single grain, and above 1 for two or three, whose radius of
        gyration neglects the extent of a grain.
        """
        return compute_filling_factor(self.volume, self.radius_of_gyration)


def compute_filling_factor(
    volume: NDArray[np.float64], radius_of_gyration: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Volumes of grains [m^3] over those of the spheres of the characteristic radii, (F,) each.

    radius_of_gyration [m]. It is not a number for a single grain.
    """
    sphere = 4.0 / 3.0 * np.pi * (CHARACTERISTIC * radius_of_gyration) ** 3
    phi = np.full(len(volume), np.nan)
    np.divide(volume, sphere, out=phi, where=sphere > 0.0)
    return phi


def find_fragments(run: Run, snapshot: int = -1) -> Fragments:
    """Fragments of a snapshot of a run: sets of grains connected by contacts between grains.

    Walls do not connect grains.

    Parameters
    ----------
    run : Run
    snapshot : int
        Number of the snapshot, from the end if negative.

    Raises
    ------
    DustError
        The snapshots have no contacts.
    """
    return find_frame_fragments(read_frame(run, snapshot), read_grain_masses(run))


def find_frame_fragments(frame: Frame, masses: NDArray[np.float64]) -> Fragments:
    """The Fragments of a Frame whose grains have these masses [kg], (N,)."""
    label, position = label_fragments(frame, masses), frame.position
    if frame.periodic.any():  # at the images that connect fragments across periodic faces
        starts = np.unique(label, return_index=True)[1]
        position = unwrap_fragments(position, frame.pairs, starts, frame.nearest)
    return sum_fragments(label, masses, frame.radius, (position, frame.velocity, frame.spin))


def sum_fragments(
    label: NDArray[np.intp],
    masses: NDArray[np.float64],
    radius: NDArray[np.float64],
    motion: Iterable[NDArray[np.float64]],
) -> Fragments:
    """The Fragments of N grains in open space whose fragment is `label`, 0 the heaviest.

    masses [kg], radius [m]: of the grains, (N,). motion: their positions [m], velocities [m/s] and
    spins [rad/s], (N, 3) each.
    """
    weighed = weigh_fragments(label, masses)
    position, velocity_of_grains, spin_of_grains = motion
    number, mass = len(weighed), weighed.mass

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return _sum_by_label(label, masses[:, None] * values, number) / mass[:, None]

    centre, velocity = mean(position), mean(velocity_of_grains)
    offset, relative = position - centre[label], velocity_of_grains - velocity[label]
    spin = 0.4 * (masses * radius**2)[:, None] * spin_of_grains
    angular = _sum_by_label(label, masses[:, None] * np.cross(offset, relative) + spin, number)
    square = np.bincount(label, masses * (offset**2).sum(axis=1), minlength=number) / mass
    volumes = 4.0 / 3.0 * np.pi * radius**3
    volume = np.asarray(np.bincount(label, volumes, minlength=number), float)
    return Fragments(
        label, weighed.grains, mass, volume, centre, velocity, angular, np.sqrt(square)
    )


def weigh_fragments(label: NDArray[np.intp], masses: NDArray[np.float64]) -> FragmentMasses:
    """The FragmentMasses of N grains of these masses [kg] whose fragment is `label`."""
    mass = np.asarray(np.bincount(label, masses), float)
    return FragmentMasses(label, np.bincount(label), mass)


def label_fragments(frame: Frame, masses: NDArray[np.float64]) -> NDArray[np.intp]:
    """Fragment of each grain of a Frame, (N,), 0 the heaviest; masses: of the grains, (N,)."""
    return largest_first(label_components(frame.pairs, len(masses))[1], masses)


def _sum_by_label(
    label: NDArray[np.intp], vectors: NDArray[np.float64], number: int
) -> NDArray[np.float64]:
    columns = [np.bincount(label, column, minlength=number) for column in vectors.T]
    return np.asarray(np.stack(columns, axis=1), float)


@dataclass(frozen=True)
class FragmentDimension:
    """Fractal dimension of a fragment: N(<R) ~ R^dimension about the grains of its core."""

    radius: NDArray[np.float64]  #: Distances R [m], (R,), of fractal.grains_within.
    number: NDArray[np.float64]  #: N(<R), (R,).
    dimension: float  #: Exponent of the fit.
    grains: int  #: Number of grains of the fragment.
    grain_radius: float  #: Mean radius of the grains [m].


def fit_fragment_dimension(run: Run, snapshot: int = -1, fragment: int = 0) -> FragmentDimension:
    """Fractal dimension of a fragment of a snapshot of a run.

    Parameters
    ----------
    run : Run
    snapshot : int
    fragment : int
        Its number in the order of decreasing mass.

    Raises
    ------
    DustError
        The fragment does not exist, has fewer than a hundred grains or is too small for a range of
        radii.
    """
    frame = read_frame(run, snapshot)
    fragments = find_frame_fragments(frame, read_grain_masses(run))
    if not 0 <= fragment < len(fragments):
        raise DustError(f"There is no fragment {fragment}; allowed: 0 to {len(fragments) - 1}.")
    members = fragments.label == fragment
    start = np.flatnonzero(members)[:1]
    x = unwrap_fragments(frame.position, frame.pairs, start, frame.nearest)[members]
    mean = float(frame.radius[members].mean())
    # grains are spheres, not points
    gyration = np.sqrt(fragments.radius_of_gyration[fragment] ** 2 + 0.6 * mean**2)
    counts = grains_within(x, mean, gyration)
    if counts is None:
        raise DustError(
            f"Fragment {fragment} of {run.path} has {members.sum()} grains: too small for a "
            "dimension."
        )
    return FragmentDimension(*counts, power(*counts), int(members.sum()), mean)


@dataclass(frozen=True)
class MassSpectrum:
    """Distribution of the mass among fragments."""

    mass: NDArray[np.float64]  #: [kg], (F,), rising.
    count: NDArray[np.integer]  #: Number of fragments of at least this mass, (F,).
    mass_fraction: NDArray[np.float64]  #: Their share of the total mass, (F,).
    #: Edges of the bins [kg], (bins + 1,), evenly spaced in the logarithm.
    edges: NDArray[np.float64]
    histogram: NDArray[np.integer]  #: (bins,).


def compute_mass_spectrum(fragments: Fragments, bins: int = 10) -> MassSpectrum:
    """Distribution of the mass among fragments.

    Parameters
    ----------
    fragments : Fragments
    bins : int
        Number of bins of the histogram, from the smallest to the largest mass.
    """
    mass = np.sort(fragments.mass)
    count = np.arange(len(mass), 0, -1)
    mass_fraction = np.cumsum(mass[::-1])[::-1] / mass.sum()
    # the ends a little outside, so that rounding of the logarithm loses no fragment
    edges = np.geomspace(mass[0] * (1 - 1e-9), mass[-1] * (1 + 1e-9), bins + 1)
    return MassSpectrum(mass, count, mass_fraction, edges, np.histogram(mass, edges)[0])


def measure_growth_efficiency(
    run: Run, first: int = 0, last: int = -1, bodies: Bodies | None = None
) -> float:
    """Growth efficiency f = (M_largest - M_target)/M_projectile of a collision (Wada et al. 2013).

    1: everything sticks; 0: the mass of the target is unchanged, as in a bounce; negative: erosion.

    Parameters
    ----------
    run : Run
    first : int
        Snapshot before, in which the larger of two fragments is the target and the smaller the
        projectile.
    last : int
        Snapshot after, whose largest fragment has M_largest.
    bodies : pair of lists, optional
        Grains of target and projectile, instead of the two fragments of `first`.

    Raises
    ------
    DustError
        Snapshot `first` does not have exactly two fragments.
    """
    if bodies is None:
        target, projectile = find_two_fragments(run, first).mass
        return float((find_fragments(run, last).mass[0] - target) / projectile)
    return compute_growth_efficiency(find_fragments(run, last), read_grain_masses(run), bodies)


def compute_growth_efficiency(
    fragments: FragmentMasses, masses: NDArray[np.float64], bodies: Bodies
) -> float:
    """Growth efficiency of two bodies (lists of grains), from the fragments afterwards.

    masses: of the grains [kg], (N,).
    """
    projectile, target = sorted(masses[body].sum() for body in bodies)
    return float((fragments.mass[0] - target) / projectile)


def find_two_fragments(run: Run, snapshot: int) -> Fragments:
    """The Fragments of a snapshot that has exactly two. Raises DustError otherwise."""
    fragments = find_fragments(run, snapshot)
    if len(fragments) != 2:
        raise DustError(
            f"Snapshot {snapshot} of {run.path} has {len(fragments)} fragments; a collision needs "
            "two at its start: try another snapshot."
        )
    return fragments


@dataclass(frozen=True)
class Compaction:
    """The largest fragment before and after."""

    grains: NDArray[np.integer]  #: Number of grains, (2,).
    radius_of_gyration: NDArray[np.float64]  #: [m], (2,).
    filling_factor: NDArray[np.float64]  #: (2,), see Fragments.

    @property
    def ratio(self) -> float:
        """Filling factor after over before: above 1 where the fragment was compacted."""
        return float(self.filling_factor[1] / self.filling_factor[0])


def measure_compaction(run: Run, first: int = 0, last: int = -1) -> Compaction:
    """Compaction of the largest fragment between two snapshots of a run.

    The filling factor is within the characteristic radius sqrt(5/3) R_g, so that fragments of
    different mass can be compared.

    Parameters
    ----------
    run : Run
    first : int
        Number of the snapshot before.
    last : int
        Number of the snapshot after.
    """
    snapshots, names = [find_fragments(run, n) for n in (first, last)], Compaction.__annotations__
    return Compaction(
        *(np.array([getattr(fragments, name)[0] for fragments in snapshots]) for name in names)
    )
