"""Figure of docs/physics.md: normal force and rolling of a contact of two grains of S12."""

import numpy as np

from dusttaichi.physics.contact import jkr_curve
from dusttaichi.physics.contact.constants import PULL_OFF
from dusttaichi.plots import style
from dusttaichi.scene.material import NAMED, Material


@style.apply_style
def draw_contact():
    """Normal force against overlap, and rolling force against displacement to and fro."""
    grain = Material(**NAMED["silicate_s12"])
    reduced_radius = 0.5 * grain.radius
    pull_off_force = 3.0 * np.pi * grain.surface_energy * reduced_radius
    figure, (above, below) = style.create_figure(height=6.0, rows=2, ratios=[1, 1], shared=False)
    colour = style.run_style(0)["color"]
    overlap = np.linspace(-PULL_OFF, 3.0, 400)  # over that at rest
    s = jkr_curve.scaled_radius(overlap)
    force = 4.0 * (s**6 - s**3)  # over the pull-off force
    above.axhline(0.0, color=style.GREY, linewidth=0.8)
    above.plot(overlap, force, color=colour, label="in contact")
    for position, text, look in (
        (0.0, "forms", style.DOTTED),
        (-PULL_OFF, "breaks", style.DASHED),
    ):
        ends = 0.0, np.interp(position, overlap, force)
        above.plot([position] * 2, ends, color=style.BLACK, linestyle=look, label=text)
    above.plot([1.0], [0.0], "o", color=colour, label="at rest")
    above.set(xlabel=r"overlap $\delta/\delta_0$", ylabel=r"normal force $F/F_c$")
    style.draw_legend(above)

    # rolled forth by four limits, and back by five
    limit = grain.critical_rolling
    motion = np.concatenate([np.linspace(0.0, 4.0, 400), np.linspace(4.0, -1.0, 400)])
    displacement, last = [], 0.0
    for step in np.diff(motion, prepend=0.0):
        last = np.clip(last + step, -1.0, 1.0)  # over the limit
        displacement.append(last)
    stiffness = 4.0 * pull_off_force / reduced_radius
    below.axhline(0.0, color=style.GREY, linewidth=0.8)
    for modifier, number in ((8.0, 0), (1.0, 1)):
        # the torque is the reduced radius times this force
        rolling_force = modifier * stiffness * limit * np.array(displacement) * 1e9
        label = rf"$m_r$ = {modifier:g}"
        below.plot(motion, rolling_force, label=label, **style.run_style(number))
    below.set(xlabel=r"rolled distance over $\xi_{\rm crit}$", ylabel="resistance (nN)")
    style.draw_legend(below)
    return figure
