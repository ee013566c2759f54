"""Shear stress and strength, with the line of friction."""

import numpy as np

from dusttaichi.analysis.loads import friction, load_text, shearings
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
