"""Numbers of a contact as a kernel argument: a change of number does not recompile a kernel."""

from functools import cache

import taichi as ti

from dusttaichi import units

FIELDS = (
    "r",
    "inv_r",
    "R",
    "touch",
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

GEOMETRY = ("r", "inv_r", "R", "touch", "xi_crit", "zeta_crit", "phi_crit")
"""Of these, what overlaps and displacements are formed with."""


@cache
def params_type(geometry=ti.f64, law=ti.f64):
    """The struct ContactParams with these float types."""
    return ti.types.struct(**{name: geometry if name in GEOMETRY else law for name in FIELDS})


def contact_params(constants, walls=False, geometry=ti.f64, law=ti.f64):
    """ContactParams in internal units (um, us, pg) from SI ContactConstants.

    `touch` is the distance of centres (of centre and wall) at first touch.
    """
    length, force = units.LENGTH, units.FORCE
    stiffness = force / length
    r = constants.r / length
    return params_type(geometry, law)(
        r=r,
        inv_r=1.0 / r,
        R=constants.R / length,
        touch=r if walls else 2.0 * r,
        inv_delta0=length / constants.delta0,
        F4=4.0 * constants.F_c / force,
        U4=4.0 * constants.F_c * constants.delta0 / units.ENERGY,
        k_r=constants.k_r / stiffness,
        k_s=constants.k_s / stiffness,
        k_t=constants.k_t / (force * length),
        xi_crit=constants.xi_crit / length,
        zeta_crit=constants.zeta_crit / length,
        phi_crit=constants.phi_crit,
        kappa=constants.kappa / units.DAMPING,
        mass=constants.mass / units.MASS,
        crush_force=constants.crush_force * units.ENERGY**0.6,
        crush_energy=constants.crush_energy / units.ENERGY,
    )
