"""The guards of the continuum: numbers that are none, dust denser than its laws go."""

import numpy as np

from dusttaichi.errors import GuardStop
from dusttaichi.method import moment


def check(sim, measurement):
    """Raise GuardStop if the Measurement of a Simulation cannot be trusted."""
    m = measurement.parts
    when = moment(sim)
    if not np.isfinite(measurement.energy) or not np.isfinite(m["loss"]).all():
        raise GuardStop(
            f"{when} the energy is not a number: the step is too long for what happens. Try a "
            "smaller numerics.cfl, a larger numerics.viscosity.grid or a lower speed."
        )
    phi = m["compacted"] / sim.material.rho_s
    most = sim.material.phi_2
    if phi > most:
        raise GuardStop(
            f"{when} dust is compacted to the filling factor {phi:.4g}, more than {most:g}, at "
            "which its compressive strength has no bound (material.compressive.phi_2): the model "
            "ends there. Try a lower speed, an earlier stop, or a smaller numerics.cfl."
        )
