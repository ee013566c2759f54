"""Beads in dust: map, profile, motion and volume of one, depths and times of several (G09)."""

import numpy as np

from dusttaichi.continuum.analysis import (
    at_zero_spacing,
    axis_profile,
    cumulated_volume,
    intrusion,
    laboratory,
    read_particles,
)
from dusttaichi.continuum.plots.dust import COLOURS, EVERYDAY, extent_of, intrudes, limits_of, paint
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure, select_in_common


def draw_profile(axes, runs, labels):
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        profile = axis_profile(run)
        seen = np.isfinite(profile.filling_factor)
        line = style.run_style(number)
        axes.plot(
            profile.filling_factor[seen], profile.depth[seen] * 1e3, label=label, marker=".", **line
        )
        axes.axhline(profile.bead * 1e3, **style.line_look(line["color"], 0.6, style.DOTTED))
    axes.axvline(
        laboratory.MOST_FREQUENT,
        label="most frequent below\nthe bead (G09 Fig 11)",
        **style.line_look(style.BLACK, 1.0, style.DASHED),
    )
    axes.set(xlabel=r"filling factor $\phi$ below the bead", ylabel="depth below the surface (mm)")
    axes.invert_yaxis()
    style.draw_legend(axes)


@figure("Filling factor below the bead", 174, applies=intrudes, together=True)
def bead_profile(runs, labels=None):
    """Filling factor along the axis below a bead of one run or several, as G09 Fig 12.

    Dotted: the lowest point of the bead.

    Raises
    ------
    DustError
        A run has no rigid projectile.
    """
    runs, labels = style.label_runs(runs, labels)
    figure, (axes,) = style.create_figure(height=4.0)
    draw_profile(axes, runs, labels)
    return figure


SINE = "laboratory: sine (G09 eq 11)"


def draw_way(axes, runs, labels):
    t = np.linspace(0.0, 1.0, 200)
    axes.plot(t, -np.sin(0.5 * np.pi * t), color=style.BLACK, linewidth=1.0, label=SINE)
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        way = intrusion(run)
        stop = way.without_gravity or way.stop
        if stop is None:
            continue
        text = f"T = {stop.time * 1e3:.2f} ms, D = {stop.depth * 1e3:.2f} mm"
        text = f"{label}:\n{text}" if label else text
        axes.plot(*stop.normalised, label=text, **style.run_style(number))
    axes.set_xlabel("time over stopping time t / T")
    axes.set_ylabel("height over depth h / D")
    axes.set_ylim(-1.05, 0.32)  # space for the legend
    style.draw_legend(axes)


@figure("Motion of the bead", 175, applies=intrudes, together=True)
def deceleration(runs, labels=None):
    """Normalised motion of a bead of one run or several until it stops, as G09 Fig 18.

    The free-fall term g t^2 / 2 is subtracted, as in the paper.

    Raises
    ------
    DustError
        A run has no projectile.
    """
    runs, labels = style.label_runs(runs, labels)
    figure, (axes,) = style.create_figure()
    draw_way(axes, runs, labels)
    return figure


@figure("Volume of the compacted dust", 176, applies=intrudes, together=True)
def compacted_volume(runs, labels=None, scatter=0.0):
    """Volume of dust denser than a filling factor, in volumes of the bead (G09 Figs 11, 15).

    Parameters
    ----------
    scatter : float
        Standard deviation of the filling factors of the laboratory's dust, with which those of a
        run are convolved.

    Raises
    ------
    DustError
        A run has no rigid projectile.
    """
    runs, labels = style.label_runs(runs, labels)
    figure, (axes,) = style.create_figure()
    low, high = laboratory.COMPACTED
    axes.axhspan(low, high, color="#D9D9D9", linewidth=0, label="compacted volume (G09 3.4.2)")
    axes.axvline(
        laboratory.LEAST_COMPARED,
        label="compared from here on (G09 Fig 15)",
        **style.line_look(style.GREY, 0.8, style.DOTTED),
    )
    ends = []
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        volume = cumulated_volume(run, scatter)
        axes.plot(volume.filling_factor, volume.volume, label=label, **style.run_style(number))
        ends.append(volume.filling_factor[-1])
    axes.set(
        xlim=(0.14, max(0.3, *ends)),
        ylim=(0.0, 3.0),
        xlabel=r"filling factor $\phi$",
        ylabel="volume that is denser (volumes of the bead)",
    )
    style.draw_legend(axes)
    return figure


