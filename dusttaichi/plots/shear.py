"""Shear and triaxial tests with their lines of friction; load steps."""

import numpy as np

from dusttaichi.analysis.cycles import pressure_of
from dusttaichi.analysis.loads import (
    controlled_loads,
    friction,
    is_triaxial,
    load_text,
    shearings,
    triaxials,
)
from dusttaichi.errors import DustError
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Shear stress and strength", 90, applies=lambda run: run.sheared, optional=True)
def shear(run, others=()):
    """Shear stress of a run against the shear strain of each stage that shears.

    For cyclic shear it is drawn against the total shear strain. Below, of several stages with a
    prescribed normal stress, the strength against this stress, with the line of friction, and
    against the filling factor.

    Parameters
    ----------
    run : Run
    others : sequence of Run
        Runs of the same scene on other samples: open points, and part of the line.

    Raises
    ------
    DustError
        Nothing is sheared.
    """
    found = shearings(run)
    loaded = [one for one in found if one.has_friction]
    more = [one for other in others for one in shearings(other) if one.has_friction]
    several = len(loaded) + len(more) > 1
    figure, (curves, *below) = style.new_figure(
        height=7.2 if several else 3.7,
        rows=3 if several else 1,
        ratios=(1.4, 1.0, 1.0) if several else None,
        shared=False,
    )
    scale, unit = style.scaled(max(np.abs(one.shear).max() for one in found), style.PRESSURES)
    colors = _shear_curves(curves, found, scale)
    curves.set_ylabel(f"shear stress ({unit})")
    if several:
        _strengths(below, [*loaded, *more], len(loaded), colors=colors, scale=scale, unit=unit)
    return figure


def _shear_curves(axes, found, scale):
    """Draws the shear stress of Shearings; the colour of each stage, by its name."""
    cyclic = len({one.direction for one in found}) > 1
    controlled = all(one.controlled for one in found)
    colors = {}
    for number, one in enumerate(found):
        own = style.run_style(number)
        colors[one.stage] = own["color"]
        label = load_text(one) if controlled else one.stage or "sheared"
        if cyclic:
            axes.plot(one.total_strain, one.direction * one.shear * scale, label=label, **own)
        else:
            axes.plot(one.strain, one.shear * scale, label=label, **own)
    if cyclic:
        axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    axes.set_xlabel("total shear strain" if cyclic else "shear strain of the stage")
    title = "normal stress" if controlled else "normal stress not prescribed"
    style.legend(axes, title=title, ncols=2)
    return colors


def _strengths(panels, found, own, *, colors, scale, unit):
    """Strengths of Shearings over load and filling factor, filled the first `own` of them."""
    line, density = panels
    for number, one in enumerate(found):
        filled = {} if number < own else {"markerfacecolor": "none"}
        for axes, x in ((line, one.load * scale), (density, one.density)):
            axes.errorbar(
                x, one.strength * scale, one.strength_sigma * scale, fmt="o",
                color=colors.get(one.stage, style.GREY), markersize=5, **filled,
            )  # fmt: skip
    fit = friction(found)
    if fit is not None:
        x = np.array([0.0, 1.05 * max(one.load for one in found)])
        slope = f"{fit.slope:+.2f}"
        text = rf"$\tau = {fit.cohesion * scale:.2g}$ {unit} ${slope}\,\sigma_n$"
        line.plot(
            x * scale,
            (fit.cohesion + fit.slope * x) * scale,
            color=style.BLACK,
            linewidth=1.0,
            label=f"{text}, friction angle {fit.angle:.0f}°",
        )
        style.legend(line)
    line.set_xlabel(f"normal stress ({unit})")
    density.set_xlabel(r"filling factor $\phi$")
    for axes in (line, density):
        axes.set(ylabel=f"strength ({unit})", ylim=(0.0, None))


