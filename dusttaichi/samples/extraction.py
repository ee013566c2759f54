"""Grains from another run: a fragment, a sphere, contacts with walls, the box, the time.

The keys `fragment` and `keep` select the parts of a result; `info["remarks"]` lists the other ones.
Kind `cutout` cuts spheres of a number of grains.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import WALLS, heaviest_first, label_components
from dusttaichi.physics.unwrap import unwrap_fragments
from dusttaichi.samples.files import remarks_on_reading, unread_of
from dusttaichi.samples.sample import Sample
from dusttaichi.scene.fields import AnyScene

LARGEST = "largest"


def extract_fragment(
    sample: Sample,
    wall_contacts: dict[str, NDArray[Any]] | None,
    which: Any,
    *,
    pairs: NDArray[np.integer],
    nearest: Callable[[NDArray[Any]], NDArray[Any]],
    masses: NDArray[np.float64],
    origin: str,
) -> tuple[Sample, dict[str, NDArray[Any]] | None, int]:
    """Extract one fragment: (Sample, wall contacts, number of all fragments).

    which: "largest", or its number in order of decreasing mass, from 0. pairs: (C, 2) grains in
    contact. masses: (N,). nearest: maps distance vectors [m] to those to the nearest image, so that
    the fragment is not cut by the faces of its cell. Raises DustError for one that there is not.
    """
    number, label = label_components(pairs, len(sample))
    order = heaviest_first(label, masses)
    rank = 0 if which == LARGEST else which
    if rank >= number:
        raise DustError(
            f"sample.fragment = {which}: {origin} has {number} fragments; allowed: 0 to "
            f"{number - 1}, or {LARGEST}."
        )
    members = np.flatnonzero(label == order[rank])
    positions = unwrap_fragments(sample.positions, pairs, members[:1], nearest)
    if wall_contacts is not None:
        rows = np.isin(wall_contacts["grain"], members)
        wall_contacts = _renumber(wall_contacts, rows, members, ("grain",))
    selected = select_grains(replace(sample, positions=positions), members)
    return selected, wall_contacts, number


def select_grains(sample: Sample, members: NDArray[np.integer]) -> Sample:
    """Select some grains of a sample, and the contacts between them.

    members: numbers of the grains in increasing order. Contacts with walls and info are left out.
    """
    contacts = sample.contacts
    if contacts is not None:
        inside = np.isin(contacts["i"], members) & np.isin(contacts["j"], members)
        contacts = _renumber(contacts, inside, members, ("i", "j"))
    return Sample(
        sample.positions[members],
        sample.velocities[members],
        sample.spins[members],
        contacts,
        radii=None if sample.radii is None else sample.radii[members],
        materials=None if sample.materials is None else sample.materials[members],
    )


def extract_sphere(
    sample: Sample,
    count: int,
    seed: int | None,
    *,
    period: NDArray[np.float64],
    nearest: Callable[[NDArray[Any]], NDArray[Any]],
    diameter: float,
) -> Sample:
    """Extract the `count` grains nearest to a centre, with the contacts between them, at rest.

    seed: that of the grain about which the sphere is; None for the middle of the bounding box.
    period: edges of the cell (3,) [m], inf where it is not periodic. nearest: maps distance vectors
    (N, 3) [m] to those to the nearest image. diameter: of the largest grain [m], the least length
    of a contact that counts here. Positions are about the centre of the sphere. A collision needs
    bodies without motion of their own: velocities and spins are zero.
    Raises DustError for too few grains, or where the sphere would touch its own image.
    """
    if count > len(sample):
        raise DustError(
            f"sample.grains = {count}: sample.of has {len(sample)} grains; allowed: no more."
        )
    centre = 0.5 * (sample.positions.min(axis=0) + sample.positions.max(axis=0))
    if seed is not None:
        centre = sample.positions[np.random.default_rng(seed).integers(len(sample))]
    away = nearest(sample.positions - centre)
    distance = np.linalg.norm(away, axis=1)
    members = np.sort(np.argsort(distance, kind="stable")[:count])
    reach = diameter
    if sample.contacts is not None:
        i, j = sample.contacts["i"], sample.contacts["j"]
        apart = np.linalg.norm(nearest(sample.positions[i] - sample.positions[j]), axis=1)
        reach = apart.max(initial=diameter)
    # grains on opposite sides would else be in contact through the faces of the cell
    if 2.0 * distance[members].max() + reach >= np.min(period):
        inside = np.count_nonzero(distance < 0.5 * (np.min(period) - reach))
        raise DustError(
            f"sample.grains = {count}: the sphere is wider than the cell of sample.of; allowed: up "
            f"to {inside} grains, or a larger cell."
        )
    still = np.zeros_like(away)
    return select_grains(
        replace(sample, positions=away, velocities=still, spins=still.copy()), members
    )


def _renumber(
    contacts: dict[str, NDArray[Any]],
    rows: NDArray[Any],
    members: NDArray[np.integer],
    names: tuple[str, ...],
) -> dict[str, NDArray[Any]]:
    """Select rows of contacts, and number the grains in `names` by their positions in `members`."""
    selected = {name: values[rows] for name, values in contacts.items()}
    return selected | {name: np.searchsorted(members, selected[name]) for name in names}


def keep_environment(
    sample: Sample,
    state: dict[str, Any],
    wall_contacts: dict[str, NDArray[Any]] | None,
    spec: Any,
    origin: str,
) -> Sample:
    """Keep the parts in `spec.keep` of a file's state in a sample, with a remark on the others.

    Raises DustError for parts that the file does not have.
    """
    info, keep = dict(sample.info), spec.keep
    room = state.get("room", np.full(6, np.nan))
    if (no_cell := state.get("no_cell")) and {"walls", "box"} & set(keep):
        raise DustError(f"sample.keep: {origin}: {no_cell}; leave box out, or turn the grains.")
    if keep and not np.isfinite(room).any() and set(keep) != {"time"}:
        raise DustError(f"sample.keep: {origin} has no walls and no cell (snapshots/box) to keep.")
    if "walls" in keep:
        if wall_contacts is None:
            raise DustError(f"sample.keep: {origin} has no contacts with walls.")
        check_wall_contacts(wall_contacts, sample.positions, origin)
    if "box" in keep or "walls" in keep:
        info["room"] = room.tolist()
        if state.get("tilt"):
            info["tilt"] = state["tilt"]
    if "time" in keep:
        if "time" not in state:
            raise DustError(f"sample.keep: {origin} has no time (snapshot_time).")
        info["start_time"] = state["time"]
    if reading := remarks_on_reading(state, spec.file):
        info["reading"] = reading
    if remarks := remarks_on_reading(
        state, spec.file, _describe_unused(state, wall_contacts, keep)
    ):
        info["remarks"] = remarks
    return replace(sample, wall_contacts=wall_contacts if "walls" in keep else None, info=info)


def _describe_unused(
    state: dict[str, Any], wall_contacts: dict[str, NDArray[Any]] | None, keep: tuple[str, ...]
) -> str:
    """Describe the unused parts of the file and on the keys that select them, or ""."""
    unread, descriptions = unread_of(state), {}
    touching = 0 if wall_contacts is None else len(wall_contacts["wall"])
    if touching:
        descriptions["walls"] = f"its {touching} contacts with walls and the load that they carry"
    if np.isfinite(state.get("room", np.nan)).any():
        descriptions["box"] = "the positions of its walls and faces"
    unused = {key: text for key, text in descriptions.items() if key not in keep}
    if "walls" in keep:
        unused.pop("box", None)
    if not unused:
        return unread
    text = f"{'; '.join(unused.values())} (to keep them: sample.keep: [{', '.join(unused)}])"
    return f"{unread}; {text}" if unread else text


def _name_wall(number: int) -> str:
    return WALLS[number] if number < len(WALLS) else f"surface {number - len(WALLS)}"


def drop_missing_walls(scene: AnyScene, sample: Sample) -> Sample:
    """Drop contacts with walls that the scene does not have, with a remark."""
    if sample.wall_contacts is None:
        return sample
    wall, tube = sample.wall_contacts["wall"], ["tube"] * (scene.boundary.kind == "tube")
    # surfaces of the scene have the numbers behind the planes
    behind = [*tube, *[f"surfaces[{n}]" for n in range(len(getattr(scene, "surfaces", ())))]]
    walls = [*np.flatnonzero(np.isin(WALLS, scene.boundary.walls)), *range(6, 6 + len(behind))]
    is_present = np.isin(wall, walls)
    if is_present.all():
        return sample
    gone = ", ".join(_name_wall(n) for n in np.unique(wall[~is_present]))
    dropped = np.count_nonzero(~is_present)
    noun = "1 contact" if dropped == 1 else f"{dropped:,} contacts"
    verb = "is" if dropped == 1 else "are"
    text = f"sample: {noun} with {gone} {verb} dropped: no such walls here"
    rows = {name: values[is_present] for name, values in sample.wall_contacts.items()}
    return replace(sample, wall_contacts=rows).with_remarks(text)


# largest distance of centres over the sum of the radii of a contact: far beyond any pull-off
FARTHEST = 1.5
UNIT = 1e-3  # by which the length of a pointer may differ from 1
MOST_TWIST = 1e3  # rad
MOST_SPEED = 3e8  # m/s


def check_contacts(
    contacts: dict[str, NDArray[Any]],
    positions: NDArray[np.float64],
    radii: float | NDArray[np.float64],
    nearest: Callable[[NDArray[Any]], NDArray[Any]],
    origin: str,
) -> None:
    """Raise DustError, with the source and the row, for an impossible contact.

    contacts: as in samples.netcdf, name -> (C,) or (C, 3). positions (N, 3) and radii (N,) or one
    number [m]: of the grains. nearest: maps distance vectors (C, 3) to those to the nearest image.
    """
    i, j = contacts["i"], contacts["j"]
    n = len(positions)
    _check_numbers(contacts, origin)
    outside = (np.minimum(i, j) < 0) | (np.maximum(i, j) >= n)
    worst = np.where(np.maximum(i, j) >= n, np.maximum(i, j), np.minimum(i, j))
    _refuse(outside, origin, lambda k: f"contacts name grain {worst[k]}", f"0 to {n - 1}")
    _refuse(i == j, origin, lambda k: f"grain {i[k]} with itself", "two grains")
    both = np.broadcast_to(radii, n)[i] + np.broadcast_to(radii, n)[j]
    distance = np.linalg.norm(nearest(positions[i] - positions[j]), axis=1)
    _refuse(
        distance > FARTHEST * both,
        origin,
        lambda k: f"grains {i[k]} and {j[k]}, {distance[k] * 1e6:g} µm apart",
        f"at most {FARTHEST} times the sum of their radii",
    )
    _check_springs(contacts, ("pointer_i", "pointer_j"), origin)


def check_wall_contacts(
    contacts: dict[str, NDArray[Any]], positions: NDArray[np.float64], origin: str
) -> None:
    """Raise DustError for an impossible contact of a grain with a wall."""
    grain, wall, n = contacts["grain"], contacts["wall"], len(positions)
    _check_numbers(contacts, origin)
    _refuse(
        (grain < 0) | (grain >= n),
        origin,
        lambda k: f"names grain {grain[k]}",
        f"0 to {n - 1}",
    )
    # those that the scene has no wall or surface for are left out, with a remark
    _refuse(wall < 0, origin, lambda k: f"names wall {wall[k]}", "0 or more")
    _check_springs(contacts, ("pointer",), origin)


def _check_numbers(contacts: dict[str, NDArray[Any]], origin: str) -> None:
    for name, values in contacts.items():
        not_finite = ~np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
        _refuse(not_finite, origin, partial(_name_fault, name), "finite numbers")


def _name_fault(name: str, row: int) -> str:
    return f"contacts' {name} has not-a-number"


def _describe_entry(text: str, values: NDArray[Any], row: int) -> str:
    return f"{text} {values[row]:g}"


def _check_springs(
    contacts: dict[str, NDArray[Any]], pointers: tuple[str, ...], origin: str
) -> None:
    """Check that pointers are unit vectors, and the sizes of twist and approach."""
    for name in pointers:
        length = np.linalg.norm(contacts[name], axis=1)
        _refuse(
            np.abs(length - 1.0) > UNIT,
            origin,
            partial(_describe_entry, f"{name} has the length", length),
            "1, a unit vector",
        )
    for name, limit in (("twist", MOST_TWIST), ("approach", MOST_SPEED)):
        values = contacts[name]
        _refuse(
            np.abs(values) > limit,
            origin,
            partial(_describe_entry, f"{name} is", values),
            f"at most {limit:g} in size",
        )


def _refuse(
    refused: NDArray[np.bool_], origin: str, describe_row: Callable[[int], str], allowed: str
) -> None:
    """Raise DustError for the first refused row; describe_row: its description, from the row."""
    rows = np.flatnonzero(refused)
    if len(rows):
        row = int(rows[0])
        raise DustError(
            f"{origin}: contact {row} (from 0): {describe_row(row)}; allowed: {allowed}."
        )
