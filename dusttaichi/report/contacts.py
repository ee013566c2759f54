"""Contacts of grains for the viewer, and the quantities of grains that follow from them."""

import numpy as np

from dusttaichi.analysis.fragments import fragment_labels
from dusttaichi.analysis.frame import normal_force, read_frame
from dusttaichi.plots import style
from dusttaichi.report.packing import OUTLIERS, class_quantity, number_quantity, packed, quantised

NEEDED = ("grain", "grain_i", "grain_j", "wall", "overlap", "normal_force", "loss")  # of contacts
FRAGMENTS = 7  # largest ones with separate classes; the others share the last
SPHERE_END = 6  # after the walls: the end of a contact with the rigid sphere
COORDINATION, BODY, DISSIPATED = "coordination number", "body", "energy dissipated in contacts"


def contacts_of(run, frames, selection):
    """(contacts of all snapshots, quantities that follow from them); (None, []) without.

    selection: the Selection of the grains that are shown, to which `frames` is reduced. Contacts
    are those between them; numbers of a grain count all of its contacts.
    """
    if "contacts" not in run.tree.children or "contact_count" not in frames:
        return None, []
    count, rows = selection.count, frames.sizes["snapshot"]
    steps = run.tree["snapshots"].step.values
    numbers = [int(np.flatnonzero(steps == step)[-1]) for step in frames.step.values]
    ends, forces, coordination, labels, load, lost = [], [], [], [], [], []
    for number in numbers:
        frame = read_frame(run, number, contacts=NEEDED)
        force = normal_force(run, frame)
        others, press = _on_walls(run, frame, force is not None)
        between, pairs = selection.renumber(frame.pairs)
        order = np.lexsort((pairs[:, 1], pairs[:, 0]))
        reached, on_walls = selection.renumber(others[:, :1])
        on_walls = np.column_stack([on_walls[:, 0], others[reached, 1] + selection.size])
        ends.append(np.concatenate([pairs[order], on_walls]))
        coordination.append(selection.take(frame.coordination))
        label = np.minimum(fragment_labels(frame, frame.radius**3), FRAGMENTS)
        labels.append(selection.take(label))
        lost += [] if "loss" not in frame.contacts else [selection.take(dissipated(run, frame))]
        if force is not None:
            forces.append(np.concatenate([force[between][order], press[reached]]))
            grains, parts = np.append(frame.pairs.T.ravel(), others[:, 0]), [force, force, press]
            sums = np.bincount(grains, np.abs(np.concatenate(parts)), minlength=count)
            load.append(selection.take(sums))
    quantities = [
        number_quantity(COORDINATION, "", np.array(coordination), rows),
        class_quantity("fragment", np.array(labels), _fragment_names(labels), rows),
    ]
    contacts = {"counts": [len(e) for e in ends], "force": None}
    contacts["ends"] = packed(np.concatenate(ends).astype("u4")) if ends else None
    if forces:
        everything = np.concatenate(forces)
        contacts["force"] = quantised(everything * 1e9)
        squeezed = np.abs(everything) if len(everything) else np.ones(1)
        contacts["largest"] = float(np.percentile(squeezed, OUTLIERS)) * 1e9 or 1.0
        quantities.append(
            number_quantity("sum of contact forces", "nN", 1e9 * np.array(load), rows)
        )
    if lost:
        factor, unit = style.choose_unit(float(np.max(lost)), style.ENERGIES)
        quantities.append(number_quantity(DISSIPATED, unit, factor * np.array(lost), rows))
    if run.collides:
        body = np.zeros(count, int)
        body[run.bodies()[1]] = 1
        quantities.append(
            class_quantity(BODY, selection.take(body), {0: "target", 1: "projectile"}, rows)
        )
    return contacts, quantities


def dissipated(run, frame):
    """Energy dissipated in the present contacts of each grain since they formed [J], (grains,).

    Half of the energy for each of two grains, all of it at a wall or the rigid sphere.
    """
    count, pairs = len(frame.radius), frame.contacts
    half = 0.5 * pairs.loss.sum("channel").values
    found = np.bincount(frame.pairs.T.ravel(), np.tile(half, 2), minlength=count)
    for own in _beside_grains(run, frame):
        if "loss" in own:
            grains = own.grain.values.astype(int)
            found += np.bincount(grains, own.loss.sum("channel").values, minlength=count)
    return found


def _beside_grains(run, frame):
    """The contacts of a Frame with walls and with the rigid sphere, if any."""
    groups = [] if frame.wall_contacts is None else [frame.wall_contacts]
    if "sphere_contacts" in run.tree.children:
        groups.append(run.contacts(frame.number, "sphere_contacts", NEEDED))
    return groups


def _on_walls(run, frame, forces):
    """Contacts of grains with walls and the rigid sphere, (n, 2), and normal forces [N], (n,).

    The second end is the number of the wall, 6 for the sphere. With `forces` only contacts that
    have a force.
    """
    found = [(np.zeros((0, 2), int), np.zeros(0))]
    for own in _beside_grains(run, frame):
        if forces and "normal_force" not in own:
            continue
        wall = own.wall.values if "wall" in own else np.full(len(own.grain), SPHERE_END)
        press = own.normal_force.values if forces else np.zeros(len(own.grain))
        found.append((np.stack([own.grain.values, wall], axis=1), press))
    ends, press = zip(*found, strict=True)
    return np.concatenate(ends).astype(int), np.concatenate(press)


def _fragment_names(labels):
    last = int(max(label.max() for label in labels))
    names = {n: "largest" if n == 0 else f"no. {n + 1}" for n in range(min(last + 1, FRAGMENTS))}
    return names | ({FRAGMENTS: "smaller"} if last >= FRAGMENTS else {})
