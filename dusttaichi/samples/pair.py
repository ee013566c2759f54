"""Two grains, in contact or flying at each other.

Grain 1 is on the side of +x and flies along -x, grain 0 along +x, each with half of the speed:
the centre of mass rests at the origin. The line of centres is in the plane of x and y; the impact
parameter b is along y, b = d sin(angle) with the distance d of the centres at the start and the
angle between the line of centres and the x axis.
"""

from __future__ import annotations

import math

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.samples.explicit import check_apart
from dusttaichi.samples.sample import Sample


def make(spec, radius: float, equilibrium_distance: float) -> Sample:
    """The two grains that spec asks for.

    spec: distance or gap (neither: equilibrium contact), speed, impact_parameter or angle,
    spins, as the scene's PairSample has them. radius, equilibrium_distance [m].
    Raises DustError for grains that overlap too much, or an impact parameter beyond the distance.
    """
    distance = equilibrium_distance
    if spec.distance is not None:
        distance = spec.distance
    elif spec.gap is not None:
        distance = 2 * radius + spec.gap
    if distance < 2 * radius:
        where = "sample.gap" if spec.distance is None else "sample.distance"
        check_apart(np.outer([0.0, max(distance, 0.0)], [1.0, 0.0, 0.0]), radius, where)
    if spec.angle is not None:
        impact = distance * math.sin(spec.angle)
        along = distance * math.cos(spec.angle)
    else:
        impact = spec.impact_parameter.metres(2 * radius)
        if impact > distance:
            raise DustError(
                f"sample.impact_parameter: {impact * 1e6:g} um is more than the distance of the "
                f"centres, {distance * 1e6:g} um; allowed: at most that. Set a larger gap."
            )
        along = math.sqrt(distance**2 - impact**2)
    half = np.array([along, impact, 0.0]) / 2
    positions = np.array([-half, half])
    velocities = np.array([[spec.speed / 2, 0.0, 0.0], [-spec.speed / 2, 0.0, 0.0]])
    spins = np.zeros((2, 3)) if spec.spins is None else np.array(spec.spins, dtype=np.float64)
    sample = Sample(positions, velocities, spins)
    sample.info.update(
        kind="pair",
        grains=2,
        distance=float(distance),
        gap=float(distance - 2 * radius),
        speed=float(spec.speed),
        impact_parameter=float(impact),
        equilibrium_distance=float(equilibrium_distance),
    )
    return sample
