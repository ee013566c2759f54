"""Dust in its room: shares by filling factor, pressure on the faces."""

import numpy as np

from dusttaichi.analysis.continuum import has_dust, histogram
from dusttaichi.names import WALLS
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


def _with_dust(run):
    return run.snapshots is not None and has_dust(run)


@figure("Share of the dust by filling factor", 172, applies=_with_dust)
def filling_factors(run):
    """Share of the dust by filling factor, at the start and at the end of a Run."""
    figure, (axes,) = style.new_figure()
    for number, (snapshot, label) in enumerate(((0, "start"), (-1, "end"))):
        edges, share = histogram(run, snapshot)
        axes.stairs(share, edges, label=label, **style.run_style(number))
    style.logarithmic(axes, "y")
    axes.set(xlabel=r"filling factor $\phi$", ylabel="share of the volume")
    style.legend(axes)
    return figure


def _between_faces(run):
    faces = set(WALLS) & set(run.scene.get("boundary", {}))
    return len(run.series.time) > 1 and "pressure" in run.series and bool(faces)


@figure("Pressure on the faces", 170, applies=_between_faces)
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
    axes.set(xlabel=f"time ({unit})", ylabel=f"pressure on the face ({pressure_unit})")
    style.legend(axes)
    return figure
