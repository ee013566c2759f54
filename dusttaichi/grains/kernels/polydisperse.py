"""Grains of their own radius and material: the numbers of each contact, in lanes.

Those of a pair of grains never change, so they are computed once, when a search lists the pair,
from the two radii and from a table of interfaces (`Interface` of physics.contact.constants, one row
for each two materials, and the keys of the laws' blocks, in internal units: the formulas hold in
any consistent ones). The passes read them as lanes in the place of the scalars of equal grains.
"""

from dataclasses import fields as fields_of
from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import get_args

import numpy as np
import taichi as ti

from dusttaichi import units
from dusttaichi.grains.kernels.params import lanes_type
from dusttaichi.physics.contact import constants

contact_radius = ti.func(constants.equilibrium_contact_radius)
equilibrium_overlap = ti.func(constants.equilibrium_overlap)
pull_off_force = ti.func(constants.pull_off_force)
reduced_radius = ti.func(constants.reduced_radius)

INTERFACE = {f.name: f.metadata["unit"] for f in fields_of(constants.Interface)}
FACE = [(name, column) for column, name in enumerate([*INTERFACE, "glue"])]
"""(name, column) of what the rows of the table say of two materials."""


def stored(laws):
    """Names of the numbers that the field `constants` holds for each contact: its columns."""
    return ("r1", "r2", "mass", *laws.numbers)


def own_keys(block):
    """Name -> number, internal units, of the keys of a law's block that are numbers."""
    out = {}
    for name, key in type(block).model_fields.items():
        value = getattr(block, name)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            out[name] = value / units.internal(_unit(key.metadata, key.annotation))
        elif value is None:
            out[name] = 0.0  # the columns of the table do not hang on what is given
    return out


def _unit(marks, annotation):
    """SI unit of a key that is marked as a quantity, "1" where none is."""
    for mark in (*marks, *getattr(annotation, "__metadata__", ())):
        if hasattr(mark, "unit"):
            return mark.unit
    parts = (_unit((), part) for part in get_args(annotation) if part is not annotation)
    return next((unit for unit in parts if unit != "1"), "1")


def _own(laws, interaction):
    """Effect -> own_keys of its block."""
    return {
        effect: {} if effect == "normal" else own_keys(getattr(interaction, effect))
        for effect, _ in laws.on
    }


def own_columns(laws, interaction):
    """Effect -> ((name, column), ...) of the keys of its block in the table."""
    out, column = {}, len(FACE)
    for effect, keys in _own(laws, interaction).items():
        out[effect] = tuple((name, column + n) for n, name in enumerate(keys))
        column += len(keys)
    return out


def interface_table(scene, laws, glue=1.0, sphere=None):
    """Rows of the table, internal units: materials i, j at i M + j, then each with the walls, then
    each with the sphere: its Material and the factor on the surface energy, or None without one.

    The first of the scene's materials, M of them, is that of the walls. glue: factor on the normal
    force of the walls.
    """
    materials, interaction = scene.all_materials, scene.interaction
    kinds = [(a, b, 1.0, 1.0) for a, b in product(materials, repeat=2)]
    kinds += [(a, materials[0], glue, 1.0) for a in materials]
    kinds += [] if sphere is None else [(a, sphere[0], 1.0, sphere[1]) for a in materials]
    own = [value for keys in _own(laws, interaction).values() for value in keys.values()]
    rows = []
    for a, b, factor, adhesion in kinds:
        face = constants.interface(a, b, interaction)
        face = replace(face, gamma=adhesion * face.gamma)
        values = [getattr(face, name) / units.internal(unit) for name, unit in INTERFACE.items()]
        rows.append([*values, factor, *own])
    return np.array(rows)


def make_numbers(fields, layout, laws):
    """Returns `of_pairs(b, p)`, `of_walls(b, p)`: the numbers of block b of the state.

    p: ContactParams, which are those of all contacts where grains are equal.
    """
    if not layout.polydisperse:

        @ti.func
        def equal(b, p):
            return p

        return equal, equal
    return make_lane_numbers(fields, layout, laws)


