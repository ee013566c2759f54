"""Contacts of grains for the viewer, and the quantities of grains that follow from them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.fragments import label_fragments
from dusttaichi.analysis.frame import compute_normal_force, read_frame
from dusttaichi.plots import style
from dusttaichi.report.packing import (
    OUTLIERS,
    make_class_quantity,
    make_number_quantity,
    pack_array,
    quantise,
)

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run
    from dusttaichi.report.packing import Content
    from dusttaichi.report.selection import Selection

NEEDED = ("grain", "grain_i", "grain_j", "wall", "overlap", "normal_force", "loss")  # of contacts
FRAGMENTS = 7  # largest ones with separate classes; the others share the last
SPHERE_END = 6  # after the walls: the end of a contact with the rigid sphere
COORDINATION, BODY, DISSIPATED = "coordination number", "body", "energy dissipated in contacts"


class SnapshotContacts(NamedTuple):
    """Contacts between the shown grains of a snapshot, and what follows of these grains."""

    ends: NDArray[np.integer]  #: Grains of each contact, or grain and wall, (contacts, 2).
    force: NDArray[np.float64] | None  #: Normal forces [N], (contacts,).
    coordination: NDArray[np.integer]  #: (grains,).
    fragment: NDArray[np.integer]  #: 0 of the largest, FRAGMENTS of all small ones, (grains,).
    load: NDArray[np.float64] | None  #: Sums of the sizes of all forces on a grain [N], (grains,).
    dissipated: NDArray[np.float64] | None  #: As of sum_dissipation [J], (grains,).


def collect_contacts(
    run: Run, frames: xr.Dataset, selection: Selection
) -> tuple[Content | None, list[Content | None]]:
    """Collect (contacts of all snapshots, quantities that follow from them); (None, []) without.

    selection: the Selection of the grains that are shown, to which `frames` is reduced. Contacts
    are those between them; numbers of a grain count all of its contacts.
    """
    tree = run.tree
    if tree is None or "contacts" not in tree.children or "contact_count" not in frames:
        return None, []
    steps = tree["snapshots"].step.values
    numbers = [int(np.flatnonzero(steps == step)[-1]) for step in frames.step.values]
    snapshots = [_read_contacts(run, number, selection) for number in numbers]
    quantities = _list_quantities(snapshots)
    if run.collides:
        body = np.zeros(selection.count, int)
        body[run.bodies()[1]] = 1
        names = {0: "target", 1: "projectile"}
        quantities.append(make_class_quantity(BODY, selection.take(body), names, len(snapshots)))
    return _pack_contacts(snapshots), quantities


def _read_contacts(run: Run, number: int, selection: Selection) -> SnapshotContacts:
    frame = read_frame(run, number, contacts=NEEDED)
    pair_forces = compute_normal_force(run, frame)
    ends_on_walls, wall_forces = _list_wall_contacts(run, frame, pair_forces is not None)
    between, pairs = selection.renumber(frame.pairs)
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    reached, on_walls = selection.renumber(ends_on_walls[:, :1])
    on_walls = np.column_stack([on_walls[:, 0], ends_on_walls[reached, 1] + selection.size])
    force = load = dissipated = None
    if pair_forces is not None:
        force = np.concatenate([pair_forces[between][order], wall_forces[reached]])
        grains = np.append(frame.pairs.T.ravel(), ends_on_walls[:, 0])
        sizes = np.abs(np.concatenate([pair_forces, pair_forces, wall_forces]))
        load = selection.take(np.bincount(grains, sizes, minlength=selection.count))
    if "loss" in frame.require_contacts():
        dissipated = selection.take(sum_dissipation(run, frame))
    return SnapshotContacts(
        np.concatenate([pairs[order], on_walls]),
        force,
        selection.take(frame.coordination),
        selection.take(np.minimum(label_fragments(frame, frame.radius**3), FRAGMENTS)),
        load,
        dissipated,
    )


def _pack_contacts(snapshots: Sequence[SnapshotContacts]) -> Content:
    """Ends and forces of the contacts of all snapshots, one after another."""
    ends = [snapshot.ends for snapshot in snapshots]
    contacts: Content = {"counts": [len(e) for e in ends], "force": None}
    contacts["ends"] = pack_array(np.concatenate(ends).astype("u4")) if ends else None
    forces = [snapshot.force for snapshot in snapshots if snapshot.force is not None]
    if forces:
        everything = np.concatenate(forces)
        contacts["force"] = quantise(everything * 1e9)
        squeezed = np.abs(everything) if len(everything) else np.ones(1)
        contacts["largest"] = float(np.percentile(squeezed, OUTLIERS)) * 1e9 or 1.0
    return contacts


def _list_quantities(snapshots: Sequence[SnapshotContacts]) -> list[Content | None]:
    """Quantities of the grains, (snapshots, grains) each."""
    rows = len(snapshots)
    coordination = np.array([snapshot.coordination for snapshot in snapshots])
    fragments = [snapshot.fragment for snapshot in snapshots]
    quantities: list[Content | None] = [
        make_number_quantity(COORDINATION, "", coordination, rows),
        make_class_quantity("fragment", np.array(fragments), _name_fragments(fragments), rows),
    ]
    loads = [snapshot.load for snapshot in snapshots if snapshot.load is not None]
    if loads:
        forces = 1e9 * np.array(loads)
        quantities.append(make_number_quantity("sum of contact forces", "nN", forces, rows))
    losses = [snapshot.dissipated for snapshot in snapshots if snapshot.dissipated is not None]
    if losses:
        factor, unit = style.choose_unit(float(np.max(losses)), style.ENERGIES)
        quantities.append(make_number_quantity(DISSIPATED, unit, factor * np.array(losses), rows))
    return quantities


def sum_dissipation(run: Run, frame: Frame) -> NDArray[np.float64]:
    """Sum the energy dissipated in the present contacts of each grain [J], (grains,).

    Since they formed: half of the energy for each of two grains, all of it at a wall or the
    rigid sphere.
    """
    count, pairs = len(frame.radius), frame.require_contacts()
    half = 0.5 * pairs.loss.sum("channel").values
    energies = np.zeros(count)
    energies += np.bincount(frame.pairs.T.ravel(), np.tile(half, 2), minlength=count)
    for contacts in _read_boundary_contacts(run, frame):
        if "loss" in contacts:
            grains = contacts.grain.values.astype(int)
            energies += np.bincount(grains, contacts.loss.sum("channel").values, minlength=count)
    return energies


def _read_boundary_contacts(run: Run, frame: Frame) -> list[xr.Dataset]:
    """Read the contacts of a Frame with walls and with the rigid sphere, if any."""
    groups = [] if frame.wall_contacts is None else [frame.wall_contacts]
    if run.tree is not None and "sphere_contacts" in run.tree.children:
        groups.append(run.contacts(frame.number, "sphere_contacts", NEEDED))
    return groups


def _list_wall_contacts(
    run: Run, frame: Frame, forces: bool
) -> tuple[NDArray[np.integer], NDArray[np.float64]]:
    """List contacts of grains with walls and the rigid sphere, (n, 2), and normal forces [N], (n,).

    The second end is the number of the wall, 6 for the sphere. With `forces` only contacts that
    have a force.
    """
    contacts_and_forces = [(np.zeros((0, 2), int), np.zeros(0))]
    for contacts in _read_boundary_contacts(run, frame):
        if forces and "normal_force" not in contacts:
            continue
        wall = (
            contacts.wall.values if "wall" in contacts else np.full(len(contacts.grain), SPHERE_END)
        )
        wall_forces = contacts.normal_force.values if forces else np.zeros(len(contacts.grain))
        contacts_and_forces.append((np.stack([contacts.grain.values, wall], axis=1), wall_forces))
    ends, wall_forces = zip(*contacts_and_forces, strict=True)
    return np.concatenate(ends).astype(int), np.concatenate(wall_forces)


def _name_fragments(labels: Iterable[NDArray[np.integer]]) -> dict[int, str]:
    last = int(max(label.max() for label in labels))
    names = {n: "largest" if n == 0 else f"no. {n + 1}" for n in range(min(last + 1, FRAGMENTS))}
    return names | ({FRAGMENTS: "smaller"} if last >= FRAGMENTS else {})
