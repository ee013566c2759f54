"""Rotation rate and largest fragment of an aggregate during a spin-up."""

from dusttaichi.analysis.spin_up import WHOLE, is_spun
from dusttaichi.analysis.spin_up import spin_up as spin_up_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Spin-up", 116, applies=is_spun, together=True)
def spin_up(runs, labels=None):
    """Rotation rate and largest fragment of one run or several.

    The rate is drawn against that of a rigid body with the same angular momentum, which is the
    dotted line; the dashed line is the share below which an aggregate counts as broken. Curves end
    with the first snapshot of the broken aggregate.
    """
    runs, labels = style.named(runs, labels)
    figure, (axes, below) = style.new_figure(height=4.6, rows=2)
    found = [spin_up_of(run) for run in runs]
    for number, (one, label) in enumerate(zip(found, labels, strict=True)):
        look = style.run_style(number)
        given, rate, share = (a[: one.shown] for a in (one.given, one.rate, one.share))
        axes.plot(given / 1e6, rate / 1e6, label=label, **look)
        below.plot(given / 1e6, share, **look)
    largest = max(float(one.given[: one.shown].max()) for one in found) / 1e6
    rigid = [0.0, largest]
    axes.plot(rigid, rigid, **style.look(style.GREY, 1.0, style.DOTTED))
    below.axhline(WHOLE, **style.look(style.GREY, 1.0, style.DASHED))
    below.set_ylim(0.0, 1.05)
    below.set_xlabel(r"$L/I_0$ ($10^6$ rad/s)")
    axes.set_ylabel(r"rotation rate ($10^6$ rad/s)")
    below.set_ylabel("share of the mass\nin the largest fragment")
    style.legend(axes)
    return figure
