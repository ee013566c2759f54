"""The contacts of a simulation as a network of springs: its stiffest period and stable step."""

import numpy as np

from dusttaichi import units
from dusttaichi.grains.contacts import contact_state, touch, wall_contact_state
from dusttaichi.physics.network import Contacts, limit


def stable_step(sim):
    """(shortest period [s], largest stable step [s]) of the contacts that there are now.

    Every contact with the slope of its force and the damping where it is; walls with their
    strengths; polydisperse grains; across the faces. Infinite without contacts. Contacts to come
    may be stiffer or more: see time_step.time_step for those.
    """
    mass = np.broadcast_to(np.ravel(sim.mass), sim.grains) * units.MASS
    if sim.polydisperse is not None:
        mass = sim.polydisperse.mass  # in the sample's order
    return limit(contacts_of(sim), mass)


def contacts_of(sim):
    """physics.network.Contacts of a simulation, grains by the sample's numbers."""
    pairs = contact_state(sim)
    i, j, overlap = pairs["grain_i"], pairs["grain_j"], pairs["overlap"]
    kind_of = _kinds(sim)
    pair_kinds = [kind_of(a, b) for a, b in zip(i.tolist(), j.tolist(), strict=True)]
    normal = _normals(sim, i, j, touch(sim, i, j) - overlap)
    strength = np.ones(len(i))
    if sim.box is not None:
        walls = wall_contact_state(sim)
        g, wall = walls["grain"], walls["wall"]
        pair_kinds += [kind_of(a, None) for a in g.tolist()]
        i, j = np.concatenate([i, g]), np.concatenate([j, np.full(len(g), -1)])
        normal = np.concatenate([normal, sim.box.normal[wall]])
        strength = np.concatenate([strength, sim.box.strength[wall]])
        overlap = np.concatenate([overlap, walls["overlap"]])
    overlap = np.array(overlap, float) * units.LENGTH
    same = {name: _column(pair_kinds, name) for name in ("r", "R", "k_s", "k_r", "k_t")}
    return Contacts(
        grain_i=np.array(i, int),
        grain_j=np.array(j, int),
        normal=np.reshape(normal, (-1, 3)),
        strength=np.array(strength, float),
        ratio=np.array([ratio for _, ratio in pair_kinds], float),
        k_n=_along(pair_kinds, overlap + _column(pair_kinds, "gap"), "slope"),
        kappa=_along(pair_kinds, overlap + _column(pair_kinds, "gap"), "kappa_at"),
        **same,
    )


def _column(pair_kinds, name):
    """A number of each contact; pair_kinds: (ContactConstants, r1/r2) of each."""
    return np.array([getattr(c, name) for c, _ in pair_kinds], float)


def _along(pair_kinds, overlap, name):
    """Values of a method of each contact (`slope`, `kappa_at`) at its overlap [m]."""
    indices, out = {}, np.zeros(len(pair_kinds))
    for n, (contact, _) in enumerate(pair_kinds):
        indices.setdefault(id(contact), (contact, []))[1].append(n)
    for contact, rows in indices.values():
        out[rows] = getattr(contact, name)(overlap[rows])
    return out


def _normals(sim, i, j, distance):
    """Unit vectors from grain j to grain i, through periodic faces where these are nearer."""
    x = np.empty((sim.grains, 3))
    x[sim.order] = sim.state.of_grains("x")
    d = x[i] - x[j]
    if sim.cell is not None:
        d = sim.cell.nearest(d, sim.time)
    return d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300)


def _kinds(sim):
    """Function (grain, other grain or None: a wall) -> (ContactConstants, r1/r2)."""
    table, properties = sim.contact_table, sim.polydisperse
    if properties is None:
        pair, wall = table.farthest_pair, table.farthest_wall
        return lambda i, j: (wall, 1.0) if j is None else (pair, 1.0)
    materials, radii = properties.material.tolist(), properties.radius.tolist()

    def constants_of(i, j):
        first = materials[i], radii[i]
        if j is None:
            return table.wall(first), 1.0
        return table.pair(first, (materials[j], radii[j])), radii[i] / radii[j]

    return constants_of


def rows(sim):
    """Rows (what, value) of `dust check --internals`: the contacts at the start."""
    period, stable = stable_step(sim)
    if not np.isfinite(stable):
        return [("contacts", "none")]
    return [
        ("stiffest period of the present contacts", f"{period * 1e9:.4g} ns"),
        ("largest stable step there", f"{stable * 1e9:.4g} ns"),
    ]
