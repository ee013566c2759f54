"""Collisions of a study: a map of outcomes, growth, the spectrum of fragments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Patch, Rectangle

from dusttaichi.analysis.collisions import (
    FAILED,
    MISS,
    OUTCOMES,
    compute_mean_and_error,
    compute_phase_losses,
    fit_fragment_slope,
    select_fragments,
)
from dusttaichi.analysis.thresholds import find_thresholds
from dusttaichi.plots import style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from dusttaichi.analysis.thresholds import Threshold
    from dusttaichi.plots.canvas import Which

COLOURS = {
    "sticking": style.BLUE,
    "growth": style.SKY,
    "mass transfer": style.GREEN,
    "bouncing": style.YELLOW,
    "erosion": style.ORANGE,
    "fragmentation": style.RED,
    MISS: "#e6e6e6",
    FAILED: style.BLACK,
}
NAMES = {
    "speed": "relative speed (m/s)",
    "impact_parameter": r"impact parameter / $(R_1 + R_2)$",
    "mass_ratio": "mass of target / projectile",
}
MOST_HORIZONTAL = 8  # labels of a horizontal axis that do not overlap


def collision_figures(data: xr.Dataset) -> dict[str, Figure]:
    """All figures of a study of collisions by name, those that have something to show.

    Parameters
    ----------
    data : xarray.Dataset
        From analysis.collisions.collisions_dataset, or analysis.open_collisions.

    Returns
    -------
    dict
        Name -> matplotlib Figure.
    """
    figures_by_name: dict[str, Figure | None] = {"outcomes": outcome_map(data)}
    if data.sizes["mass_ratio"] > 1:
        figures_by_name["outcomes_mass_ratio"] = outcome_map(data, "mass_ratio")
    if data.sizes["body"] > 1:
        figures_by_name["thresholds"] = threshold_speeds(data, find_thresholds(data))
    figures_by_name |= {
        "growth": growth(data),
        "spectrum": fragment_spectrum(data),
        "phases": phases(data),
    }
    return {name: figure for name, figure in figures_by_name.items() if figure is not None}


@style.apply_style
def outcome_map(data: xr.Dataset, against: str = "impact_parameter") -> Figure:
    """Shares of the outcomes over the speed and the impact parameter or the mass ratio.

    A cell for each point is divided by the shares of all collisions there; panels are for the
    bodies.

    Parameters
    ----------
    data : xarray.Dataset
        From analysis.collisions.collisions_dataset.
    against : str
        Dimension of the vertical axis.
    """
    bodies = data.body.values.tolist()
    figure, panels = style.create_grid(len(bodies), 2 if len(bodies) > 1 else 1, 3.4)
    for axes, body in zip(panels, bodies, strict=True):
        outcomes = data.outcome.sel(body=body).transpose("speed", against, ...).values
        outcomes = outcomes.reshape(*outcomes.shape[:2], -1)
        for x, y in np.ndindex(outcomes.shape[:2]):
            _draw_cell(axes, x, y, outcomes[x, y])
        _label_axis(axes, data, "speed", "x")
        _label_axis(axes, data, against, "y")
        if len(bodies) > 1:
            axes.set_title(str(body))
    outcomes_present = [name for name in (*OUTCOMES, FAILED) if (data.outcome.values == name).any()]
    handles = [Patch(facecolor=COLOURS[name], label=name) for name in outcomes_present]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _draw_cell(axes: Axes, x: float, y: float, outcomes: NDArray[np.str_]) -> None:
    """Draw a rectangle of width 1 about (x, y), divided by the shares of its outcomes."""
    left_edge = x - 0.47
    for name in (*OUTCOMES, FAILED):
        width = 0.94 * float(np.mean(outcomes == name))
        if width > 0.0:
            axes.add_patch(Rectangle((left_edge, y - 0.45), width, 0.9, color=COLOURS[name], lw=0))
        left_edge += width


def _label_axis(axes: Axes, data: xr.Dataset, name: str, which: Which) -> None:
    values = data[name].values
    axis = getattr(axes, f"{which}axis")
    axis.set_ticks(np.arange(len(values)), [f"{value:.3g}" for value in values])
    if which == "x" and len(values) > MOST_HORIZONTAL:
        axis.set_tick_params(rotation=90)
    getattr(axes, f"set_{which}lim")(-0.55, len(values) - 0.45)
    getattr(axes, f"set_{which}label")(NAMES[name])
    axes.tick_params(which="both", length=0)


@style.apply_style
def growth(data: xr.Dataset) -> Figure:
    """Growth efficiency against the speed, a line for every body and mass ratio.

    Means and standard errors over seeds and impact parameters in which the bodies touched.
    """
    figure, (axes,) = style.create_figure(height=3.4)
    axes.axhline(0.0, color=style.GREY, linewidth=0.8)
    several = _draw_means(axes, data, data.growth_efficiency, "o-", "")
    style.set_logarithmic(axes, "x")
    axes.set(xlabel=NAMES["speed"], ylabel="growth efficiency")
    if several:
        style.draw_legend(axes)
    return figure


def _draw_means(
    axes: Axes,
    data: xr.Dataset,
    variable: xr.DataArray,
    format_string: str,
    text: str,
) -> bool:
    """Draw means and standard errors against the speed, a line for every body and mass ratio.

    format_string: marker and dashes. text: end of the labels. Returns whether there are several
    lines.
    """
    values = variable.transpose("body", "mass_ratio", "speed", ...).values
    values = values.reshape(*values.shape[:3], -1)
    several = bool(values.shape[:2] != (1, 1))
    for number, index in enumerate(np.ndindex(values.shape[:2])):
        mean, error = np.array([compute_mean_and_error(row) for row in values[index]]).T
        name = f"{data.body.values[index[0]]}, {data.mass_ratio.values[index[1]]:g}:1"
        label = ", ".join([name] * several + [text] * bool(text))
        bar_style: style.Look = {
            "fmt": format_string,
            "ms": 4,
            "capsize": 2,
            "color": style.run_style(number)["color"],
        }
        axes.errorbar(data.speed, mean, np.nan_to_num(error), label=label, **bar_style)
    return several


PHASES = {"compression_loss": "in compression", "stretching_loss": "in stretching, of the rest"}


@style.apply_style
def phases(data: xr.Dataset) -> Figure | None:
    """Shares of the energy dissipated in compression and in stretching against the speed.

    They are those of `compute_phase_losses`: mean and standard error over seeds and impact
    parameters, a colour for every body and mass ratio. None where no collision has them.
    """
    shares_by_phase = {
        name: values
        for name, values in compute_phase_losses(data).items()
        if values.notnull().any()
    }
    if not shares_by_phase:
        return None
    figure, (axes,) = style.create_figure(height=3.4)
    for format_string, (name, values) in zip(("o-", "s--"), shares_by_phase.items(), strict=False):
        _draw_means(axes, data, values, format_string, PHASES[name])
    style.set_logarithmic(axes, "x")
    axes.set(xlabel=NAMES["speed"], ylabel="share of the energy dissipated")
    axes.set_ylim(0.0, 1.05)
    style.draw_legend(axes)
    return figure


@style.apply_style
def fragment_spectrum(data: xr.Dataset) -> Figure:
    """Number of fragments of at least a number of grains, except the two largest, by speed.

    A line for each of at most six speeds has the slope of n(N) ~ N^-tau.
    """
    figure, (axes,) = style.create_figure(height=3.4)
    speeds = data.speed.values
    drawn = 0
    picked = np.unique(np.linspace(0, len(speeds) - 1, min(6, len(speeds))).round().astype(int))
    for number in picked:
        choice = np.zeros(data.outcome.shape, bool)
        choice[:, :, number] = True
        grains, collisions = select_fragments(data, choice)
        if len(grains) < 2:
            continue
        sizes, counts = np.unique(grains, return_counts=True)
        above = np.cumsum(counts[::-1])[::-1] / collisions
        tau, error = fit_fragment_slope(grains, np.nanmax(data.grains.values))
        text = f"{speeds[number]:.3g} m/s"
        text += rf", $\tau$ = {tau:.2f} ± {error:.2f}" if np.isfinite(tau) else ""
        axes.plot(sizes, above, marker="o", ms=3, label=text, **style.run_style(drawn))
        drawn += 1
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="grains of the fragment",
        ylabel="fragments of at least that many grains,\nin a collision",
    )
    _draw_legend_or_text(axes, drawn > 0, "no fragments beside the two largest")
    return figure


@style.apply_style
def threshold_speeds(data: xr.Dataset, speed_thresholds: Sequence[Threshold]) -> Figure:
    """Threshold speeds of bodies and mass ratios against the filling factor of the targets.

    Bars are confidence intervals; thresholds outside the speeds of the study are left out.

    Parameters
    ----------
    data : xarray.Dataset
        From analysis.collisions.collisions_dataset.
    speed_thresholds : list
        The Thresholds of the dataset.
    """
    figure, (axes,) = style.create_figure(height=3.4)
    names = dict.fromkeys(t.name for t in speed_thresholds)
    speed_thresholds = [t for t in speed_thresholds if 0.0 < t.speed < np.inf]
    for number, name in enumerate(names):
        thresholds_of_outcome = [t for t in speed_thresholds if t.name == name]
        if not thresholds_of_outcome:
            continue
        phi, speed = np.array([(t.filling_factor, t.speed) for t in thresholds_of_outcome]).T
        interval = np.array([(t.low, t.high) for t in thresholds_of_outcome]).T
        interval = np.where(np.isnan(interval), speed, interval)
        interval = np.clip(interval, data.speed.values.min(), data.speed.values.max())
        look: style.Look = {"fmt": "o", "ms": 4, "capsize": 2, "color": style.RUN_COLOURS[number]}
        label = rf"$v_{{\rm {name}}}$"
        axes.errorbar(phi, speed, np.abs(interval - speed), label=label, **look)
    style.set_logarithmic(axes, "y")
    axes.set_xlabel(r"filling factor of the target $\phi$")
    axes.set_ylabel("threshold speed (m/s)")
    _draw_legend_or_text(axes, len(speed_thresholds) > 0, "no threshold within the speeds")
    return figure


def _draw_legend_or_text(axes: Axes, drawn: bool, text: str) -> None:
    """Draw a legend of the curves, or that text where there are none."""
    if drawn:
        style.draw_legend(axes)
    else:
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center")
