"""Force on a disc that plates press across its axis (Brazilian test)."""

from dusttaichi.analysis.diametral import diametral as diametral_of
from dusttaichi.analysis.diametral import is_diametral
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure


@figure("Diametral compression", 112, applies=is_diametral, together=True)
def diametral(runs, labels=None):
    """Nominal tension 2 F/(pi D L) against the deflection of one Run or several.

    Lines are means over ten records, points the strengths; hollow: the force has not fallen yet.
    With a single run the records themselves too.
    """
    runs, labels = style.named(runs, labels)
    found = [diametral_of(run) for run in runs]
    figure, (axes,) = style.new_figure()
    scale, unit = style.scaled(max(abs(one.strength) for one in found), style.PRESSURES)
    for number, (one, label) in enumerate(zip(found, labels, strict=True)):
        look = style.run_style(number)
        if len(found) == 1:
            style.records(axes, one.strain, one.stress * scale, number)
        text = rf"{label}, $\phi$ = {one.filling_factor:.3g}"
        axes.plot(one.strain, one.mean * scale, label=text, **look)
        axes.plot(
            one.strength_strain,
            one.strength * scale,
            "o",
            color=look["color"],
            markerfacecolor=look["color"] if one.passed else "white",
            zorder=4,
        )
    if not all(one.passed for one in found):
        hollow = {"marker": "o", "color": "none", "markeredgecolor": style.GREY}
        axes.plot([], [], label="hollow: at least, the force has not fallen yet", **hollow)
    axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    axes.set_xlabel("deflection over the diameter")
    axes.set_ylabel(rf"$2F/(\pi D L)$ ({unit})")
    style.legend(axes)
    return figure
