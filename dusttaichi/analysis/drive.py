"""Speed of the top wall of a run, from its series."""

import numpy as np

SLOWEST = 1.0  #: Wall speed [m/s] from which S12 (section 5.2.2) calls a compression dynamic.
STEADY = 0.01  #: Share by which the speed of a steady wall may vary.


def wall_speed(run):
    """Downward speed [m/s] of the top wall; nan where it changes or is unknown."""
    if "height" not in run.series or run.series.sizes["time"] < 3:
        return np.nan
    height, time = run.series.height.values, run.series.time.values
    if not np.all(np.isfinite(height)) or time[-1] <= time[0]:
        return np.nan
    speed = (height[0] - height[-1]) / (time[-1] - time[0])
    straight = height[0] - speed * (time - time[0])
    travelled = abs(height[0] - height[-1])
    return float(speed) if np.all(np.abs(height - straight) <= STEADY * travelled) else np.nan


def is_dynamic(run):
    """True for a cake in a closed box pressed at a constant speed of SLOWEST or more."""
    return run.compresses and run.boundary == "box" and wall_speed(run) > (1.0 - STEADY) * SLOWEST
