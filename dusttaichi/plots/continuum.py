"""Figures of the continuum beside the laboratory (Güttler et al. 2009): profile, way, volume."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dusttaichi.analysis.continuum import (
    axis_profile,
    cumulated_volume,
    histogram,
    intrusion,
    laboratory,
    read_particles,
)
from dusttaichi.plots import style
from dusttaichi.plots.dust import COLOURS, EVERYDAY, extent_of, limits_of, paint

SINE = "laboratory: sine (G09 eq 11)"


def _profile(axes, runs, labels):
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        found = axis_profile(run)
        seen = np.isfinite(found.filling_factor)
        line = style.run_style(number)
        axes.plot(
            found.filling_factor[seen], found.depth[seen] * 1e3, label=label, marker=".", **line
        )
        axes.axhline(found.bead * 1e3, color=line["color"], linewidth=0.6, linestyle=(0, (1, 2)))
    axes.axvline(
        laboratory.MOST_FREQUENT,
        color=style.BLACK,
        linewidth=1.0,
        linestyle=(0, (4, 2)),
        label="most frequent below\nthe bead (G09 Fig 11)",
    )
    axes.set_xlabel(r"filling factor $\phi$ below the bead")
    axes.set_ylabel("depth below the surface (mm)")
    axes.invert_yaxis()
    style.legend(axes)


@style.styled
def bead_profile(runs, labels=None):
    """Filling factor along the axis below a bead of one Run or several, as G09 Fig 12.

    Dotted: the lowest point of the bead. Raises DustError where a run has no rigid projectile.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure(height=4.0)
    _profile(axes, runs, labels)
    return figure


def _way(axes, runs, labels):
    t = np.linspace(0.0, 1.0, 200)
    axes.plot(t, -np.sin(0.5 * np.pi * t), color=style.BLACK, linewidth=1.0, label=SINE)
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        way = intrusion(run)
        stop = way.without_gravity or way.stop
        if stop is None:
            continue
        said = f"T = {stop.time * 1e3:.2f} ms, D = {stop.depth * 1e3:.2f} mm"
        said = f"{label}:\n{said}" if label else said
        axes.plot(*stop.normalised, label=said, **style.run_style(number))
    axes.set_xlabel("time over stopping time t / T")
    axes.set_ylabel("height over depth h / D")
    axes.set_ylim(-1.05, 0.32)  # room for the legend
    style.legend(axes)


@style.styled
def deceleration(runs, labels=None):
    """Normalised way of a bead of one Run or several until it stops, as G09 Fig 18.

    g t^2 / 2 is taken away, as the paper does. Raises DustError where a run has no projectile.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure()
    _way(axes, runs, labels)
    return figure


@style.styled
def compacted_volume(runs, labels=None, scatter=0.0):
    """Volume of dust denser than a filling factor, in volumes of the bead, as G09 Figs 11, 15.

    scatter: standard deviation of the filling factors of the laboratory's dust, which those of a
    run are convolved with. Raises DustError where a run has no rigid projectile.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes,) = style.new_figure()
    low, high = laboratory.COMPACTED
    axes.axhspan(low, high, color="#D9D9D9", linewidth=0, label="compacted volume (G09 3.4.2)")
    axes.axvline(
        laboratory.LEAST_COMPARED,
        color=style.GREY,
        linewidth=0.8,
        linestyle=(0, (1, 2)),
        label="compared from here on (G09 Fig 15)",
    )
    ends = []
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        found = cumulated_volume(run, scatter=scatter)
        axes.plot(found.filling_factor, found.volume, label=label, **style.run_style(number))
        ends.append(found.filling_factor[-1])
    axes.set_xlim(0.14, max(0.3, *ends))
    axes.set_ylim(0.0, 3.0)
    axes.set_xlabel(r"filling factor $\phi$")
    axes.set_ylabel("volume that is denser (volumes of the bead)")
    style.legend(axes)
    return figure


@style.styled
def filling_factors(run):
    """Share of the dust by filling factor, at the start and at the end of a Run."""
    figure, (axes,) = style.new_figure()
    for number, (snapshot, label) in enumerate(((0, "start"), (-1, "end"))):
        edges, share = histogram(run, snapshot)
        axes.stairs(share, edges, label=label, **style.run_style(number))
    axes.set_yscale("log")
    axes.set_xlabel(r"filling factor $\phi$")
    axes.set_ylabel("share of the volume")
    style.few_ticks(axes.yaxis)
    style.legend(axes)
    return figure


@style.styled
def impact(run, color=EVERYDAY):
    """A bead in dust in one figure: map, profile along the axis, normalised way.

    Raises DustError where the run has no rigid projectile.
    """
    figure = Figure(figsize=(10.0, 3.2), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.08)
    FigureCanvasAgg(figure)
    wide, *beside = figure.subplots(1, 3, width_ratios=[1.7, 1.0, 1.0])
    frame = read_particles(run, -1)
    image = paint(wide, run, frame, color, limits_of([frame], color), extent=extent_of([frame]))
    figure.colorbar(image, ax=wide, label=COLOURS[color][0], extend="max", shrink=0.85)
    _profile(beside[0], [run], ["_"])
    _way(beside[1], [run], [None])
    return figure


@style.styled
def wall_forces(run):
    """Pressure on those faces of a Run of the continuum where something stands, over time."""
    series = run.whole.series
    boundary = run.scene.get("boundary", {})
    figure, (axes,) = style.new_figure()
    per_time, unit = style.scaled(float(series.time[-1]), style.TIMES)
    pressure, walls = series.pressure.values, [str(wall) for wall in series.wall.values]
    seen = [n for n, wall in enumerate(walls) if boundary.get(wall, "open") != "open"]
    largest = np.nanmax(np.abs(pressure[:, seen]))
    per_pressure, pressure_unit = style.scaled(largest, style.PRESSURES)
    for number, n in enumerate(seen):
        axes.plot(
            series.time.values * per_time,
            pressure[:, n] * per_pressure,
            label=walls[n],
            **style.run_style(number),
        )
    axes.set_xlabel(f"time ({unit})")
    axes.set_ylabel(f"pressure on the face ({pressure_unit})")
    style.legend(axes)
    return figure
