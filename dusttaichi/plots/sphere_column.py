"""Filling factor below a sphere that goes into dust."""

from dusttaichi.analysis.sphere import column, penetration
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure
from dusttaichi.plots.sphere import with_spheres

FORCES = ((1e-3, "mN"), (1e-6, "µN"), (1e-9, "nN"))


@figure(
    "Filling factor below the sphere",
    161,
    applies=lambda run: run.has_sphere and run.snapshots is not None,
    together=with_spheres,
    optional=True,
)
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
