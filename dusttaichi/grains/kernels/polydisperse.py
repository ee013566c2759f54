"""Grains of their own radius and material: the numbers of each contact, rows of its block.

The numbers of a pair never change and are computed once, when a search lists the pair, from the two
radii and from a table of interfaces (`Interface` of physics.contact.interface, one row for each two
materials, and the keys of the laws' blocks, in internal units: the formulas hold in any consistent
ones). The passes read them instead of those of equal grains.
"""

from dataclasses import fields as fields_of
from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import get_args

import numpy as np

from dusttaichi import units
from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.contact_numbers import WALL, EqualNumbers
from dusttaichi.grains.kernels.store import PLANES
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.effect_registry import block_in, properties_of
from dusttaichi.physics.surfaces.surface_model import CURVATURE
from dusttaichi.scene.dimensions import DIMENSIONS

contact_radius = ti.func(constants.equilibrium_contact_radius)
equilibrium_overlap = ti.func(constants.equilibrium_overlap)
first_touch = ti.func(constants.first_touch)
pull_off_force = ti.func(constants.pull_off_force)
reduced_radius = ti.func(constants.reduced_radius)

INTERFACE = {
    f.name: f.metadata["unit"] for f in fields_of(constants.Interface) if "unit" in f.metadata
}
FACE = [(name, column) for column, name in enumerate([*INTERFACE, "glue"])]
"""(name, column) of what the rows of the table say of two materials."""


def list_stored_numbers(model, softened=False, curved=False):
    """Names of the numbers that each contact has: rows from Layout.constants on.

    curved: there are surfaces, so that the reduced radius does not follow from the radii.
    """
    further = [*["gap"] * softened, *["R"] * curved]
    return ("r1", "r2", "mass", *further, *model.numbers)


def own_keys(block):
    """Name -> number, internal units, of the keys of a law's block that are numbers."""
    out = {}
    for name, key in type(block).model_fields.items():
        value = getattr(block, name)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            out[name] = value / units.GRAINS(_unit(key.metadata, key.annotation))
        elif value is None:
            out[name] = 0.0  # the columns of the table do not depend on the keys that a scene sets
    return out


def _unit(marks, annotation):
    """SI unit of a key that is marked as a quantity, "1" where none is."""
    for mark in (*marks, *getattr(annotation, "__metadata__", ())):
        if hasattr(mark, "unit"):
            return mark.unit
    units = (_unit((), argument) for argument in get_args(annotation) if argument is not annotation)
    return next((unit for unit in units if unit != "1"), "1")


def _own(model, interaction):
    """Effect -> own_keys of its block."""
    return {effect: own_keys(block_in(interaction, effect)) for effect, _ in model.effects}


def property_columns(interaction):
    """(name, column) of the properties of materials that laws have brought in."""
    return [(name, len(FACE) + n) for n, name in enumerate(properties_of(interaction))]


def own_columns(model, interaction):
    """Effect -> ((name, column), ...) of the keys of its block in the table."""
    out, column = {}, len(FACE) + len(property_columns(interaction))
    for effect, keys in _own(model, interaction).items():
        out[effect] = tuple((name, column + n) for n, name in enumerate(keys))
        column += len(keys)
    return out


def interface_table(scene, model, glue=1.0, sphere=None):
    """Rows of the table of interfaces, internal units.

    Materials i, j at i M + j, then each with the walls, then each with the sphere: its Material and
    the factor on the surface energy, or None without one. The first of the scene's materials, M of
    them, is that of the walls. glue: factor on the normal force of the walls.
    """
    materials, interaction = scene.all_materials, scene.interaction
    interfaces = [(first, second, 1.0, 1.0) for first, second in product(materials, repeat=2)]
    interfaces += [(first, materials[0], glue, 1.0) for first in materials]
    interfaces += (
        [] if sphere is None else [(first, sphere[0], 1.0, sphere[1]) for first in materials]
    )
    law_values = [value for keys in _own(model, interaction).values() for value in keys.values()]
    rows = []
    for first, second, factor, adhesion in interfaces:
        face = constants.interface(first, second, interaction)
        face = replace(face, gamma=adhesion * face.gamma)
        values = [getattr(face, name) / units.GRAINS(unit) for name, unit in INTERFACE.items()]
        values += [factor, *_internal_properties(face, interaction)]
        rows.append([*values, *law_values])
    return np.array(rows)


def _internal_properties(face, interaction):
    """Properties of an Interface in internal units."""
    declared = properties_of(interaction)
    return [
        value / units.GRAINS(DIMENSIONS[declared[name].dimension].unit)
        for name, value in face.properties
    ]


def make_numbers(fields, layout):
    """The numbers of contacts as the passes read them: EqualNumbers or OwnNumbers."""
    return (OwnNumbers if layout.polydisperse else EqualNumbers)(fields, layout)


