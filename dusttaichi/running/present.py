"""Presentation of the state of a Simulation: labelled numbers, read-only arrays, a line of text."""

from types import SimpleNamespace

import numpy as np

from dusttaichi.domain.clock import NEVER
from dusttaichi.results.variables import LABELS
from dusttaichi.scene import quantities


class PresentValues(SimpleNamespace):
    """Values of the time series by name; `units` has their units by the same names."""

    def __repr__(self):
        values = {name: value for name, value in vars(self).items() if name != "units"}
        width = max(map(len, values), default=0)
        lines = (f"{name:<{width}}  {_text(v, self.units[name])}" for name, v in values.items())
        return "\n".join(lines)


def _text(value, unit):
    """Numbers with the names of their entries, and their unit."""
    unit = "" if unit == "1" else f" {unit}"
    if not np.ndim(value):
        return f"{value:.6g}{unit}"
    rows = [_numbers(row) for row in value.values]
    if value.dims[0] in value.coords:
        names = value[value.dims[0]].values
        rows = [f"{name} {row}" for name, row in zip(names, rows, strict=True)]
    return ", ".join(rows) + unit


def _numbers(row):
    return f"{row:.6g}" if not np.ndim(row) else f"({', '.join(map(_numbers, row))})"


def label_values(sim, record):
    """A record of the time series as PresentValues: arrays as read-only xarray.DataArray.

    Their dimensions and coordinates (walls, axes, channels) are those in result.nc.
    """
    import xarray as xr  # takes a second, which runs without `measure` do not wait for

    entries = LABELS | sim.sizes()
    variables = {v.name: v for v in sim.variables if v.group == "series"}
    values = {}
    for name, value in record.items():
        dims = variables[name].dims[1:]
        if not dims:
            values[name] = value
            continue
        about = {"units": variables[name].units, "long_name": variables[name].long_name}
        coords = {dim: list(entries[dim]) for dim in dims if not isinstance(entries[dim], int)}
        values[name] = xr.DataArray(read_only(value), coords, dims, name, about)
    return PresentValues(**values, units={name: variables[name].units for name in record})


def read_only(array):
    """A view of an array that refuses to be written into: it is a copy of the state."""
    view = np.asarray(array).view()
    view.flags.writeable = False
    return view


def line_of(simulation, run):
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
