"""Checks of particles from a file: numbers, filling factors, volumes and distances."""

import numpy as np
import scipy

from dusttaichi.continuum.samples import lattice
from dusttaichi.continuum.samples.body_registry import Matter
from dusttaichi.errors import DustError
from dusttaichi.scene import quantities

POSITIVE = ("mass", "density", "reference")
SPACINGS = (0.25, 2.0)
"""Spacings that volumes of particles may have, over that of the scene: dust may be compacted, but
the kernel has too few neighbours beyond."""
NEAR_SPACING = (0.7, 1.4)  # up to which lattices and random points agree with the spacing
NEAR_DISTANCE = (
    0.6,
    3.0,
)  # spacings of volumes over the nearest distances: lattices, random points
ELASTIC = (0.5, 2.0)  # density over that without pressure
COINCIDENT = 1e-3  # spacings


def check_particles(arrays: dict, matter: Matter, path: str, *, of_run: bool) -> None:
    """Raise DustError for particles that cannot be dust of this material on this spacing.

    arrays: position (N, 3), mass (N,) ... in SI; in two dimensions all y become 0. of_run: True for
    the snapshot of a run, in which dust may be compacted further, and particles may fly alone.
    """
    _check_numbers(arrays, path)
    position = arrays["position"]
    if matter.dimension == 2 and np.ptp(position[:, 1]) > 0:
        raise DustError(
            f"{path}: its y differ; with dimension: 2 the plane is x-z, and with dimension: 3 "
            "there are x, y and z."
        )
    if matter.dimension == 2:
        position[:, 1] = 0.0
    _check_densities(arrays, matter, path, of_run)
    _check_volumes(arrays, matter, path)
    _check_distances(position, matter, path, of_run)


def _check_numbers(arrays, path):
    for name, values in arrays.items():
        is_bad = ~np.isfinite(values)
        if name in POSITIVE:
            is_bad |= ~(values > 0)
        if is_bad.any():
            row = int(np.argwhere(is_bad)[0][0])
            allowed = "positive" if name in POSITIVE else "finite"
            raise DustError(
                f"{path}: {name} of particle {row} (from 0) is {values[row]}; allowed: {allowed} "
                "numbers."
            )


def _check_densities(arrays, matter, path, of_run):
    """Filling factors as of bodies; dust with a history may be as dense as its solid."""
    density = arrays["density"]
    phi = density / matter.solid
    largest = 1.0 if of_run or "reference" in arrays else matter.most
    bad_rows = np.flatnonzero(~((phi > matter.least) & (phi < largest)))
    if len(bad_rows):
        row = bad_rows[0]
        raise DustError(
            f"{path}: the density of particle {row} (from 0) is {density[row]:.4g} kg/m^3, "
            f"a filling factor of {phi[row]:.4g}; allowed with this material, whose "
            f"solid has {matter.solid:g} kg/m^3: above {matter.least:g} and below {largest:g}. "
            "The density is that of the dust, with its pores."
        )
    strain = density / arrays.get("reference", density)
    bad_rows = np.flatnonzero(~((strain > ELASTIC[0]) & (strain < ELASTIC[1])))
    if len(bad_rows):
        row = bad_rows[0]
        raise DustError(
            f"{path}: the density of particle {row} (from 0) is {strain[row]:.4g} times its "
            f"reference, the density without pressure; allowed: {ELASTIC[0]} to {ELASTIC[1]}."
        )


def spacings_of(arrays: dict, matter: Matter) -> np.ndarray:
    """Spacings (N,) [m] of the lattice on which particles have the volumes mass / density."""
    particle_volume = lattice.volume_of(1.0, matter.dimension)
    return (arrays["mass"] / arrays["density"] / particle_volume) ** (1.0 / matter.dimension)


def _check_volumes(arrays, matter, path):
    spacings = spacings_of(arrays, matter) / matter.spacing
    least, largest = SPACINGS
    size = np.where(spacings > 1.0, spacings / largest, least / spacings)
    worst = int(np.argmax(size))
    if size[worst] > 1.0:
        d = matter.dimension
        depth = " per metre of depth" if d == 2 else ""
        raise DustError(
            f"{path}: mass over density of particle {worst} (from 0) is "
            f"{arrays['mass'][worst] / arrays['density'][worst]:.3g} m^{d}, the volume of "
            f"particles {_length(spacings[worst] * matter.spacing)} apart; allowed: {least:g} to "
            f"{largest:g} times numerics.spacing, {_length(matter.spacing)}. Masses are in "
            f"kg{depth}, densities in kg/m^3; another unit may be in the header, as in mass "
            f"[{'g/m' if d == 2 else 'g'}]."
        )


def _check_distances(position, matter, path, of_run):
    if len(position) < 2:
        return
    distance, number = scipy.spatial.cKDTree(position).query(position, 2)
    nearest = distance[:, 1]
    closest = int(np.argmin(nearest))
    if nearest[closest] < COINCIDENT * matter.spacing:
        # of coincident particles either may come first
        pair = " and ".join(map(str, sorted({closest, *number[closest]})[:2]))
        apart = (
            "at the same position"
            if nearest[closest] == 0
            else f"{_length(nearest[closest])} apart"
        )
        raise DustError(f"{path}: particles {pair} (from 0) are {apart}; move them apart.")
    if not of_run and np.median(nearest) >= matter.support:
        raise DustError(
            f"{path}: its particles are {_length(np.median(nearest))} apart (the nearest two, "
            f"median), and the kernel reaches {_length(matter.support)}, so that no forces act "
            f"between them; allowed: distances near numerics.spacing, {_length(matter.spacing)}. "
            "Are the lengths in the unit you meant?"
        )


def remarks_on_volumes(arrays: dict, matter: Matter) -> list[str]:
    """Sentences on volumes that disagree with the spacing or with the distances of particles."""
    position = arrays["position"]
    if len(position) < 2:
        return []
    of_volume = float(np.median(spacings_of(arrays, matter)))
    nearest = scipy.spatial.cKDTree(position).query(position, 2)[0][:, 1]
    apart = float(np.median(nearest))
    remarks = []
    volumes = f"its masses over densities are volumes of particles {_length(of_volume)} apart"
    if not NEAR_SPACING[0] <= of_volume / matter.spacing <= NEAR_SPACING[1]:
        remarks.append(f"{volumes}, and numerics.spacing is {_length(matter.spacing)}")
    if not NEAR_DISTANCE[0] <= of_volume / apart <= NEAR_DISTANCE[1]:
        remarks.append(f"{volumes}, and the nearest are {_length(apart)} apart (medians)")
    alone = int(np.count_nonzero(nearest >= matter.support))
    if alone:
        remarks.append(
            f"{alone} of its {len(position)} particles have no other within the reach of the "
            f"kernel, {_length(matter.support)}"
        )
    return remarks


def _length(value) -> str:
    return quantities.format(float(value), "length", digits=4)