@ti.data_oriented
class OwnNumbers(EqualNumbers):
    """Reads the numbers of each contact."""

    def __init__(self, fields, layout):
        super().__init__(fields, layout)
        self.contact, self.touch, self.first = fields["contact"], fields["touch"], layout.constants
        column = {name: layout.constants + n for n, name in enumerate(layout.stored)}
        self.r1, self.r2, self.mass = (column[name] for name in ("r1", "r2", "mass"))
        self.softened, self.gap = "gap" in column, column.get("gap", 0)
        self.curved, self.R = "R" in column, column.get("R", 0)
        self.of_laws = tuple(column[name] for name in layout.model.numbers)

    @ti.func
    def touch_of(self, contact_kind, b, lane):
        return self.touch[b, lane]

    @ti.func
    def of_contact(self, contact_kind: ti.template(), block, lane, kind_numbers):
        r1, r2 = self.contact[block, self.r1, lane], self.contact[block, self.r2, lane]
        inv_r1, inv_sum = 1.0 / r1, 1.0 / (r1 + r2)
        inv_r2, reduced = 1.0 / r2, r1 * r2 * inv_sum
        if ti.static(contact_kind == WALL):
            r2, inv_r2, inv_sum, reduced = 0.0 * r1, 0.0 * r1, 0.0 * r1, r1
            if ti.static(self.curved):  # of planes R = r1, and both stay 0
                reduced = self.contact[block, self.R, lane]
                inv_r2 = 1.0 / reduced - inv_r1
                inv_sum = inv_r1 * inv_r2 * reduced
        touch = r1 + r2
        if ti.static(self.softened):
            touch += self.contact[block, self.gap, lane]
        mass = self.contact[block, self.mass, lane]
        radii = [r1, r2, inv_r1, inv_r2, reduced, touch, inv_sum, mass]  # in the order of RADII
        return self.Numbers(*radii, *[self.contact[block, row, lane] for row in self.of_laws])


def make_write_constants(fields, interfaces, scene, layout):
    """Returns `pair(b, k, g, j)`, `wall(b, k, g, n)`, `sphere(b, k, g, j)`, `empty(b, k)`.

    They write the numbers of lane k of block b, of grains g and j, of grain g and wall n, or the
    sphere (number j), of nothing. interfaces: field of `interface_table` of the scene.
    """
    materials, table, touch = len(scene.all_materials), fields["contact"], fields["touch"]
    radius, mass, material = fields["radius"], fields["mass"], fields["material"]
    write = make_write(fields, interfaces, scene, layout)
    first, columns = layout.constants, len(layout.stored)
    surfaces, curvature = fields.get("surfaces"), layout.curved.motion + CURVATURE

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
    def on_wall(r, n):
        """Reduced radius of a grain on wall n (physics.surfaces.surface_model.reduced_radius)."""
        R = r
        for k in ti.static(range(len(layout.curved))):
            if n == PLANES + k:
                first = 1.0 / r - surfaces[k, curvature]
                second = 1.0 / r - surfaces[k, curvature + 1]
                R = 1.0 / first
                if first != second:
                    R = 1.0 / ti.sqrt(first * second)
        return R

    @ti.func
    def write_wall(b, k, g, n):
        r, m = radius[g], mass[g]
        R = on_wall(r, n)
        radii = {"r1": r, "r2": 0.0 * r, "R": R, "R_pair": reduced_radius(r, r)}
        masses = {"mass": m, "m0": m, "size": r}
        write(b, k, materials * materials + material[g], {**radii, **masses})

    @ti.func
    def write_empty(b, k):
        touch[b, k] = 1.0
        for n in ti.static(range(columns)):
            table[b, first + n, k] = 1.0

    return SimpleNamespace(pair=write_pair, wall=write_wall, sphere=write_sphere, empty=write_empty)


def make_write(fields, interfaces, scene, layout):
    """Returns `write(b, k, row, two)`: the numbers of one contact, computed by the laws.

    row: of the table of interfaces. two: radii and masses of the two by the names that
    ContactConstants has for them.
    """
    table, touch, model = fields["contact"], fields["touch"], layout.model
    columns = own_columns(model, scene.interaction)
    faces = [*FACE, *property_columns(scene.interaction)]
    of_laws = [(law, columns[effect]) for effect, law in model.effects]
    column = {name: layout.constants + n for n, name in enumerate(layout.stored)}
    softened = "gap" in column

    @ti.func
    def contact(row, two: ti.template()):
        """ContactConstants of these two, internal units."""
        face = {name: interfaces[row, n] for name, n in faces}
        a0 = contact_radius(face["gamma"], two["R"], face["E_star"])
        F_jkr = pull_off_force(face["gamma"], two["R"])
        a0_pair = contact_radius(face["gamma"], two["R_pair"], face["E_star"])
        return ti.Struct({**face, **two, "a0": a0, "a0_pair": a0_pair, "F_jkr": F_jkr})

    @ti.func
    def write(index, lane, row, two: ti.template()):
        values = contact(row, two)
        touch[index, lane] = values.r1 + values.r2
        if ti.static(softened):
            gap = first_touch(equilibrium_overlap(values.a0, values.R), values.stiffness_scaling)
            touch[index, lane] += gap
            table[index, column["gap"], lane] = gap
        table[index, column["r1"], lane] = values.r1
        table[index, column["r2"], lane] = values.r2
        table[index, column["mass"], lane] = values.mass
        if ti.static("R" in column):
            table[index, column["R"], lane] = values.R
        for law, keys in ti.static(of_laws):
            # a struct needs a member: the row, for a law without keys
            block = ti.Struct({"row": row, **{name: interfaces[row, n] for name, n in keys}})
            numbers = law.numbers(values, block)
            for name in ti.static(tuple(law.NUMBERS)):
                table[index, column[name], lane] = numbers[name]

    return write
