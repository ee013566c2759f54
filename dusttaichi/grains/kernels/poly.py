"""Grains of different radius and material: the numbers of each contact, in lanes.

Those of a pair of grains never change, so they are computed once, when a search lists the pair,
from the two radii and from a table of interfaces (`Interface` of physics.constants, one row for
each two materials, in internal units: the formulas hold in any consistent ones). The passes read
them as lanes in the place of the scalars of a scene whose grains are all alike.
"""

from functools import cache
from itertools import product
from math import pi

import numpy as np
import taichi as ti

from dusttaichi import units
from dusttaichi.grains.kernels.params import FIELDS, GEOMETRY
from dusttaichi.grains.kernels.store import STORED
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.constants import CRITICAL_TWISTING

(
    R1,
    R2,
    INV_DELTA0,
    F4,
    K_R,
    K_S,
    K_T,
    XI_CRIT,
    ZETA_CRIT,
    KAPPA,
    MASS,
    CRUSH_FORCE,
    CRUSH_ENERGY,
) = range(len(STORED))
# columns of the table of interfaces; modifiers of the springs and glue are factors of them
GAMMA, E_STAR, ROLLING, SLIDING, TWISTING, NU, XI, DENSITY, GLUE, DAMPING, CRUSH = range(11)

contact_radius = ti.func(constants.equilibrium_contact_radius)
equilibrium_overlap = ti.func(constants.equilibrium_overlap)
pull_off_force = ti.func(constants.pull_off_force)
crush_force = ti.func(constants.crush_force)
rolling_stiffness = ti.func(constants.rolling_stiffness)
sliding_stiffness = ti.func(constants.sliding_stiffness)
twisting_stiffness = ti.func(constants.twisting_stiffness)
critical_sliding = ti.func(constants.critical_sliding)
reduced_radius = ti.func(constants.reduced_radius)
collision_time = ti.func(constants.collision_time)
scaled_damping = ti.func(constants.scaled_damping)
viscoelastic_damping = ti.func(constants.viscoelastic_damping)


def interface_table(materials, interaction, glue=1.0):
    """Rows of the table, internal units: materials i, j at i M + j, then each with the walls.

    materials: the scene's, M of them, the first that of the walls. glue: factor on the normal force
    of the walls.
    """
    kinds = [(a, b, 1.0) for a, b in product(materials, repeat=2)]
    kinds += [(a, materials[0], glue) for a in materials]
    return np.array(
        [_row(constants.interface(a, b, interaction), interaction, g) for a, b, g in kinds]
    )


def _row(face, interaction, glue):
    rolling, sliding, twisting = (
        effect.modifier if effect else 0.0
        for effect in (interaction.rolling, interaction.sliding, interaction.twisting)
    )
    damping = interaction.damping
    number = {
        "none": lambda: 0.0,
        "viscous": lambda: damping.kappa / units.DAMPING,
        "scaled": lambda: damping.coefficient,
        "viscoelastic": lambda: damping.time / units.TIME,
    }[damping.model]()
    row = [0.0] * 11
    row[GAMMA] = face.gamma / units.SURFACE_ENERGY
    row[E_STAR] = face.E_star / units.PRESSURE
    row[ROLLING] = rolling
    row[SLIDING] = sliding * face.G_star / units.PRESSURE
    row[TWISTING] = twisting * face.G / units.PRESSURE
    row[NU] = face.nu
    row[XI] = face.xi_crit / units.LENGTH
    row[DENSITY] = face.density / units.DENSITY
    row[GLUE], row[DAMPING] = glue, number
    if interaction.asperities is not None:
        # yield strength times volume per area has the unit of a surface energy
        crush = interaction.asperities.yield_strength * face.asperity_volume
        row[CRUSH] = crush / units.SURFACE_ENERGY
    return row


@cache
def pair_lanes(width, geometry=ti.f64, law=ti.f64):
    """Struct of the numbers of `width` pairs, by the names that the physics has for them."""
    names = (
        "r1",
        "r2",
        "inv_r1",
        "inv_r2",
        "R",
        "touch",
        "inv_touch",
        "inv_delta0",
        "F4",
        "U4",
        "k_r",
        "k_s",
        "k_t",
        "xi_crit",
        "zeta_crit",
        "phi_crit",
        "kappa",
        "mass",
        "crush_force",
        "crush_energy",
    )
    return _lanes(names, width, geometry, law)


@cache
def wall_lanes(width, geometry=ti.f64, law=ti.f64):
    """The same of wall contacts: the names of ContactParams."""
    return _lanes(FIELDS, width, geometry, law)


def _lanes(names, width, geometry, law):
    own = (*GEOMETRY, "r1", "r2", "inv_r1", "inv_r2", "inv_touch")
    return ti.types.struct(
        **{name: ti.types.vector(width, geometry if name in own else law) for name in names}
    )


