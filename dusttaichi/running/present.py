"""Presentation of the state of a Simulation: labelled numbers, read-only arrays, a line of text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.domain.clock import NEVER
from dusttaichi.results.variables import LABELS
from dusttaichi.scene import quantities

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.method import Engine
    from dusttaichi.running.run_protocol import Run


class PresentValues(Mapping[str, "float | xr.DataArray"]):
    """Values of the time series by name [SI], as attributes and as items: a read-only mapping.

    Single ones are numbers, others read-only xarray.DataArray with units and coordinates. Those
    that are declared here are of every method, or of any that presses dust; a method has more.

    Attributes
    ----------
    units
        Name -> SI unit.
    """

    units: dict[str, str]
    time: float
    step: int
    energy_residual: float
    energy_residual_relative: float
    wall_clock: float
    # where the scene has them
    stage: int
    height: float
    filling_factor: float
    box_length: xr.DataArray
    pressure: xr.DataArray
    wall_force: xr.DataArray
    stress: xr.DataArray

    def __init__(self, values: Mapping[str, Any], units: Mapping[str, str]) -> None:
        vars(self).update(values, units=dict(units))

    def __getitem__(self, name: str) -> Any:
        if name not in self.units:
            raise KeyError(name)
        return vars(self)[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.units)

    def __len__(self) -> int:
        return len(self.units)

    def __getattr__(self, name: str) -> Any:
        names = ", ".join(vars(self).get("units", ()))
        raise AttributeError(f"the time series of this scene has no {name}; it has {names}")

    def __repr__(self) -> str:
        width = max(map(len, self), default=0)
        lines = (f"{name:<{width}}  {_text(v, self.units[name])}" for name, v in self.items())
        return "\n".join(lines)


def _text(value: Any, unit: str) -> str:
    """Numbers with the names of their entries, and their unit."""
    unit = "" if unit == "1" else f" {unit}"
    if not np.ndim(value):
        return f"{value:.6g}{unit}"
    rows = [_numbers(row) for row in value.values]
    if value.dims[0] in value.coords:
        names = value[value.dims[0]].values
        rows = [f"{name} {row}" for name, row in zip(names, rows, strict=True)]
    return ", ".join(rows) + unit


def _numbers(row: Any) -> str:
    return f"{row:.6g}" if not np.ndim(row) else f"({', '.join(map(_numbers, row))})"


def label_values(sim: Engine, record: Mapping[str, Any]) -> PresentValues:
    """A record of the time series as PresentValues: arrays as read-only xarray.DataArray.

    Their dimensions and coordinates (walls, axes, channels) are those in result.nc.
    """
    import xarray as xr  # takes a second, which runs without `measure` do not wait for

    entries = LABELS | sim.sizes()
    variables = {v.name: v for v in sim.variables if v.group == "series"}
    values: dict[str, Any] = {}
    for name, value in record.items():
        dims = variables[name].dims[1:]
        if not dims:
            values[name] = value
            continue
        about = {"units": variables[name].units, "long_name": variables[name].long_name}
        coords = {d: list(n) for d in dims if not isinstance(n := entries[d], int)}
        values[name] = xr.DataArray(read_only(value), coords, dims, name, about)
    return PresentValues(values, {name: variables[name].units for name in record})


def read_only(array: Any) -> NDArray[Any]:
    """A view of an array that refuses to be written into: it is a copy of the state."""
    view = np.asarray(array).view()
    view.flags.writeable = False
    return view


def line_of(simulation: Any, run: Run) -> str:
    """A line about a Simulation with its Run: scene, size, step, time, folder."""
    sim, end = run.sim, run.end.step
    words = "grains" if "grains" in sim.attributes() else "particles"
    steps = f"step {sim.step:,}" + (f" of {end:,}" if end < NEVER else "")
    stage = [f"stage {run.plan.name}"] if run.plan.name else []
    time = quantities.format(simulation.time, "time", digits=4)
    words_of_line = [f"{sim.size:,} {words}", *stage, steps, f"t = {time}"]
    if run.clock.bounded:
        words_of_line.append(f"φ = {run.clock.filling_factor_at(sim.step):.4g}")
    return (
        f"<Simulation {simulation.scene.name}: {', '.join(words_of_line)}; {simulation.directory}>"
    )