def make_lane_numbers(fields, layout, laws):
    """The same where each contact has its own."""
    table, touch = fields["constants"], fields.get("touch")
    Lanes = lanes_type(laws, layout.width, layout.geometry, layout.law)
    column = {name: n for n, name in enumerate(stored(laws))}
    R1, R2, MASS = (column[name] for name in ("r1", "r2", "mass"))
    of_laws = [(name, column[name]) for name in laws.numbers]

    @ti.func
    def kept(b, touch_of_table):
        return touch[b]

    @ti.func
    def made(b, touch_of_table):
        return touch_of_table

    touching_at = kept if layout.deviations else made

    @ti.func
    def own(b):
        """Numbers of the laws, by name."""
        return {name: table[b, n] for name, n in of_laws}

    @ti.func
    def lanes(b, r2, inv_r2, R):
        """All numbers; r2, inv_r2: of the second grain, 0 of a wall. R: the reduced radius."""
        r1 = table[b, R1]
        return Lanes(
            r1=r1,
            r2=r2,
            inv_r1=1.0 / r1,
            inv_r2=inv_r2,
            R=R,
            touch=touching_at(b, r1 + r2),
            inv_touch=1.0 / (r1 + r2),
            mass=table[b, MASS],
            **own(b),
        )

    @ti.func
    def of_pairs(b, p):
        r1, r2 = table[b, R1], table[b, R2]
        return lanes(b, r2, 1.0 / r2, r1 * r2 * (1.0 / (r1 + r2)))

    @ti.func
    def of_walls(b, p):
        zero = 0.0 * table[b, R1]
        return lanes(b, zero, zero, table[b, R1])

    return of_pairs, of_walls


def make_write_constants(fields, interfaces, scene, laws):
    """Returns `pair(b, k, g, j)`, `wall(b, k, g)`, `sphere(b, k, g, j)`, `empty(b, k)`: the numbers
    of lane k of block b, of grains g and j, of grain g and a wall, or the sphere (number j), of
    nothing.

    interfaces: field of `interface_table` of the scene.
    """
    materials, table, touch = len(scene.all_materials), fields["constants"], fields.get("touch")
    radius, mass, material = fields["radius"], fields["mass"], fields["material"]
    write = make_write(fields, interfaces, scene, laws)
    columns, wide = len(stored(laws)), touch is not None

    @ti.func
    def write_two(b, k, row, g, j):
        r1, r2, m1, m2 = radius[g], radius[j], mass[g], mass[j]
        R, reduced = reduced_radius(r1, r2), m1 * m2 / (m1 + m2)
        radii = {"r1": r1, "r2": r2, "R": R, "R_pair": R}
        masses = {"mass": reduced, "m0": 2.0 * reduced, "size": 2.0 * R}
        write(b, k, row, {**radii, **masses})

    @ti.func
    def write_pair(b, k, g, j):
        write_two(b, k, material[g] * materials + material[j], g, j)

    @ti.func
    def write_sphere(b, k, g, j):
        write_two(b, k, (materials + 1) * materials + material[g], g, j)

    @ti.func
    def write_wall(b, k, g):
        r, m = radius[g], mass[g]
        radii = {"r1": r, "r2": 0.0 * r, "R": r, "R_pair": reduced_radius(r, r)}
        masses = {"mass": m, "m0": m, "size": r}
        write(b, k, materials * materials + material[g], {**radii, **masses})

    @ti.func
    def write_empty(b, k):
        if ti.static(wide):
            touch[b][k] = 1.0
        for n in ti.static(range(columns)):
            table[b, n][k] = 1.0

    return SimpleNamespace(pair=write_pair, wall=write_wall, sphere=write_sphere, empty=write_empty)


def make_write(fields, interfaces, scene, laws):
    """Returns `write(b, k, row, two)`: the numbers of one contact, made by the laws.

    row: of the table of interfaces. two: radii and masses of the two by the names that
    ContactConstants has for them.
    """
    table, touch = fields["constants"], fields.get("touch")
    columns, wide = own_columns(laws, scene.interaction), touch is not None
    of_laws = [(law, columns[effect]) for effect, law in laws.on]
    column = {name: n for n, name in enumerate(stored(laws))}

    @ti.func
    def contact(row, two: ti.template()):
        """ContactConstants of these two, internal units."""
        face = {name: interfaces[row, n] for name, n in FACE}
        a0 = contact_radius(face["gamma"], two["R"], face["E_star"])
        F_jkr = pull_off_force(face["gamma"], two["R"])
        return ti.Struct(
            **face,
            **two,
            a0=a0,
            a0_pair=contact_radius(face["gamma"], two["R_pair"], face["E_star"]),
            delta0=equilibrium_overlap(a0, two["R"]),
            F_jkr=F_jkr,
            F_c=face["glue"] * F_jkr,
        )

    @ti.func
    def write(b, k, row, two: ti.template()):
        c = contact(row, two)
        if ti.static(wide):
            touch[b][k] = c.r1 + c.r2
        table[b, column["r1"]][k] = c.r1
        table[b, column["r2"]][k] = c.r2
        table[b, column["mass"]][k] = c.mass
        for law, keys in ti.static(of_laws):
            # a struct needs a member: the row, for a law without keys
            own = ti.Struct(row=row, **{name: interfaces[row, n] for name, n in keys})
            found = law.numbers(c, own)
            for name in ti.static(tuple(law.NUMBERS)):
                table[b, column[name]][k] = found[name]

    return write