def make_lane_params(fields, layout):
    """Returns `of_pairs(b)`, `of_wall(b)`: the numbers of block b of the state."""
    table = fields["constants"]
    types = (layout.width, layout.geometry, layout.law)
    Pairs, Wall = pair_lanes(*types), wall_lanes(*types)

    @ti.func
    def long(a):
        return ti.cast(a, layout.geometry)

    @ti.func
    def law(a):
        return ti.cast(a, layout.law)

    @ti.func
    def of_pairs(b):
        r1, r2, inv_delta0, f4 = table[b, R1], table[b, R2], table[b, INV_DELTA0], table[b, F4]
        touch = r1 + r2
        inv_touch = 1.0 / touch
        return Pairs(
            long(r1),
            long(r2),
            long(1.0 / r1),
            long(1.0 / r2),
            long(r1 * r2 * inv_touch),
            long(touch),
            long(inv_touch),
            law(inv_delta0),
            law(f4),
            law(f4 / inv_delta0),
            law(table[b, K_R]),
            law(table[b, K_S]),
            law(table[b, K_T]),
            long(table[b, XI_CRIT]),
            long(table[b, ZETA_CRIT]),
            long(CRITICAL_TWISTING + 0.0 * r1),
            law(table[b, KAPPA]),
            law(table[b, MASS]),
            law(table[b, CRUSH_FORCE]),
            law(table[b, CRUSH_ENERGY]),
        )

    @ti.func
    def of_wall(b):
        r, inv_delta0, f4 = table[b, R1], table[b, INV_DELTA0], table[b, F4]
        return Wall(
            long(r),
            long(1.0 / r),
            long(r),
            long(r),
            law(inv_delta0),
            law(f4),
            law(f4 / inv_delta0),
            law(table[b, K_R]),
            law(table[b, K_S]),
            law(table[b, K_T]),
            long(table[b, XI_CRIT]),
            long(table[b, ZETA_CRIT]),
            long(CRITICAL_TWISTING + 0.0 * r),
            law(table[b, KAPPA]),
            law(table[b, MASS]),
            law(table[b, CRUSH_FORCE]),
            law(table[b, CRUSH_ENERGY]),
        )

    return of_pairs, of_wall


def make_write_constants(fields, interfaces, materials, model):
    """Returns `write_pair(b, k, g, j)`, `write_wall(b, k, g)`, `write_empty(b, k)`: the numbers of
    lane k of block b, of grains g and j, of grain g and a wall, of nothing.

    interfaces: field of `interface_table`; materials: how many; model: name of the damping.
    """
    table = fields["constants"]
    radius, mass, material = fields["radius"], fields["mass"], fields["material"]

    @ti.func
    def write(b, k, row, r1, r2, R, R_twist, reduced, m0, size):
        """R_twist: reduced radius that twisting counts with; reduced: mass; m0, size: of the equal
        grains that damping is scaled for."""
        gamma, E_star, nu = interfaces[row, GAMMA], interfaces[row, E_STAR], interfaces[row, NU]
        a0 = contact_radius(gamma, R, E_star)
        F_c = pull_off_force(gamma, R)
        a_twist = contact_radius(gamma, R_twist, E_star)
        kappa = ti.cast(0.0, ti.f64)
        if ti.static(model == "viscous"):
            kappa = interfaces[row, DAMPING]
        if ti.static(model == "scaled"):
            t_c = collision_time(size, interfaces[row, DENSITY], gamma, E_star)
            kappa = scaled_damping(interfaces[row, DAMPING], m0, t_c)
        if ti.static(model == "viscoelastic"):
            kappa = viscoelastic_damping(interfaces[row, DAMPING], nu, E_star, a0)
        table[b, R1][k] = r1
        table[b, R2][k] = r2
        table[b, INV_DELTA0][k] = 1.0 / equilibrium_overlap(a0, R)
        table[b, F4][k] = 4.0 * interfaces[row, GLUE] * F_c
        table[b, K_R][k] = interfaces[row, ROLLING] * rolling_stiffness(F_c, R)
        table[b, K_S][k] = sliding_stiffness(a0, interfaces[row, SLIDING])
        table[b, K_T][k] = twisting_stiffness(a_twist, interfaces[row, TWISTING])
        table[b, XI_CRIT][k] = interfaces[row, XI]
        table[b, ZETA_CRIT][k] = critical_sliding(a0, nu)
        table[b, KAPPA][k] = kappa
        table[b, MASS][k] = reduced
        crush = ti.select(interfaces[row, CRUSH] > 0.0, crush_force(F_c, R, E_star), 0.0)
        table[b, CRUSH_FORCE][k] = crush
        table[b, CRUSH_ENERGY][k] = interfaces[row, CRUSH] * pi * a0 * a0

    @ti.func
    def write_pair(b, k, g, j):
        r1, r2, m1, m2 = radius[g], radius[j], mass[g], mass[j]
        R = reduced_radius(r1, r2)
        row = material[g] * materials + material[j]
        reduced = m1 * m2 / (m1 + m2)
        write(b, k, row, r1, r2, R, R, reduced, 2.0 * reduced, 2.0 * R)

    @ti.func
    def write_wall(b, k, g):
        r = radius[g]
        row = materials * materials + material[g]
        write(b, k, row, r, r, r, reduced_radius(r, r), mass[g], mass[g], r)

    @ti.func
    def write_empty(b, k):
        for n in ti.static(range(len(STORED))):
            table[b, n][k] = 1.0

    return write_pair, write_wall, write_empty
