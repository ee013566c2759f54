"""Two grains, in contact or flying at each other.

Grain 1 is on the side of +x and flies along -x, grain 0 along +x, each with half of the speed, or,
where their masses differ, with the part that leaves the centre of mass at rest: it is the origin.
The line of centres is in the plane of x and y; the impact parameter b is along y, b = d sin(angle)
with the distance d of the centres at the start and the angle between the line of centres and the x
axis.
"""

from __future__ import annotations

import math

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.samples.explicit import check_apart
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.stock import Stock


def make(spec, radius: float, equilibrium_distance: float, stock: Stock | None = None) -> Sample:
    """The two grains that spec asks for.

    spec: distance or gap (neither: equilibrium contact), speed, impact_parameter or angle,
    spins, radii, materials, as the scene's PairSample has them. radius, equilibrium_distance [m]:
    of grains of the scene's material. stock: where radii and materials come from.
    Raises DustError for grains that overlap too much, or an impact parameter beyond the distance.
    """
    own, share, radii = {}, 0.5, np.full(2, radius)
    if getattr(spec, "radii", None) is not None or getattr(spec, "materials", None) is not None:
        numbers = stock.numbers(spec.materials, 2, "sample.materials")
        radii = stock.radii(spec.radii, numbers, "sample.radii")
        own = stock.unlike(radii, numbers)
    if own.get("radii") is not None:
        equilibrium_distance = stock.equilibrium_distance(radii, numbers)
        m1, m2 = stock.masses(Sample(*np.zeros((3, 2, 3)), **own))
        share = float(m2 / (m1 + m2))
    touch = float(radii.sum())
    distance = equilibrium_distance
    if spec.distance is not None:
        distance = spec.distance
    elif spec.gap is not None:
        distance = touch + spec.gap
    if distance < touch:
        where = "sample.gap" if spec.distance is None else "sample.distance"
        here = np.outer([0.0, max(distance, 0.0)], [1.0, 0.0, 0.0])
        check_apart(here, radii if own.get("radii") is not None else radius, where)
    if spec.angle is not None:
        impact = distance * math.sin(spec.angle)
        along = distance * math.cos(spec.angle)
    else:
        impact = spec.impact_parameter.metres(touch)
        if impact > distance:
            raise DustError(
                f"sample.impact_parameter: {impact * 1e6:g} um is more than the distance of the "
                f"centres, {distance * 1e6:g} um; allowed: at most that. Set a larger gap."
            )
        along = math.sqrt(distance**2 - impact**2)
    line = np.array([along, impact, 0.0])
    positions = np.array([-share * line, (1 - share) * line])
    velocities = np.zeros((2, 3))
    velocities[:, 0] = share * spec.speed, -(1 - share) * spec.speed
    spins = np.zeros((2, 3)) if spec.spins is None else np.array(spec.spins, dtype=np.float64)
    sample = Sample(positions, velocities, spins, **own)
    sample.info.update(
        kind="pair",
        grains=2,
        distance=float(distance),
        gap=float(distance - touch),
        speed=float(spec.speed),
        impact_parameter=float(impact),
        equilibrium_distance=float(equilibrium_distance),
    )
    return sample
