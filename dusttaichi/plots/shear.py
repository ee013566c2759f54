"""Shear and triaxial tests with their lines of friction; load steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.analysis.cycles import compute_pressure
from dusttaichi.analysis.friction import fit_friction
from dusttaichi.analysis.loads import (
    format_load,
    is_triaxial,
    measure_controlled_loads,
    measure_shear_tests,
    measure_triaxial_tests,
)
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dusttaichi.analysis.friction import Friction
    from dusttaichi.analysis.loads import Shearing, Triaxial
    from dusttaichi.analysis.run import Run
    from dusttaichi.physics.geometry import Floats


@figure("Shear stress and strength", 90, applies=lambda run: run.sheared, optional=True)
def shear(run: Run, repeats: Sequence[Run] = ()) -> Figure:
    """Shear stress of a run against the shear strain of each stage that shears.

    For cyclic shear it is drawn against the total shear strain. Below, of several stages with a
    prescribed normal stress, the strength against this stress, with the line of friction, and
    against the filling factor.

    Parameters
    ----------
    run : Run
    repeats : sequence of Run
        Runs of the same scene on other samples: open points, and part of the line.

    Raises
    ------
    DustError
        Nothing is sheared.
    """
    stages = measure_shear_tests(run)
    loaded = [shearing for shearing in stages if shearing.has_friction]
    repeated_stages = [
        shearing
        for repeat in repeats
        for shearing in measure_shear_tests(repeat)
        if shearing.has_friction
    ]
    several = len(loaded) + len(repeated_stages) > 1
    figure, (curves, *below) = style.create_figure(
        height=7.2 if several else 3.7,
        rows=3 if several else 1,
        ratios=(1.4, 1.0, 1.0) if several else None,
        shared=False,
    )
    scale, unit = style.choose_unit(
        max(np.abs(shearing.shear).max() for shearing in stages), style.PRESSURES
    )
    colors = _draw_shear_curves(curves, stages, scale)
    curves.set_ylabel(f"shear stress ({unit})")
    if several:
        _draw_strengths(
            below, [*loaded, *repeated_stages], len(loaded), colors=colors, scale=scale, unit=unit
        )
    return figure


def _draw_shear_curves(axes: Axes, stages: Sequence[Shearing], scale: float) -> dict[str, Any]:
    """Draw the shear stress of Shearings; return the colour of each stage by its name."""
    cyclic = len({shearing.direction for shearing in stages}) > 1
    controlled = all(shearing.controlled for shearing in stages)
    colors = {}
    for number, shearing in enumerate(stages):
        line_style = style.run_style(number)
        colors[shearing.stage] = line_style["color"]
        label = format_load(shearing) if controlled else shearing.stage or "sheared"
        if cyclic:
            axes.plot(
                shearing.total_strain,
                shearing.direction * shearing.shear * scale,
                label=label,
                **line_style,
            )
        else:
            axes.plot(shearing.strain, shearing.shear * scale, label=label, **line_style)
    if cyclic:
        axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    axes.set_xlabel("total shear strain" if cyclic else "shear strain of the stage")
    title = "normal stress" if controlled else "normal stress not prescribed"
    style.draw_legend(axes, title=title, ncols=2)
    return colors


def _draw_strengths(
    panels: Sequence[Axes],
    stages: Sequence[Shearing],
    count_filled: int,
    *,
    colors: Mapping[str, Any],
    scale: float,
    unit: str,
) -> None:
    """Draw strengths of Shearings over load and filling factor, filled the first count_filled."""
    line, density = panels
    for number, shearing in enumerate(stages):
        filled: style.Look = {} if number < count_filled else {"markerfacecolor": "none"}
        for axes, x in ((line, shearing.load * scale), (density, shearing.density)):
            axes.errorbar(
                x, shearing.strength * scale, shearing.strength_sigma * scale, fmt="o",
                color=colors.get(shearing.stage, style.GREY), markersize=5, **filled,
            )  # fmt: skip
    fit = fit_friction(stages)
    if fit is not None:
        ends = np.array([0.0, 1.05 * max(shearing.load for shearing in stages)])
        slope = f"{fit.slope:+.2f}"
        text = rf"$\tau = {fit.cohesion * scale:.2g}$ {unit} ${slope}\,\sigma_n$"
        line.plot(
            ends * scale,
            (fit.cohesion + fit.slope * ends) * scale,
            color=style.BLACK,
            linewidth=1.0,
            label=f"{text}, friction angle {fit.angle:.0f}°",
        )
        style.draw_legend(line)
    line.set_xlabel(f"normal stress ({unit})")
    density.set_xlabel(r"filling factor $\phi$")
    for axes in (line, density):
        axes.set(ylabel=f"strength ({unit})", ylim=(0.0, None))


@figure("Triaxial tests", 100, applies=is_triaxial, optional=True)
def triaxial(run: Run, repeats: Sequence[Run] = ()) -> Figure:
    """Deviator and filling factor of a run against the strain of each triaxial test.

    Below, Mohr's circles of their strengths, with the line of friction as their tangent.

    Parameters
    ----------
    run : Run
    repeats : sequence of Run
        Runs of the same scene on other samples: thin circles, and part of the line.

    Raises
    ------
    DustError
        There is no test.
    """
    tests, repeated_tests = (
        measure_triaxial_tests(run),
        [test for repeat in repeats for test in measure_triaxial_tests(repeat)],
    )
    figure, (curves, density, circles) = style.create_figure(
        height=7.2, rows=3, ratios=(1.4, 1.0, 1.1), shared=False
    )
    scale, unit = style.choose_unit(
        max(np.abs(test.deviator).max() for test in tests), style.PRESSURES
    )
    for number, test in enumerate(tests):
        line_style = style.run_style(number)
        label = format_load(test)
        curves.plot(test.strain, test.deviator * scale, label=label, **line_style)
        density.plot(test.strain, test.filling_factor, **line_style)
        circles.plot(*_compute_circle(test, scale), **line_style)
        for repeat in repeated_tests:
            if repeat.stage == test.stage:
                circles.plot(*_compute_circle(repeat, scale), **(line_style | {"linewidth": 0.7}))
    _draw_tangent(circles, fit_friction([*tests, *repeated_tests]), scale)
    curves.set_ylabel(f"deviator ({unit})")
    style.draw_legend(curves, title="confining stress")
    density.set_ylabel(r"filling factor $\phi$")
    for axes in (curves, density):
        axes.set_xlabel("axial strain of the stage")
    circles.set(xlabel=f"normal stress ({unit})", ylabel=f"shear stress ({unit})")
    circles.set_aspect("equal", adjustable="datalim")
    circles.set_ylim(bottom=0.0)
    return figure


def _compute_circle(test: Triaxial, scale: float) -> tuple[Floats, Floats]:
    """Compute the upper half of Mohr's circle of a Triaxial: (normal, shear stress)."""
    turn, radius = np.linspace(0.0, np.pi, 90), 0.5 * test.strength
    middle = test.load + radius
    return (middle + radius * np.cos(turn)) * scale, radius * np.sin(turn) * scale


