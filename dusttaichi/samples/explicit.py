"""Grains given one by one: in the YAML, in a CSV or NetCDF file, or by another run's last frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from dusttaichi.errors import DustError
from dusttaichi.geometry import pairs_within
from dusttaichi.samples import files
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.stock import Stock

CLOSEST = 0.9  # diameters: at 10 % overlap JKR is far outside what it was derived for


def make(spec, radius: float, stock: Stock | None = None) -> Sample:
    """The grains that spec lists.

    spec: positions (N, 3) [m] with velocities [m/s], spins [rad/s], radii [m] and materials, or
    file (and units, the length in m that the file's x, y, z columns count in), as the scene's
    ExplicitSample has them. stock: where radii and materials come from; without it all grains have
    the radius.
    A file is CSV, NetCDF, or a run directory (its result.nc); of several snapshots the last one
    is taken, with the state of its pair contacts where it was written.
    Raises DustError for a file that is missing or lacks columns, arrays of the wrong shape,
    numbers that are not finite, no grains, a material that the scene does not have, or two centres
    closer than 0.9 diameters.
    """
    if spec.file is None:
        source, where = "positions", "sample.positions"
        state = {"position": spec.positions, "velocity": spec.velocities, "spin": spec.spins}
        state |= {
            "radius": getattr(spec, "radii", None),
            "material": getattr(spec, "materials", None),
        }
    else:
        source = str(spec.file)
        where = f"sample.file = {source!r}"
        state = files.read(Path(spec.file), where, getattr(spec, "units", None))
    positions = _vectors(state.get("position"), where, "position", None)
    if len(positions) == 0:
        raise DustError(f"{where}: it has no grains; allowed: one grain or more.")
    velocities = _vectors(state.get("velocity"), where, "velocity", len(positions))
    spins = _vectors(state.get("spin"), where, "spin", len(positions))
    own = {}
    if stock is not None:
        numbers = stock.numbers(state.get("material"), len(positions), where)
        own = stock.unlike(stock.radii(state.get("radius"), numbers, where), numbers)
    unlike = own.get("radii") is not None
    check_apart(positions, own["radii"] if unlike else radius, where)
    contacts = state.get("contacts")
    if contacts is not None:
        _check_contacts(contacts, len(positions), where)
    sample = Sample(positions, velocities, spins, contacts, **own)
    sample.info.update(kind="explicit", source=source, grains=len(positions))
    return sample


def _vectors(values, where: str, name: str, n: int | None) -> np.ndarray:
    """(N, 3) float64; zeros where nothing is given."""
    if values is None:
        return np.zeros((n or 0, 3))
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
        for grain, row in enumerate(values):
            if np.shape(row) != (3,):
                raise DustError(
                    f"{where}: {name} of grain {grain} (from 0) is {row!r}; allowed: three numbers."
                ) from None
    if array.size == 0:
        array = array.reshape(-1, 3)
    if array.ndim != 2 or array.shape[1] != 3 or (n is not None and len(array) != n):
        needed = "grains, 3" if n is None else f"{n}, 3"
        raise DustError(f"{where}: {name} has the shape {array.shape}; allowed: ({needed}).")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if len(bad):
        raise DustError(
            f"{where}: {name} of grain {bad[0]} (from 0) is {array[bad[0]].tolist()}; "
            "allowed: finite numbers."
        )
    return array


def check_apart(positions: np.ndarray, radius, where: str) -> None:
    """DustError, naming where they come from, for two centres closer than CLOSEST diameters.

    radius: of all grains, or (N,), where a diameter is the sum of two radii.
    """
    if len(positions) < 2:
        return
    if np.ndim(radius):
        i, j, distance = pairs_within(positions, radius, CLOSEST)
        if len(i):
            k = int(np.argmin(distance / (radius[i] + radius[j])))
            both = radius[i[k]] + radius[j[k]]
            raise DustError(
                f"{where}: grains {i[k]} and {j[k]} (from 0) are {distance[k] * 1e6:g} um apart; "
                f"allowed: at least {CLOSEST} of the sum of their radii, {CLOSEST * both * 1e6:g} "
                "um, between centres. Are the lengths in the unit you meant?"
            )
        return
    distance, neighbour = cKDTree(positions).query(positions, k=2)
    i = int(np.argmin(distance[:, 1]))
    gap = distance[i, 1]
    if gap < CLOSEST * 2 * radius:
        # The nearest other grain; where centres coincide it may be listed first.
        j = int(neighbour[i, 1] if neighbour[i, 1] != i else neighbour[i, 0])
        raise DustError(
            f"{where}: grains {min(i, j)} and {max(i, j)} (from 0) are {gap * 1e6:g} um apart, "
            f"{gap / (2 * radius):.3g} diameters; allowed: at least {CLOSEST} diameters, "
            f"{CLOSEST * 2e6 * radius:g} um, between centres (radius {radius * 1e6:g} um). "
            "Are the lengths in the unit you meant?"
        )


def _check_contacts(contacts: dict[str, np.ndarray], n: int, where: str) -> None:
    grains = np.concatenate([contacts["i"], contacts["j"]])
    if len(grains) and (grains.min() < 0 or grains.max() >= n):
        raise DustError(
            f"{where}: contacts name grain {grains.max() if grains.max() >= n else grains.min()}; "
            f"allowed: 0 to {n - 1}."
        )
    for name, values in contacts.items():
        if not np.isfinite(values).all():
            raise DustError(f"{where}: contacts' {name} has not-a-number; allowed: finite numbers.")
