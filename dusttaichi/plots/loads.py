"""Dust under load: steps of load beside a constant speed, and shear strength."""

import numpy as np

from dusttaichi.analysis.cycles import pressure_of
from dusttaichi.analysis.loads import friction, held_loads, shearings
from dusttaichi.analysis.triaxial import triaxials
from dusttaichi.errors import DustError
from dusttaichi.plots import style


@style.styled
def loads(run, others=(), labels=None, repeats=()):
    """Filling factor against pressure where a Run holds pressures, step by step.

    Its path is thin, its points are where each load had settled. others: runs of the same sample at
    a constant speed, drawn as lines; labels: one for each of these (default: their names). repeats:
    runs of the same steps on other samples: points are the means of all, their bars the standard
    deviations between samples. Raises DustError where no pressure is held.
    """
    found = held_loads(run)
    if not found:
        raise DustError(f"{run.path}: no stage holds a pressure; it needs drive: pressure.")
    samples = [found, *(held_loads(other) for other in repeats)]
    pressure = np.array([[held.pressure for held in one] for one in samples]) / 1e3
    density = np.array([[held.filling_factor for held in one] for one in samples])
    figure, (axes,) = style.new_figure()
    path = _path(run)
    axes.plot(*path, color=style.GREY, linewidth=0.7, label="under load, on the way")
    names = labels or [other.name.replace("$", r"\$") for other in others]
    for number, (other, label) in enumerate(zip(others, names, strict=True)):
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
    lowest = min(held.wanted for held in found) / 1e3
    # where a load is far from reached, what was
    reached = np.quantile(path[0], 0.9) if len(path[0]) else lowest
    axes.set_xlim(0.1 * min(lowest, reached), 2.0 * max(held.wanted for held in found) / 1e3)
    axes.set_xlabel("pressure (kPa)")
    axes.set_ylabel(r"filling factor $\phi$")
    style.legend(axes)
    return figure


def _path(run):
    """Pressure [kPa] and filling factor of all records with a positive pressure."""
    pressure = pressure_of(run.series) / 1e3
    shown = pressure > 0.0
    return pressure[shown], run.series.filling_factor.values[shown]


@style.styled
def shear(run, others=()):
    """Shear stress of a Run against the shear strain of each stage that shears; where stages shear
    there and back the loop, against the total shear strain.

    Below, of several stages under a normal stress that the scene prescribes, the strength against
    it, with the line of friction, and against the filling factor. others: runs of the same scene on
    other samples: open points, and part of the line. Raises DustError where nothing is sheared.
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
    scale, unit = _stress_unit(np.concatenate([one.shear for one in found]))
    colors = _shear_curves(curves, found, scale)
    curves.set_ylabel(f"shear stress ({unit})")
    if several:
        _strengths(below, [*loaded, *more], len(loaded), colors=colors, scale=scale, unit=unit)
    return figure


def _shear_curves(axes, found, scale):
    """Draws the shear stress of Shearings; the colour of each stage, by its name."""
    cyclic = len({one.direction for one in found}) > 1
    loads_said = all(one.controlled for one in found)
    colors = {}
    for number, one in enumerate(found):
        own = style.run_style(number)
        colors[one.stage] = own["color"]
        label = f"{one.load / 1e3:.3g} kPa" if loads_said else one.stage or "sheared"
        if cyclic:
            axes.plot(one.total_strain, one.direction * one.shear * scale, label=label, **own)
        else:
            axes.plot(one.strain, one.shear * scale, label=label, **own)
    if cyclic:
        axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    axes.set_xlabel("total shear strain" if cyclic else "shear strain of the stage")
    title = "normal stress" if loads_said else "normal stress not prescribed"
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
        axes.set_ylabel(f"strength ({unit})")
        axes.set_ylim(bottom=0.0)


def _stress_unit(values):
    return style.scaled(float(np.abs(values).max()), style.PRESSURES)


@style.styled
def triaxial(run, others=()):
    """Deviator and filling factor of a Run against the strain of each triaxial test in it; below,
    the circles of Mohr of their strengths, with the line of friction that touches them.

    others: runs of the same scene on other samples: thin circles, and part of the line. Raises
    DustError where there is no test.
    """
    found, more = triaxials(run), [one for other in others for one in triaxials(other)]
    figure, (curves, density, circles) = style.new_figure(
        height=7.2, rows=3, ratios=(1.4, 1.0, 1.1), shared=False
    )
    scale, unit = _stress_unit(np.concatenate([one.deviator for one in found]))
    for number, one in enumerate(found):
        own = style.run_style(number)
        label = f"{one.load / 1e3:.3g} kPa"
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
    circles.set_xlabel(f"normal stress ({unit})")
    circles.set_ylabel(f"shear stress ({unit})")
    circles.set_aspect("equal", adjustable="datalim")
    circles.set_ylim(bottom=0.0)
    return figure


def _circle(test, scale):
    """The upper half of the circle of Mohr of a Triaxial: (normal, shear stress)."""
    turn, radius = np.linspace(0.0, np.pi, 90), 0.5 * test.strength
    middle = test.load + radius
    return (middle + radius * np.cos(turn)) * scale, radius * np.sin(turn) * scale


def _touching(axes, fit, scale):
    """Draws the line that touches circles, of their Friction, where there is one."""
    if fit is None:
        return
    x = np.array([0.0, axes.get_xlim()[1]])
    y = fit.triaxial_cohesion * scale + np.tan(np.radians(fit.triaxial_angle)) * x
    text = f"friction angle {fit.triaxial_angle:.0f}°"
    axes.plot(x, y, color=style.BLACK, linewidth=1.0, label=text)
    style.legend(axes)
