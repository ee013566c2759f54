"""Surfaces that move: their loads, and how far they have gone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.analysis.surface_loads import measure_surfaces
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure
from dusttaichi.plots.penetration_figures import FORCES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run


@figure("Surfaces that move", 165, applies=lambda run: bool(measure_surfaces(run)))
def surfaces(run: Run) -> Figure:
    """Load of each surface that moves, and its displacement, along its direction over time.

    The load is a pressure where all of them have an area, else a force. Vertical lines begin
    stages.

    Raises
    ------
    DustError
        No surface with a direction moves.
    """
    courses = measure_surfaces(run)
    if not courses:
        raise DustError(f"{run.path}: no surface with a direction moves.")
    figure, (loads, displacements) = style.create_figure(height=5.2, rows=2)
    has_areas = all(np.isfinite(course.pressure).any() for course in courses)
    values = [course.pressure if has_areas else course.load for course in courses]
    word, units = ("pressure", style.PRESSURES) if has_areas else ("force", FORCES)
    per_load, loads_unit = style.choose_unit(max(np.nanmax(np.abs(v)) for v in values), units)
    per_time, seconds = style.choose_unit(float(courses[0].time[-1]), style.TIMES)
    per_length, metres = style.choose_unit(
        max(np.abs(course.displacement).max() for course in courses), style.LENGTHS
    )
    for number, (course, load) in enumerate(zip(courses, values, strict=True)):
        line, time = style.run_style(number), course.time * per_time
        loads.plot(time, load * per_load, label=course.name, **line)
        displacements.plot(time, course.displacement * per_length, **line)
    stages = run.series.stage.values if "stage" in run.series else np.zeros(1)
    for start in np.flatnonzero(np.diff(stages)):
        for axes in (loads, displacements):
            axes.axvline(courses[0].time[start] * per_time, color=style.GREY, linewidth=0.6)
    loads.set_ylabel(f"{word} ({loads_unit})")
    displacements.set(ylabel=f"displacement ({metres})", xlabel=f"time ({seconds})")
    style.draw_legend(loads)
    return figure
