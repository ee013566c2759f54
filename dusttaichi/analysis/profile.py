"""Vertical profiles of the filling factor (S12 Fig 5)."""

import numpy as np

from dusttaichi.errors import DustError


def profile(run, most=None):
    """The profiles of a Run: xr.Dataset with filling_factor (profile, bin), height [m] ...

    As in the file, and `middle` (profile, bin) [m]: the middle of the part of the bin below the
    top wall, not a number above it.

    most: at most so many of them, first and last included, evenly spaced in the filling factor of
    the box. Raises DustError where the run wrote none.
    """
    if run.profiles is None:
        raise DustError(
            f"{run.path} holds no profiles: set output: profiles in the scene (closed boxes only)."
        )
    ends = run.profiles.bin_upper.clip(max=run.profiles.height)
    middle = (0.5 * (run.profiles.bin_lower + ends)).where(ends > run.profiles.bin_lower)
    profiles = run.profiles.assign(middle=middle.transpose("profile", "bin"))
    if most is None or profiles.sizes["profile"] <= most:
        return profiles
    phi = profiles.box_filling_factor.values
    wanted = np.linspace(phi[0], phi[-1], most)
    chosen = np.unique([int(np.argmin(np.abs(phi - value))) for value in wanted])
    return profiles.isel(profile=chosen)