@figure("Triaxial tests", 100, applies=is_triaxial, optional=True)
def triaxial(run, others=()):
    """Deviator and filling factor of a run against the strain of each triaxial test.

    Below, Mohr's circles of their strengths, with the line of friction as their tangent.

    Parameters
    ----------
    run : Run
    others : sequence of Run
        Runs of the same scene on other samples: thin circles, and part of the line.

    Raises
    ------
    DustError
        There is no test.
    """
    found, more = triaxials(run), [one for other in others for one in triaxials(other)]
    figure, (curves, density, circles) = style.new_figure(
        height=7.2, rows=3, ratios=(1.4, 1.0, 1.1), shared=False
    )
    scale, unit = style.scaled(max(np.abs(one.deviator).max() for one in found), style.PRESSURES)
    for number, one in enumerate(found):
        own = style.run_style(number)
        label = load_text(one)
        curves.plot(one.strain, one.deviator * scale, label=label, **own)
        density.plot(one.strain, one.filling_factor, **own)
        circles.plot(*_circle(one, scale), **own)
        for other in more:
            if other.stage == one.stage:
                circles.plot(*_circle(other, scale), **(own | {"linewidth": 0.7}))
    _touching(circles, friction([*found, *more]), scale)
    curves.set_ylabel(f"deviator ({unit})")
    style.legend(curves, title="confining stress")
    density.set_ylabel(r"filling factor $\phi$")
    for axes in (curves, density):
        axes.set_xlabel("axial strain of the stage")
    circles.set(xlabel=f"normal stress ({unit})", ylabel=f"shear stress ({unit})")
    circles.set_aspect("equal", adjustable="datalim")
    circles.set_ylim(bottom=0.0)
    return figure


def _circle(test, scale):
    """The upper half of Mohr's circle of a Triaxial: (normal, shear stress)."""
    turn, radius = np.linspace(0.0, np.pi, 90), 0.5 * test.strength
    middle = test.load + radius
    return (middle + radius * np.cos(turn)) * scale, radius * np.sin(turn) * scale


def _touching(axes, fit, scale):
    """Draws the tangent of the circles, of their Friction, if there is one."""
    if fit is None:
        return
    x = np.array([0.0, axes.get_xlim()[1]])
    y = fit.triaxial_cohesion * scale + np.tan(np.radians(fit.triaxial_angle)) * x
    text = f"friction angle {fit.triaxial_angle:.0f}°"
    axes.plot(x, y, color=style.BLACK, linewidth=1.0, label=text)
    style.legend(axes)


@figure("Filling factor under each load", 80, applies=lambda run: bool(controlled_loads(run)))
def loads(run, others=(), repeats=()):
    """Filling factor against pressure of a run with load steps.

    The thin line is its path; points are the settled state of each load.

    Parameters
    ----------
    run : Run
    others : sequence of Run
        Runs of the same sample at constant speed, drawn as lines.
    repeats : sequence of Run
        Runs of the same steps on other samples: points are means, bars standard deviations between
        samples.

    Raises
    ------
    DustError
        No stage controls a pressure.
    """
    found = controlled_loads(run)
    if not found:
        raise DustError(f"{run.path}: no stage controls a pressure; it needs drive: pressure.")
    samples = [found, *(controlled_loads(other) for other in repeats)]
    pressure = np.array([[load.pressure for load in one] for one in samples]) / 1e3
    density = np.array([[load.filling_factor for load in one] for one in samples])
    figure, (axes,) = style.new_figure()
    path = _path(run)
    axes.plot(*path, color=style.GREY, linewidth=0.7, label="under load, not settled")
    for number, (other, label) in enumerate(zip(*style.named(others), strict=True)):
        axes.plot(*_path(other), label=label, **style.run_style(number))
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
    lowest = min(load.wanted for load in found) / 1e3
    # of a load that is not reached the reached pressure
    reached = np.quantile(path[0], 0.9) if len(path[0]) else lowest
    axes.set(
        xlim=(0.1 * min(lowest, reached), 2.0 * max(load.wanted for load in found) / 1e3),
        xlabel="pressure (kPa)",
        ylabel=r"filling factor $\phi$",
    )
    style.legend(axes)
    return figure


def _path(run):
    """Pressure [kPa] and filling factor of all records with a positive pressure."""
    pressure = pressure_of(run.series) / 1e3
    shown = pressure > 0.0
    return pressure[shown], run.series.filling_factor.values[shown]