def _draw_tangent(axes: Axes, fit: Friction | None, scale: float) -> None:
    """Draw the tangent of the circles, of their Friction, if there is one."""
    if fit is None:
        return
    x = np.array([0.0, axes.get_xlim()[1]])
    y = fit.triaxial_cohesion * scale + np.tan(np.radians(fit.triaxial_angle)) * x
    text = f"friction angle {fit.triaxial_angle:.0f}°"
    axes.plot(x, y, color=style.BLACK, linewidth=1.0, label=text)
    style.draw_legend(axes)


@figure(
    "Filling factor under each load", 80, applies=lambda run: bool(measure_controlled_loads(run))
)
def loads(run: Run, constant_speed_runs: Sequence[Run] = (), repeats: Sequence[Run] = ()) -> Figure:
    """Filling factor against pressure of a run with load steps.

    The thin line is its path; points are the settled state of each load.

    Parameters
    ----------
    run : Run
    constant_speed_runs : sequence of Run
        Runs of the same sample at constant speed, drawn as lines.
    repeats : sequence of Run
        Runs of the same steps on other samples: points are means, bars standard deviations between
        samples.

    Raises
    ------
    DustError
        No stage controls a pressure.
    """
    load_steps = measure_controlled_loads(run)
    if not load_steps:
        raise DustError(f"{run.path}: no stage controls a pressure; it needs drive: pressure.")
    samples = [load_steps, *(measure_controlled_loads(reference) for reference in repeats)]
    pressure = np.array([[load.pressure for load in steps] for steps in samples]) / 1e3
    density = np.array([[load.filling_factor for load in steps] for steps in samples])
    figure, (axes,) = style.create_figure()
    path = _collect_path(run)
    axes.plot(*path, color=style.GREY, linewidth=0.7, label="under load, not settled")
    references, labels = style.label_runs(constant_speed_runs)
    if len(references) == 1:
        labels = ["constant speed"]
    for number, (reference, label) in enumerate(zip(references, labels, strict=True)):
        axes.plot(*_collect_path(reference), label=label, **style.run_style(number))
    axes.errorbar(
        pressure.mean(axis=0),
        density.mean(axis=0),
        density.std(axis=0, ddof=1) if repeats else None,
        fmt="o",
        color=style.ORANGE,
        markersize=6,
        capsize=3,
        label="under load, settled",
    )
    axes.set_xscale("log")
    lowest = min(load.prescribed for load in load_steps) / 1e3
    # of a load that is not reached the reached pressure
    reached = np.quantile(path[0], 0.9) if len(path[0]) else lowest
    axes.set(
        xlim=(0.1 * min(lowest, reached), 2.0 * max(load.prescribed for load in load_steps) / 1e3),
        xlabel="pressure (kPa)",
        ylabel=r"filling factor $\phi$",
    )
    style.draw_legend(axes)
    return figure


def _collect_path(run: Run) -> tuple[Floats, Floats]:
    """Pressure [kPa] and filling factor of all records with a positive pressure."""
    pressure = compute_pressure(run.series) / 1e3
    shown = pressure > 0.0
    return pressure[shown], run.series.filling_factor.values[shown]
