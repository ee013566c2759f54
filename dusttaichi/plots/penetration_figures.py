"""Penetration of a sphere into dust: its motion, and the filling factor below it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.analysis.penetration import measure_column, measure_penetration
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run

FORCES = ((1e-3, "mN"), (1e-6, "µN"), (1e-9, "nN"))


def select_spheres(runs: Sequence[Run], figure_names: Sequence[str] = ()) -> list[Run]:
    """Select the runs in which a sphere penetrates dust, at least one of grains."""
    shown_runs = [run for run in runs if run.has_sphere or run.intrudes]
    return shown_runs if len(shown_runs) > 1 and any(run.has_sphere for run in shown_runs) else []


@figure(
    "The sphere over time",
    160,
    applies=lambda run: run.has_sphere,
    together=select_spheres,
    optional=True,
)
def sphere(runs: Run | Sequence[Run], labels: Sequence[str] | None = None) -> Figure:
    """Depth of the lowest point of a sphere, its downward velocity and the force of the dust.

    The runs may be of grains or of the continuum.

    Raises
    ------
    DustError
        A run has no sphere.
    """
    runs, labels = style.label_runs(runs, labels)
    motions = [measure_penetration(run) for run in runs]
    figure, panels = style.create_figure(height=6.2, rows=3)
    per_time, seconds = style.choose_unit(max(motion.time[-1] for motion in motions), style.TIMES)
    per_length, metres = style.choose_unit(max(motion.radius for motion in motions), style.LENGTHS)
    per_force, newtons = style.choose_unit(
        max(np.abs(motion.force).max() for motion in motions), FORCES
    )
    for number, (motion, label) in enumerate(zip(motions, labels, strict=True)):
        line, time = style.run_style(number), motion.time * per_time
        panels[0].plot(time, motion.depth * per_length, label=label, **line)
        panels[1].plot(time, -motion.velocity, **line)
        panels[2].plot(time, motion.force * per_force, **line)
        if motion.stop is not None:
            panels[0].plot(
                motion.stop.time * per_time,
                motion.stop.depth * per_length,
                "o",
                color=line["color"],
            )
    panels[0].invert_yaxis()
    panels[0].set_ylabel(f"depth ({metres})")
    panels[1].set_ylabel("velocity\ndownwards (m/s)")
    panels[2].set(
        ylabel=f"force upwards ({newtons})",
        xlabel=f"time since the sphere is at the surface ({seconds})",
    )
    style.draw_legend(panels[0])
    return figure


@figure(
    "Filling factor below the sphere",
    161,
    applies=lambda run: run.has_sphere and run.snapshots is not None,
    together=select_spheres,
    optional=True,
)
def sphere_column(runs: Run | Sequence[Run], labels: Sequence[str] | None = None) -> Figure:
    """Filling factor below the sphere at the end, dotted before the impact.

    Raises
    ------
    DustError
        A run has no sphere, or no snapshots.
    """
    runs, labels = style.label_runs(runs, labels)
    if any(run.snapshots is None for run in runs):
        raise DustError("There are no snapshots: set output: snapshots in the scene.")
    figure, (axes,) = style.create_figure(height=4.4)
    per_length, metres = style.choose_unit(
        max(measure_penetration(run).radius for run in runs), style.LENGTHS
    )
    before_style: style.Look = {"linewidth": 0.8, "linestyle": style.DOTTED}
    lowest_style: style.Look = {"linewidth": 0.6}
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        line, last_column, first_column = (
            style.run_style(number),
            measure_column(run),
            measure_column(run, 0),
        )
        axes.plot(
            last_column.filling_factor,
            last_column.depth * per_length,
            label=label,
            marker=".",
            **line,
        )
        below = first_column.depth > 0.0
        axes.plot(
            first_column.filling_factor[below],
            first_column.depth[below] * per_length,
            color=line["color"],
            **before_style,
        )
        axes.axhline(last_column.sphere * per_length, color=line["color"], **lowest_style)
    axes.plot([], [], color=style.GREY, label="before the impact", **before_style)
    axes.plot([], [], color=style.GREY, label="lowest point of the sphere", **lowest_style)
    axes.invert_yaxis()
    axes.set(
        xlabel=r"filling factor $\phi$ below the sphere",
        ylabel=f"depth below the surface ({metres})",
    )
    style.draw_legend(axes)
    return figure
