"""Checks of the contacts of a sample from a file."""

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.names import WALLS

# largest distance of centres over the sum of the radii of a contact: far beyond any pull-off
FARTHEST = 1.5
UNIT = 1e-3  # by which the length of a pointer may differ from 1
MOST_TWIST = 1e3  # rad
MOST_SPEED = 3e8  # m/s


def check_contacts(contacts, positions, radii, nearest, where):
    """Raise DustError, with the source and the row, for an impossible contact.

    contacts: as in samples.netcdf, name -> (C,) or (C, 3). positions (N, 3) and radii (N,) or one
    number [m]: of the grains. nearest: maps distance vectors (C, 3) to those to the nearest image.
    """
    i, j = contacts["i"], contacts["j"]
    n = len(positions)
    _check_numbers(contacts, where)
    outside = (np.minimum(i, j) < 0) | (np.maximum(i, j) >= n)
    worst = np.where(np.maximum(i, j) >= n, np.maximum(i, j), np.minimum(i, j))
    _refuse(outside, where, lambda k: f"contacts name grain {worst[k]}", f"0 to {n - 1}")
    _refuse(i == j, where, lambda k: f"grain {i[k]} with itself", "two grains")
    both = np.broadcast_to(radii, n)[i] + np.broadcast_to(radii, n)[j]
    distance = np.linalg.norm(nearest(positions[i] - positions[j]), axis=1)
    _refuse(
        distance > FARTHEST * both,
        where,
        lambda k: f"grains {i[k]} and {j[k]}, {distance[k] * 1e6:g} µm apart",
        f"at most {FARTHEST} times the sum of their radii",
    )
    _check_springs(contacts, ("pointer_i", "pointer_j"), where)


def check_wall_contacts(contacts, positions, where):
    """Raise DustError for an impossible contact of a grain with a wall."""
    grain, wall, n = contacts["grain"], contacts["wall"], len(positions)
    _check_numbers(contacts, where)
    _refuse((grain < 0) | (grain >= n), where, lambda k: f"names grain {grain[k]}", f"0 to {n - 1}")
    outside = (wall < 0) | (wall >= len(WALLS))
    _refuse(outside, where, lambda k: f"names wall {wall[k]}", f"0 to {len(WALLS) - 1}")
    _check_springs(contacts, ("pointer",), where)


def _check_numbers(contacts, where):
    for name, values in contacts.items():
        bad = ~np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
        text = f"contacts' {name} has not-a-number"
        _refuse(bad, where, lambda k, text=text: text, "finite numbers")


def _check_springs(contacts, pointers, where):
    """Check that pointers are unit vectors, and the sizes of twist and approach."""
    for name in pointers:
        length = np.linalg.norm(contacts[name], axis=1)
        _refuse(
            np.abs(length - 1.0) > UNIT,
            where,
            lambda k, name=name, length=length: f"{name} has the length {length[k]:g}",
            "1, a unit vector",
        )
    for name, most in (("twist", MOST_TWIST), ("approach", MOST_SPEED)):
        values = contacts[name]
        _refuse(
            np.abs(values) > most,
            where,
            lambda k, name=name, values=values: f"{name} is {values[k]:g}",
            f"at most {most:g} in size",
        )


def _refuse(bad, where, what, allowed):
    """Raise DustError for the first bad row. what: its description, from the row."""
    rows = np.flatnonzero(bad)
    if len(rows):
        row = int(rows[0])
        raise DustError(f"{where}: contact {row} (from 0): {what(row)}; allowed: {allowed}.")
