"""Vertical profiles of the filling factor (S12 Fig 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.results.datasets import add_variables, take_records

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


EDGE = 2.0  #: Grain diameters beside the bottom and the top wall that the inner part leaves out.


def read_profiles(run: Run, max_count: int | None = None) -> xr.Dataset:
    """Profiles of a run as a dataset: filling_factor (profile, bin), height [m] ...

    Variables are those of the file, and `middle` (profile, bin) [m]: the middle of the part of the
    bin below the top wall, NaN above it.

    Parameters
    ----------
    run : Run
    max_count : int, optional
        Largest number of profiles, first and last included, evenly spaced in the filling factor of
        the box.

    Raises
    ------
    DustError
        The result has no profiles.
    """
    if run.profiles is None:
        raise DustError(
            f"{run.path} has no profiles: set output: profiles in the scene (closed boxes only)."
        )
    lower, upper = run.profiles.bin_lower.values, run.profiles.bin_upper.values
    ends = np.minimum(upper, run.profiles.height.values[:, None])
    middle = np.where(ends > lower, 0.5 * (lower + ends), np.nan)
    profiles = add_variables(run.profiles, middle=(("profile", "bin"), middle))
    if max_count is None or profiles.sizes["profile"] <= max_count:
        return profiles
    phi = profiles.box_filling_factor.values
    targets = np.linspace(phi[0], phi[-1], max_count)
    selected = np.unique([int(np.argmin(np.abs(phi - value))) for value in targets])
    return take_records(profiles, "profile", selected)


def join_cut_bins(profiles: xr.Dataset) -> xr.Dataset:
    """Profiles with a bin that the top wall cuts below its half joined to the bin below.

    Too few grains are in such a bin for a filling factor. xr.Dataset with filling_factor and middle
    (profile, bin) [m], not a number in the bins above.
    """
    phi = profiles.filling_factor.transpose("profile", "bin").values.copy()
    middle = profiles.middle.transpose("profile", "bin").values.copy()
    lower, upper = profiles.bin_lower.values, profiles.bin_upper.values
    for number, height in enumerate(profiles.height.values):
        thick = np.clip(np.minimum(upper, height) - lower, 0.0, None)
        (inside,) = np.nonzero(thick > 0.0)
        if len(inside) < 2 or thick[inside[-1]] >= 0.5 * (upper - lower)[inside[-1]]:
            continue
        below, cut = inside[-2:]
        both = np.array([thick[below], thick[cut]])
        phi[number, below] = np.nan_to_num(phi[number, [below, cut]]) @ both / both.sum()
        middle[number, below] = lower[below] + 0.5 * both.sum()
        phi[number, cut] = middle[number, cut] = np.nan
    dims = ("profile", "bin")
    return add_variables(profiles, filling_factor=(dims, phi), middle=(dims, middle))


def average_inner_filling_factor(profiles: xr.Dataset) -> NDArray[np.float64]:
    """Filling factor between EDGE grain diameters above the bottom and below the top, (profiles,).

    profiles: of a Run; a bin is one grain diameter high, and counts with its part in between. Not a
    number where nothing is in between.
    """
    lower, upper = profiles.bin_lower.values[:, None], profiles.bin_upper.values[:, None]
    edge = EDGE * float(upper[0, 0] - lower[0, 0])
    highest = np.minimum(upper, profiles.height.values - edge)
    inside = np.clip(highest - np.maximum(lower, edge), 0.0, None)  # (bin, profile)
    phi = profiles.filling_factor.transpose("profile", "bin").values
    is_number = ~np.isnan(phi)
    total = np.einsum("pb,bp->p", np.where(is_number, phi, 0.0), inside)
    weight = np.einsum("pb,bp->p", is_number, inside)
    mean = np.full(len(weight), np.nan)
    np.divide(total, weight, out=mean, where=weight > 0.0)
    return mean
