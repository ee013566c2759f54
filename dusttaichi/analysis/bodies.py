"""Two colliding bodies: their velocities, and the shares of the angular momentum."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.frame import grain_masses
from dusttaichi.errors import DustError


@dataclass(frozen=True)
class Bodies:
    """Two bodies over time, SI.

    time (n,). position, velocity of the centres of mass, and spin, the angular momentum about them:
    (n, 2, 3) each. orbital (n, 3): angular momentum of both centres about the common one. names,
    mass: (2,).
    """

    time: np.ndarray
    names: tuple
    mass: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    orbital: np.ndarray


def bodies(run):
    """The Bodies of a Run. Raises DustError where its series has none."""
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
