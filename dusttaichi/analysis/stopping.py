"""First stop of a body that penetrates into dust, of grains or of a continuum (G09)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Stop:
    """The first stop of a body: after `time` [s] in the depth [m].

    rms [m]: of its intrusion from -depth sin(pi t / 2 T) until then (G09 eq 11). normalised: (2, n)
    t / T and h / D until then.
    """

    time: float
    depth: float
    rms: float
    normalised: NDArray[np.float64]


def find_first_stop(
    time: NDArray[np.float64], height: NDArray[np.float64], velocity: NDArray[np.float64]
) -> Stop | None:
    """The Stop of a trajectory, (n,) each: the first v >= 0, interpolated linearly, or None."""
    up = np.flatnonzero(velocity >= 0.0)
    up = up[up > 0]
    if not len(up) or velocity[0] >= 0.0:
        return None
    first_stopped = up[0]
    last_moving = first_stopped - 1
    step = time[first_stopped] - time[last_moving]
    fraction = velocity[last_moving] / (velocity[last_moving] - velocity[first_stopped])
    end = time[last_moving] + fraction * step
    # the velocity is linear in between, so the height is a parabola
    bottom = height[last_moving] + 0.5 * velocity[last_moving] * fraction * step
    depth = -bottom
    inside = np.append(time[:first_stopped], end)
    heights = np.append(height[:first_stopped], bottom)
    normalised = np.stack([inside / end, heights / depth])
    apart = normalised[1] + np.sin(0.5 * np.pi * normalised[0])
    return Stop(end, depth, float(depth * np.sqrt(np.mean(apart**2))), normalised)
