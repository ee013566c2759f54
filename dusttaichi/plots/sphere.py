"""Penetration of a sphere into dust: its motion, and the filling factor below it."""

import numpy as np

from dusttaichi.analysis.sphere import column, penetration
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure

FORCES = ((1e-3, "mN"), (1e-6, "µN"), (1e-9, "nN"))


def with_spheres(runs, others=()):
    """Runs in which a sphere penetrates dust, at least one of grains."""
    able = [run for run in runs if run.has_sphere or run.intrudes]
    return able if len(able) > 1 and any(run.has_sphere for run in able) else []


@figure(
    "The sphere over time",
    160,
    applies=lambda run: run.has_sphere,
    together=with_spheres,
    optional=True,
)
def sphere(runs, labels=None):
    """Depth of the lowest point of a sphere, its downward velocity and the force of the dust.

    The runs may be of grains or of the continuum.

    Raises
    ------
    DustError
        A run has no sphere.
    """
    runs, labels = style.named(runs, labels)
    ways = [penetration(run) for run in runs]
    figure, panels = style.new_figure(height=6.2, rows=3)
    per_time, seconds = style.scaled(max(way.time[-1] for way in ways), style.TIMES)
    per_length, metres = style.scaled(max(way.radius for way in ways), style.LENGTHS)
    per_force, newtons = style.scaled(max(np.abs(way.force).max() for way in ways), FORCES)
    for number, (way, label) in enumerate(zip(ways, labels, strict=True)):
        line, time = style.run_style(number), way.time * per_time
        panels[0].plot(time, way.depth * per_length, label=label, **line)
        panels[1].plot(time, -way.velocity, **line)
        panels[2].plot(time, way.force * per_force, **line)
        if way.stop is not None:
            panels[0].plot(
                way.stop.time * per_time, way.stop.depth * per_length, "o", color=line["color"]
            )
    panels[0].invert_yaxis()
    panels[0].set_ylabel(f"depth ({metres})")
    panels[1].set_ylabel("velocity\ndownwards (m/s)")
    panels[2].set(
        ylabel=f"force upwards ({newtons})",
        xlabel=f"time since the sphere is at the surface ({seconds})",
    )
    style.legend(panels[0])
    return figure


@figure(
    "Filling factor below the sphere",
    161,
    applies=lambda run: run.has_sphere and run.snapshots is not None,
    together=with_spheres,
    optional=True,
)
def sphere_column(runs, labels=None):
    """Filling factor below the sphere at the end, dotted before the impact.

    Raises
    ------
    DustError
        A run has no sphere, or no snapshots.
    """
    runs, labels = style.named(runs, labels)
    if any(run.snapshots is None for run in runs):
        raise DustError("There are no snapshots: set output: snapshots in the scene.")
    figure, (axes,) = style.new_figure(height=4.4)
    per_length, metres = style.scaled(max(penetration(run).radius for run in runs), style.LENGTHS)
    before, lowest = {"linewidth": 0.8, "linestyle": style.DOTTED}, {"linewidth": 0.6}
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        line, now, first = style.run_style(number), column(run), column(run, 0)
        axes.plot(now.filling_factor, now.depth * per_length, label=label, marker=".", **line)
        below = first.depth > 0.0
        axes.plot(
            first.filling_factor[below],
            first.depth[below] * per_length,
            color=line["color"],
            **before,
        )
        axes.axhline(now.sphere * per_length, color=line["color"], **lowest)
    axes.plot([], [], color=style.GREY, label="before the impact", **before)
    axes.plot([], [], color=style.GREY, label="lowest point of the sphere", **lowest)
    axes.invert_yaxis()
    axes.set(
        xlabel=r"filling factor $\phi$ below the sphere",
        ylabel=f"depth below the surface ({metres})",
    )
    style.legend(axes)
    return figure
