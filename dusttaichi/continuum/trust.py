"""The guards of the continuum: numbers that are none, dust denser than its laws go."""

import numpy as np

from dusttaichi.errors import GuardStop
from dusttaichi.method import moment

BEYOND = 1.1
"""Density over that of phi_2 from which an elastic strain is more than its linear law is for."""


def check(sim, measurement):
    """Raise GuardStop if the Measurement of a Simulation cannot be trusted."""
    m = measurement.parts
    when = moment(sim)
    if not np.isfinite(measurement.energy) or not np.isfinite(m["loss"]).all():
        raise GuardStop(
            f"{when} the energy is not a number: the step is too long for what happens. Try a "
            "smaller numerics.cfl, a larger numerics.viscosity.grid or a lower speed."
        )
    phi, kept = m["density"] / sim.material.rho_s, m["compacted"] / sim.material.rho_s
    most = sim.material.phi_2
    if phi > BEYOND * most or kept > most:
        raise GuardStop(
            f"{when} dust has the filling factor {phi:.4g}, and {kept:.4g} when its pressure is "
            f"gone; the model ends at {BEYOND * most:.4g}, and at {most:g} when it is gone "
            "(material.compressive.phi_2), where its compressive strength has no bound. Try a "
            "lower speed, an earlier stop, or a smaller numerics.cfl."
        )
