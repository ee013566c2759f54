"""Two colliding bodies: their velocities, and the shares of the angular momentum."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.frame import grain_masses
from dusttaichi.errors import DustError


@dataclass(frozen=True)
class Bodies:
    """Two bodies over time, SI."""

    time: np.ndarray  #: (n,).
    names: tuple  #: (2,).
    mass: np.ndarray  #: (2,).
    position: np.ndarray  #: Centres of mass, (n, 2, 3).
    velocity: np.ndarray  #: Velocities of the centres of mass, (n, 2, 3).
    spin: np.ndarray  #: Angular momenta about the centres of mass, (n, 2, 3).
    orbital: np.ndarray  #: Angular momentum of both centres about the common one, (n, 3).


def bodies(run):
    """Motion and angular momentum of the two bodies of a run.

    Raises
    ------
    DustError
        The time series has no bodies.
    """
    series = run.whole.series
    if "body_angular_momentum" not in series:
        raise DustError(f"{run.path} has no two colliding bodies: sample.kind pair or collision.")
    first, second = run.bodies()
    masses = grain_masses(run)
    mass = np.array([masses[first].sum(), masses[second].sum()])
    x, v = series.body_position.values, series.body_velocity.values
    reduced = mass.prod() / mass.sum()
    orbital = reduced * np.cross(x[:, 0] - x[:, 1], v[:, 0] - v[:, 1])
    return Bodies(
        time=series.time.values,
        names=tuple(str(name) for name in series.body.values),
        mass=mass,
        position=x,
        velocity=v,
        spin=series.body_angular_momentum.values,
        orbital=orbital,
    )
