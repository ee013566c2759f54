"""Coefficient of restitution against the impact speed."""

import numpy as np

from dusttaichi.plots import style


@style.styled
def restitution(speeds, coefficients, sticking_speed=None, label="run"):
    """Coefficient of restitution against the impact speed.

    Parameters
    ----------
    speeds
        [m/s], (n,).
    coefficients
        (n,), or rows of them with a label each.
    sticking_speed : float, optional
        Speed v_s [m/s]; draws e = sqrt(1 - (v_s/v)^2), the closed form for two grains that lose the
        same energy at any speed, 0 below v_s.
    label : str or list of str
        Label of the coefficients.
    """
    speeds, coefficients = np.asarray(speeds, float), np.asarray(coefficients, float)
    figure, (axes,) = style.new_figure(height=3.4)
    if sticking_speed is not None:
        low, high = min(speeds.min(), sticking_speed) * 0.8, max(speeds.max(), sticking_speed) * 1.2
        # dense where the curve leaves 0 with an upright tangent
        above = sticking_speed + (high - sticking_speed) * np.linspace(0.0, 1.0, 400) ** 3
        closed = np.sqrt(np.maximum(0.0, 1.0 - (sticking_speed / above) ** 2))
        x, y = np.append(low, above), np.append(0.0, closed)
        text = rf"$\sqrt{{1-(v_s/v)^2}}$, $v_s$ = {sticking_speed:.4g} m/s"
        axes.plot(x, y, label=text, **style.look(style.BLACK, 1.2))
    rows = np.atleast_2d(coefficients)
    labels = [label] if isinstance(label, str) else label
    for number, (row, text) in enumerate(zip(rows, labels, strict=True)):
        colour = style.run_style(number)["color"]
        axes.plot(speeds, row, "o", ms=4, color=colour, label=text, clip_on=False, zorder=3)
    style.logarithmic(axes, "x")
    axes.set(ylim=(0.0, 1.02), xlabel="impact speed (m/s)", ylabel="coefficient of restitution")
    style.legend(axes)
    return figure
