"""Means of ensembles with their scatter, one band for each point of a sweep."""

import numpy as np
from matplotlib import colormaps

from dusttaichi.analysis.ensemble_tables import axes_of, bands
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import S12_STATIC, UNIDIRECTIONAL
from dusttaichi.plots import style
from dusttaichi.plots.compression import laboratory
from dusttaichi.results.variables import COMMON

MOST = 12  # bands in one figure


@style.styled
def ensemble(data):
    """The figure of a dataset of `analysis.gather`: mean, and a band of one standard deviation.

    The compression curve where the filling factor grows under a top wall. Else the stress (its
    normal component of largest mean), the pressure on the top wall or the coordination number,
    whichever there is first, else what the method has recorded first, against the filling factor
    or the time. Of more than 12 points of a sweep, 12 evenly spaced ones are drawn.
    """
    x = data.attrs["coordinate"]
    figure, (axes,) = style.new_figure()
    if x == "filling_factor" and "pressure" in data:
        law = UNIDIRECTIONAL if "projected_area" in data else S12_STATIC
        _compression(axes, bands(data, "pressure", wall="top"), law)
    else:
        _along_coordinate(axes, data, x)
    points = int(np.prod([data.sizes[axis] for axis in axes_of(data)]))
    title = f"{MOST} of {points} points" if points > MOST else None
    style.legend(axes, title=title)
    return figure


def save_ensemble(data, path):
    """Write the figure. Raises DustError where it cannot be written."""
    try:
        ensemble(data).savefig(path)
    except OSError as error:
        raise DustError(f"The figure cannot be written to {path}: {error}.") from error


def _compression(axes, found, law):
    laboratory(axes, np.logspace(1, 7, 301), (law,))
    for band, line_style in _line_styles(found):
        kpa, phi = band.mean / 1e3, band.x
        axes.plot(np.where(kpa > 0, kpa, np.nan), phi, label=_label(band), **line_style)
        low, high = (band.mean - band.std) / 1e3, (band.mean + band.std) / 1e3
        axes.fill_betweenx(  # a band that reaches no pressure at all has no end on this axis
            phi,
            np.where(low > 0, low, np.nan),
            np.where(low > 0, high, np.nan),
            color=line_style["color"],
            alpha=0.25,
            linewidth=0,
        )
    axes.set_xscale("log")
    axes.set_xlim(0.05, 2e3)
    ends = [value for band in found for value in (band.x[0], band.x[-1])]
    axes.set_ylim(max(min(ends, default=0.1) - 0.02, 0), max([0.6, *ends]) + 0.02)
    axes.set_xlabel("pressure on the top wall (kPa)")
    axes.set_ylabel(r"filling factor $\phi$")


def _along_coordinate(axes, data, x):
    found, text, known_units = _subject(data)
    largest = max((np.nanmax(np.abs(band.mean)) for band in found), default=0.0)
    per_y, unit = style.scaled(largest, known_units)
    per_x, x_text = 1.0, r"filling factor $\phi$"
    if x == "time":
        per_x, x_unit = style.scaled(float(data.time[-1]), style.TIMES)
        x_text = f"time ({x_unit})"
    for band, line_style in _line_styles(found):
        axes.plot(band.x * per_x, band.mean * per_y, label=_label(band), **line_style)
        axes.fill_between(
            band.x * per_x,
            (band.mean - band.std) * per_y,
            (band.mean + band.std) * per_y,
            color=line_style["color"],
            alpha=0.25,
            linewidth=0,
        )
    axes.set_xlabel(x_text)
    axes.set_ylabel(f"{text} ({unit})" if unit else text)


PRESSURES = ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))


def _subject(data):
    """(bands, what they show, units of the axis)."""
    if "stress" in data:
        options = {a: bands(data, "stress", xyz=a, axis=a) for a in "xyz"}
        size = {
            a: max((np.nanmax(np.abs(band.mean)) for band in found), default=0.0)
            for a, found in options.items()
        }
        axis = max(size, key=size.get)
        return options[axis], f"stress along {axis}, positive in tension", PRESSURES
    if "pressure" in data:
        return bands(data, "pressure", wall="top"), "pressure on the top wall", PRESSURES
    if "coordination_number" in data:
        return bands(data, "coordination_number"), "coordination number", ((1.0, ""),)
    along = [n for n in data.data_vars if data.attrs["coordinate"] in data[n].dims]
    name = next((n for n in along if n not in COMMON), along[0])
    return bands(data, name), data[name].long_name, ((1.0, data[name].attrs.get("units", "")),)


def _line_styles(found):
    """(band, colour and dashes) of at most MOST bands."""
    if len(found) > MOST:
        found = [found[i] for i in np.linspace(0, len(found) - 1, MOST).round().astype(int)]
    if len(found) <= len(style.RUN_COLOURS):
        return [(band, style.run_style(number)) for number, band in enumerate(found)]
    colours = colormaps["viridis"](np.linspace(0.0, 0.9, len(found)))
    return [(band, {"color": colour}) for band, colour in zip(found, colours, strict=True)]


def _label(band):
    if band.label:
        return band.label
    scatter = " ± standard deviation" if band.replicas > 1 else ""
    runs = "runs" if band.replicas > 1 else "run"
    return f"mean{scatter} of {band.replicas} {runs}"
