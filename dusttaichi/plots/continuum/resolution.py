"""Depth and stopping time of a bead over the spacing of particles, extrapolated to zero."""

import numpy as np

from dusttaichi.analysis.continuum import at_zero_spacing, intrusion
from dusttaichi.plots import style
from dusttaichi.plots.continuum.dust import intrudes
from dusttaichi.plots.registry import figure, in_common


@figure("Depth and stopping time at spacing zero", 178, together=in_common(intrudes))
def resolution(runs):
    """Depth D and stopping time T of one bead over the spacing, without the free-fall term.

    A line for each viscosity at the contact (numerics.viscosity.contact), by least squares, down to
    spacing zero. Runs that ended before the bead stopped are left out.

    Raises
    ------
    DustError
        A run has no rigid projectile.
    """
    found = {}
    for run in runs:
        stop = intrusion(run).without_gravity
        if stop is not None:
            alpha = run.scene["numerics"]["viscosity"]["contact"]
            point = (float(run.attrs["spacing"]), stop.depth * 1e3, stop.time * 1e3)
            found.setdefault(float(alpha), []).append(point)
    figure, axes = style.new_figure(height=5.0, rows=2)
    for number, (alpha, points) in enumerate(sorted(found.items(), reverse=True)):
        spacing, *values = np.array(sorted(points)).T
        look = style.run_style(number)
        for one, value, unit in zip(axes, values, ("mm", "ms"), strict=True):
            label = rf"$\alpha$ = {alpha:g}"
            one.plot(spacing * 1e6, value, "o", color=look["color"], markersize=4)
            if np.ptp(spacing) > 0.0:
                end, slope = at_zero_spacing(spacing, value)
                x = np.array([0.0, spacing.max()])
                one.plot(x * 1e6, end + slope * x, label=f"{label}: {end:.3f} {unit}", **look)
    for one, name in zip(axes, ("depth D (mm)", "stopping time T (ms)"), strict=True):
        one.set(ylabel=name, xlim=(0.0, None))
        if one.get_legend_handles_labels()[0]:
            style.legend(one, title="at spacing zero")
    axes[1].set_xlabel("spacing of particles (µm)")
    return figure
