"""The contacts of a simulation as a network of springs: its stiffest period and stable step."""

import numpy as np

from dusttaichi import units
from dusttaichi.grains.kernels.store import PLANES
from dusttaichi.grains.wall_geometry import normals_at, strengths_at
from dusttaichi.physics.network import Contacts, limit


def stable_step(contacts, table, motion) -> tuple[float, float]:
    """(shortest period [s], largest stable step [s]) of the present contacts.

    contacts: Contacts. table: ContactTable. motion: Motion. Every contact with the slope of its
    force and the damping where it is; walls with their strengths; polydisperse grains; across the
    faces. Infinite without contacts. Later contacts may be stiffer or more: see
    time_step.time_step.
    """
    bodies = motion.bodies
    mass = np.broadcast_to(np.ravel(bodies.mass), bodies.count) * units.MASS
    if not bodies.are_equal:
        mass = bodies.properties.mass  # in the sample's order
    return limit(make_network(contacts, table, motion), mass)


def make_network(contacts, table, motion):
    """physics.network.Contacts of the present Contacts, grains by the sample's numbers."""
    pairs, environment = contacts.measure_pairs(), motion.environment
    i, j, overlap = pairs["grain_i"], pairs["grain_j"], pairs["overlap"]
    constants_of = _choose_constants(table)
    springs = [constants_of(a, b) for a, b in zip(i.tolist(), j.tolist(), strict=True)]
    normal = _normals(motion, i, j)
    strength = np.ones(len(i))
    if environment.box is not None:
        walls = contacts.measure_walls()
        grain, wall = walls["grain"], walls["wall"]
        touching = zip(grain.tolist(), wall.tolist(), strict=True)
        springs += [constants_of(g, None, w) for g, w in touching]
        i, j = np.concatenate([i, grain]), np.concatenate([j, np.full(len(grain), -1)])
        x = motion.state["x"][motion.state.rank[grain]]
        normal = np.concatenate([normal, normals_at(environment.domain, wall, x, environment.time)])
        strength = np.concatenate([strength, strengths_at(environment.domain, wall)])
        overlap = np.concatenate([overlap, walls["overlap"]])
    overlap = np.array(overlap, float) * units.LENGTH
    springs_of_sides = {name: _column(springs, name) for name in ("r", "R", "k_s", "k_r", "k_t")}
    return Contacts(
        grain_i=np.array(i, int),
        grain_j=np.array(j, int),
        normal=np.reshape(normal, (-1, 3)),
        strength=np.array(strength, float),
        ratio=np.array([ratio for _, ratio in springs], float),
        k_n=_along(springs, overlap + _column(springs, "gap"), "slope"),
        kappa=_along(springs, overlap + _column(springs, "gap"), "kappa_at"),
        **springs_of_sides,
    )


def _column(springs, name):
    """A number of each contact; springs: (ContactConstants, r1/r2) of each."""
    return np.array([getattr(constants, name) for constants, _ in springs], float)


def _along(springs, overlap, name):
    """Values of a method of each contact (`slope`, `kappa_at`) at its overlap [m]."""
    rows_by_constants, out = {}, np.zeros(len(springs))
    for row, (constants, _) in enumerate(springs):
        rows_by_constants.setdefault(id(constants), (constants, []))[1].append(row)
    for constants, rows in rows_by_constants.values():
        out[rows] = getattr(constants, name)(overlap[rows])
    return out


def _normals(motion, i, j):
    """Unit vectors from grain j to grain i, through periodic faces where these are nearer."""
    x, environment = np.empty((motion.bodies.count, 3)), motion.environment
    x[motion.state.order] = motion.state.of_grains("x")
    d = x[i] - x[j]
    if environment.cell is not None:
        d = environment.cell.nearest(d, environment.time)
    return d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300)


def _choose_constants(table):
    """Function (grain, other grain or None: a wall, its number) -> (ContactConstants, r1/r2)."""
    properties = table.properties
    if properties is None:
        pair, walls = table.farthest_pair, [table.farthest_wall] * PLANES
        walls += table.farthest_on_surfaces
        return lambda i, j, wall=0: (walls[wall], 1.0) if j is None else (pair, 1.0)
    materials, radii = properties.material.tolist(), properties.radius.tolist()

    def constants_of(i, j, wall=0):
        first = materials[i], radii[i]
        if j is None:
            flat = wall < PLANES
            return table.wall(first) if flat else table.surface(first, wall - PLANES), 1.0
        return table.pair(first, (materials[j], radii[j])), radii[i] / radii[j]

    return constants_of


def tabulate_stability(contacts, table, motion):
    """Rows (what, value) of `dust check --internals`: the contacts at the start."""
    period, stable = stable_step(contacts, table, motion)
    if not np.isfinite(stable):
        return [("contacts", "none")]
    return [
        ("stiffest period of the present contacts", f"{period * 1e9:.4g} ns"),
        ("largest stable step there", f"{stable * 1e9:.4g} ns"),
    ]
