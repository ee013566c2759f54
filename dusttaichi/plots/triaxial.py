"""Triaxial tests and Mohr's circles of their strengths."""

import numpy as np

from dusttaichi.analysis.loads import friction, load_text
from dusttaichi.analysis.triaxial import is_triaxial, triaxials
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


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
