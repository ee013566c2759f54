"""A sphere that goes into dust: depth, velocity and force over time."""

import numpy as np

from dusttaichi.analysis.sphere import penetration
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure

FORCES = ((1e-3, "mN"), (1e-6, "µN"), (1e-9, "nN"))


def with_spheres(runs, others=()):
    """Of several Runs those in which a sphere goes into dust, one of them among grains."""
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
