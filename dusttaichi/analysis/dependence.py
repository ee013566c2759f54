"""Numbers of the runs of a sweep against one of its keys, for figures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dusttaichi.analysis.ensemble import add_statistics
from dusttaichi.analysis.ensemble_tables import axes_of, format_points, key_of, list_varied_keys
from dusttaichi.analysis.texts import choose_unit

if TYPE_CHECKING:
    from dusttaichi.physics.geometry import Floats


@dataclass(frozen=True)
class Against:
    """A number of the runs against a swept key, in the units `unit` and `x_unit`.

    x: (values,), 0, 1, ... of texts, which are the `ticks`. lines: names of the points of the other
    keys. mean, std: (lines, values) over the replicas, or NaN. runs: (lines, values, replicas).
    """

    name: str
    unit: str
    key: str
    x_unit: str
    x: NDArray[Any]
    ticks: list[str] | None
    lines: list[str]
    mean: Floats
    std: Floats
    runs: Floats

    @property
    def varies(self) -> bool:
        """True where the number differs between runs."""
        finite = self.runs[np.isfinite(self.runs)]
        # by more than the last of the four digits that tables show
        return len(finite) > 1 and np.ptp(finite) > 1e-4 * np.max(np.abs(finite))


def against(data: xr.Dataset, name: str) -> Against:
    """A number of a dataset of `gather` as an Against.

    Over the swept key with most values, preferably numbers; over the replicas where no key has
    several values.
    """
    axes, values = axes_of(data), data[name]
    largest = float(np.nanmax(np.abs(values)))
    power, unit = choose_unit(largest, values.attrs.get("units"))
    if power == 0 and largest > 0 and not 1e-2 <= largest < 1e4:  # no unit fits
        power = 3 * math.floor(math.log10(largest) / 3)
        unit = rf"$10^{{{power}}}$ {unit}".strip()
    values = values * 10.0**-power
    name = name.removeprefix("final_")
    if not list_varied_keys(data, axes):
        runs, numbers = values.values.reshape(1, -1, 1), np.arange(values.sizes["replica"])
        no_std, ticks = np.full(runs.shape[:2], np.nan), [*map(str, numbers)]
        alone = name, unit, "replica", ""
        return Against(*alone, numbers, ticks, [""], runs[..., 0], no_std, runs)
    key = max(axes, key=lambda axis: (data[axis].dtype.kind in "fi", data.sizes[axis]))
    further_axes = [axis for axis in axes if axis != key]
    runs = values.transpose(*further_axes, key, "replica").values
    runs = runs.reshape(-1, *runs.shape[-2:])
    spread = xr.Dataset({"y": (("line", key, "replica"), runs)})
    add_statistics(spread, "y")
    lines = format_points(data, list_varied_keys(data, further_axes))
    mean, std = spread.mean_y.values, spread.std_y.values
    x, x_unit, ticks_of_key = _place(data, key)
    names = name, unit, key_of(data, key), x_unit
    return Against(*names, x, ticks_of_key, lines, mean, std, runs)


def _place(data: xr.Dataset, key: str) -> tuple[NDArray[Any], str, list[str] | None]:
    """(x, unit, ticks) of the values of a swept key; ticks None where they are numbers."""
    values = data[key].values
    # of two seeds none is the larger
    if values.dtype.kind not in "fi" or key_of(data, key).endswith("seed"):
        return np.arange(len(values)), "", [str(value) for value in values]
    power, unit = choose_unit(float(np.max(np.abs(values))), data[key].attrs.get("units"))
    return values * 10.0**-power, unit, None
