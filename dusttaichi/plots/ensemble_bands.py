"""Means of ensembles with their scatter, a band for each point of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.analysis.ensemble_stages import CURVE, CURVE_AXIS
from dusttaichi.analysis.ensemble_tables import axes_of, bands
from dusttaichi.physics.laws import S12_STATIC, UNIDIRECTIONAL, CompressionLaw
from dusttaichi.plots import style
from dusttaichi.plots.compression_curves import draw_laboratory_laws
from dusttaichi.results.variables import COMMON

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dusttaichi.analysis.ensemble_tables import Band
    from dusttaichi.physics.geometry import Floats
    from dusttaichi.plots.style import Look

MOST = 12  # bands in one figure
FAINT = "#C4C8CE"


@style.apply_style
def ensemble(data: xr.Dataset) -> Figure:
    """The figure of a dataset of `analysis.gather`: mean, and a band of one standard deviation.

    The compression curve where the filling factor grows under a top wall; of runs with stages that
    of all stages that compress, as `compression` draws it. Else the first available
    of stress (normal component of largest mean), pressure on the top wall, height of a body,
    coordination number and the first variable of the method, against the filling factor or the
    time. Of more than 12 points of a sweep, 12 evenly spaced ones are drawn.
    """
    curves = _collect_curves(data)
    figure, (axes,) = style.create_figure()
    _set_frame(axes, curves)
    drawn_bands = _thin_bands(curves.bands)
    for band, look in zip(drawn_bands, style.run_styles(len(drawn_bands)), strict=True):
        _draw_band(axes, curves, band, look, _label_band(band))
    points = int(np.prod([data.sizes[axis] for axis in axes_of(data)]))
    style.draw_legend(axes, title=f"{MOST} of {points} points" if points > MOST else None)
    return figure


@style.apply_style
def points(data: xr.Dataset) -> Figure | None:
    """The curves of `ensemble`, each in a panel with the others faint in the background.

    Curves are the points of a sweep or the replicas of an ensemble, at most 12, evenly spaced. None
    for a single curve.
    """
    curves = _collect_curves(data, apart=not axes_of(data))
    drawn_bands = _thin_bands(curves.bands)
    if len(drawn_bands) < 2:
        return None
    figure, panels = style.create_grid(len(drawn_bands), 3, 1.7, shared=True)
    for panel, band in zip(panels, drawn_bands, strict=True):
        _set_frame(panel, curves, labels=False)
        for background in drawn_bands:
            if background is not band:
                look: Look = {"color": FAINT, "linewidth": 0.7, "zorder": 1.5}
                panel.plot(*_scale_line(curves, background), label="_", **look)
        _draw_band(panel, curves, band, {"color": style.BLUE, "linewidth": 1.4}, "_")
        panel.set_title(
            style.typeset(band.label).replace(", ", "\n"), fontsize="small", loc="left", pad=3
        )
        panel.tick_params(labelsize="small")
    figure.supxlabel(curves.x_text, fontsize="medium")
    figure.supylabel(curves.y_text, fontsize="medium")
    return figure


@dataclass(frozen=True)
class _Curves:
    """Bands with the labels of their axes, and the factors from SI to their units.

    law: that of the laboratory for compression curves, whose common coordinate, the filling factor,
    is the vertical axis; else None.
    """

    bands: list[Band]
    x_text: str
    y_text: str
    per_x: float = 1.0
    per_y: float = 1.0
    law: CompressionLaw | None = None


def _collect_curves(data: xr.Dataset, apart: bool = False) -> _Curves:
    """The _Curves of a dataset. apart: a band for each replica instead of one for all."""
    x = data.attrs["coordinate"]
    phi = r"filling factor $\phi$"
    law = UNIDIRECTIONAL if "projected_area" in data else S12_STATIC
    if CURVE in data:
        curve_bands = _compute_bands(data, apart, CURVE, along=CURVE_AXIS)
        return _Curves(curve_bands, "pressure on the top wall (kPa)", phi, 1e-3, 1.0, law)
    if x == "filling_factor" and "pressure" in data:
        curve_bands = _compute_bands(data, apart, "pressure", wall="top")
        return _Curves(curve_bands, "pressure on the top wall (kPa)", phi, 1e-3, 1.0, law)
    curve_bands, text, known_units = _choose_variable(data, apart)
    largest = max((np.nanmax(np.abs(band.mean)) for band in curve_bands), default=0.0)
    per_y, unit = style.choose_unit(largest, known_units)
    text = f"{text} ({unit})" if unit else text
    if x != "time":
        return _Curves(curve_bands, phi, text, 1.0, per_y)
    per_x, x_unit = style.choose_unit(float(data.time[-1]), style.TIMES)
    return _Curves(curve_bands, f"time ({x_unit})", text, per_x, per_y)


Units = Sequence[tuple[float, str]]  # sizes of units with their names, the largest first
PRESSURES: Units = ((1e9, "GPa"), *style.PRESSURES)


def _choose_variable(data: xr.Dataset, apart: bool) -> tuple[list[Band], str, Units]:
    """Choose the first variable that is not 0: (its bands, label, units of the axis)."""
    for name, text, units, options in (
        ("stress", "stress along {axis}, positive in tension", PRESSURES, _list_components(data)),
        ("pressure", "pressure on the top wall", PRESSURES, [{"wall": "top"}]),
        ("sphere_position", "height of the sphere", style.LENGTHS, [{"xyz": "z"}]),
        ("body_position", "height of the {rigid}", style.LENGTHS, _list_moving_bodies(data)),
        ("coordination_number", "coordination number", ((1.0, ""),), [{}]),
        ("kinetic", "kinetic energy", style.ENERGIES, [{}]),
    ):
        sizes = [
            _largest_mean(data[name].sel(selection))
            for selection in (options if name in data else [])
        ]
        if max(sizes, default=0.0) > 0.0:
            largest_selection = options[int(np.argmax(sizes))]
            return (
                _compute_bands(data, apart, name, **largest_selection),
                text.format(**largest_selection),
                units,
            )
    along = [str(n) for n in data.data_vars if data.attrs["coordinate"] in data[n].dims]
    name = next((n for n in along if n not in COMMON), along[0])
    unit = data[name].attrs.get("units", "").removeprefix("1")
    return _compute_bands(data, apart, name), data[name].long_name, ((1.0, unit),)


def _largest_mean(values: xr.DataArray) -> float:
    """Largest size of the mean over the runs."""
    return float(abs(values.mean("replica")).max(skipna=True))


def _list_components(data: xr.Dataset) -> list[dict[str, Any]]:
    return [{"xyz": a, "axis": a} for a in "xyz"] if "axis" in data else []


def _list_moving_bodies(data: xr.Dataset) -> list[dict[str, Any]]:
    """Selections of the rigid bodies that move."""
    if "rigid" not in data.dims or "body_position" not in data:
        return []
    x = data.attrs["coordinate"]
    height = data.body_position.sel(xyz="z")
    path = (height.max(x) - height.min(x)).max([d for d in height.dims if d not in ("rigid", x)])
    moving = data.rigid.values[path.values > 0]
    return [{"rigid": str(name), "xyz": "z"} for name in moving]


def _compute_bands(data: xr.Dataset, apart: bool, name: str, **selected: Any) -> list[Band]:
    if not apart:
        return bands(data, name, **selected)
    bands_by_replica = [
        bands(data.isel(replica=[n]), name, **selected) for n in range(data.sizes["replica"])
    ]
    return [
        band.with_label(f"replica {n}")
        for n, replica_bands in enumerate(bands_by_replica)
        for band in replica_bands
    ]


def _set_frame(axes: Axes, curves: _Curves, labels: bool = True) -> None:
    """Set scales, limits and labels of the axes, and draw the law of the laboratory."""
    if curves.law is not None:
        draw_laboratory_laws(axes, np.logspace(1, 7, 301), (curves.law,))
        for artist in () if labels else (*axes.lines, *axes.collections):
            artist.set_label("_")
        axes.set(xscale="log", xlim=(0.05, 2e3))
        ends = [value for band in curves.bands for value in (band.x[0], band.x[-1])]
        axes.set_ylim(max(min(ends, default=0.1) - 0.02, 0), max([0.6, *ends]) + 0.02)
    if labels:
        axes.set(xlabel=curves.x_text, ylabel=curves.y_text)


def _scale_line(curves: _Curves, band: Band) -> tuple[Floats, Floats]:
    """(x, y) of the mean of a Band in the units of the axes."""
    if curves.law is None:
        return band.x * curves.per_x, band.mean * curves.per_y
    kpa = band.mean * curves.per_x
    return np.where(kpa > 0, kpa, np.nan), band.x


def _draw_band(axes: Axes, curves: _Curves, band: Band, look: Look, label: str) -> None:
    """Draw the mean of a Band, and its scatter."""
    axes.plot(*_scale_line(curves, band), label=label, **look)
    faint: Look = {"color": look["color"], "alpha": 0.25, "linewidth": 0}
    low, high = band.mean - band.std, band.mean + band.std
    if curves.law is None:
        x, low, high = band.x * curves.per_x, low * curves.per_y, high * curves.per_y
        axes.fill_between(x, low, high, **faint)
        return
    # a logarithmic axis has no place for a pressure of 0
    left, right = (np.where(low > 0, end * curves.per_x, np.nan) for end in (low, high))
    axes.fill_betweenx(band.x, left, right, **faint)


def _thin_bands(all_bands: Sequence[Band]) -> list[Band]:
    """At most MOST of the bands, evenly."""
    if len(all_bands) <= MOST:
        return list(all_bands)
    return [all_bands[i] for i in np.linspace(0, len(all_bands) - 1, MOST).round().astype(int)]


def _label_band(band: Band) -> str:
    if band.label:
        return style.typeset(band.label)
    scatter = " ± standard deviation" if band.replicas > 1 else ""
    runs = "runs" if band.replicas > 1 else "run"
    return f"mean{scatter} of {band.replicas} {runs}"