@figure("The bead: map, profile, motion", 173, applies=intrudes)
def impact(run):
    """A bead in dust in one figure: map, profile along the axis, normalised motion.

    Raises
    ------
    DustError
        The run has no rigid projectile.
    """
    figure = style.create_canvas(10.0, 3.2, layout="constrained")
    figure.get_layout_engine().set(w_pad=0.08)
    wide, *narrow = figure.subplots(1, 3, width_ratios=[1.7, 1.0, 1.0])
    frame = read_particles(run, -1)
    limits = limits_of([frame], EVERYDAY)
    image = paint(wide, run, frame, EVERYDAY, limits, extent=extent_of([frame]))
    figure.colorbar(image, ax=wide, label=COLOURS[EVERYDAY][0], extend="max", shrink=0.85)
    draw_profile(narrow[0], [run], ["_"])
    draw_way(narrow[1], [run], [None])
    return figure


SMALL = 2e-3  # diameter [m] that parts the two sizes of the laboratory


@figure("Depth and stopping time of the beads", 177, together=select_in_common(intrudes))
def drops(runs):
    """Depth D and stopping time T against m v / A of several runs with beads, without free fall.

    Runs of one diameter are joined. Black: the drops of G09 Table 2, small beads filled. Runs that
    ended before the bead stopped are left out.

    Raises
    ------
    DustError
        A run has no rigid projectile.
    """
    figure, axes = style.create_figure(height=5.4, rows=2)
    lab = laboratory.drops()
    for large, face in ((True, "none"), (False, style.BLACK)):
        is_selected = (lab["diameter"] > SMALL) == large
        label = f"laboratory, {'3' if large else '1'} mm (G09 Table 2)"
        look = {"color": style.BLACK, "markerfacecolor": face, "markersize": 4, "label": label}
        for ax, key in zip(axes, ("depth", "time"), strict=True):
            ax.plot(lab["momentum"][is_selected], lab[key][is_selected] * 1e3, "o", **look)
    curves = {}
    for run in runs:
        way = intrusion(run)
        if way.without_gravity is not None:
            point = (way.momentum, way.without_gravity.depth, way.without_gravity.time)
            curves.setdefault(round(way.diameter * 1e3, 3), []).append(point)
    for number, (diameter, points) in enumerate(sorted(curves.items())):
        momentum, depth, time = np.array(sorted(points)).T
        line = style.run_style(number) | {"marker": "s", "markersize": 4}
        axes[0].plot(momentum, depth * 1e3, label=f"{diameter:g} mm", **line)
        axes[1].plot(momentum, time * 1e3, **line)
    for ax, name in zip(axes, ("depth D (mm)", "stopping time T (ms)"), strict=True):
        style.set_logarithmic(ax)
        ax.set_ylabel(name)
    axes[1].set_xlabel(r"momentum over cross-section $m v / A$ (kg m$^{-1}$ s$^{-1}$)")
    style.draw_legend(axes[0])
    return figure


@figure("Depth and stopping time at spacing zero", 178, together=select_in_common(intrudes))
def resolution(runs):
    """Depth D and stopping time T of one bead over the spacing, without the free-fall term.

    A line for each viscosity at the contact (numerics.viscosity.contact), by least squares, down to
    spacing zero. Runs that ended before the bead stopped are left out.

    Raises
    ------
    DustError
        A run has no rigid projectile.
    """
    curves = {}
    for run in runs:
        stop = intrusion(run).without_gravity
        if stop is not None:
            alpha = run.scene["numerics"]["viscosity"]["contact"]
            point = (float(run.attrs["spacing"]), stop.depth * 1e3, stop.time * 1e3)
            curves.setdefault(float(alpha), []).append(point)
    figure, axes = style.create_figure(height=5.0, rows=2)
    for number, (alpha, points) in enumerate(sorted(curves.items(), reverse=True)):
        spacing, *values = np.array(sorted(points)).T
        look = style.run_style(number)
        for ax, value, unit in zip(axes, values, ("mm", "ms"), strict=True):
            label = rf"$\alpha$ = {alpha:g}"
            ax.plot(spacing * 1e6, value, "o", color=look["color"], markersize=4)
            if np.ptp(spacing) > 0.0:
                end, slope = at_zero_spacing(spacing, value)
                x = np.array([0.0, spacing.max()])
                ax.plot(x * 1e6, end + slope * x, label=f"{label}: {end:.3f} {unit}", **look)
    for ax, name in zip(axes, ("depth D (mm)", "stopping time T (ms)"), strict=True):
        ax.set(ylabel=name, xlim=(0.0, None))
        if ax.get_legend_handles_labels()[0]:
            style.draw_legend(ax, title="at spacing zero")
    axes[1].set_xlabel("spacing of particles (µm)")
    return figure
