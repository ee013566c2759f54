"""A sphere that goes into dust: depth, velocity and force over time, filling factor below it."""

import numpy as np

from dusttaichi.analysis.sphere import column, penetration
from dusttaichi.errors import DustError
from dusttaichi.plots import style

FORCES = ((1e-3, "mN"), (1e-6, "µN"), (1e-9, "nN"))


@style.styled
def sphere(runs, labels=None):
    """Depth of the lowest point, velocity downwards and force of the dust over time, of one Run or
    several of grains or of the continuum.

    Raises DustError where a run has no sphere.
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
    panels[2].set_ylabel(f"force upwards ({newtons})")
    panels[2].set_xlabel(f"time since the sphere is at the surface ({seconds})")
    style.legend(panels[0])
    return figure


@style.styled
def sphere_column(runs, labels=None, snapshot=-1):
    """Filling factor below the sphere in a snapshot, dotted before the impact, of one Run or
    several.

    Raises DustError where a run has no sphere, or no snapshots.
    """
    runs, labels = style.named(runs, labels)
    if any(run.snapshots is None for run in runs):
        raise DustError("There are no snapshots: set output: snapshots in the scene.")
    figure, (axes,) = style.new_figure(height=4.4)
    per_length, metres = style.scaled(max(penetration(run).radius for run in runs), style.LENGTHS)
    before, lowest = {"linewidth": 0.8, "linestyle": (0, (1, 2))}, {"linewidth": 0.6}
    for number, (run, label) in enumerate(zip(runs, labels, strict=True)):
        line, now, first = style.run_style(number), column(run, snapshot), column(run, 0)
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
    axes.set_xlabel(r"filling factor $\phi$ below the sphere")
    axes.set_ylabel(f"depth below the surface ({metres})")
    style.legend(axes)
    return figure
