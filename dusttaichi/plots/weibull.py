"""Strengths of the samples of a sweep: Weibull plot, and strength against the number of grains."""

import numpy as np

from dusttaichi.analysis.weibull import size_effect, strengths_of
from dusttaichi.plots import style


def weibull(data):
    """The figure of `strength_samples` of a dataset of `analysis.gather`, or None."""
    return strength_samples(strengths_of(data))


@style.styled
def strength_samples(groups):
    """Samples of several Strengths (analysis.weibull); None where none has a Weibull modulus.

    A Weibull plot, in which a Weibull distribution is a straight line with its modulus as slope;
    and, for several sizes, the strengths against the number of grains with their geometric mean,
    the fitted power law and that of a weakest link.
    """
    if not any(group.fit for group in groups):
        return None
    effect = size_effect(groups)
    figure, panels = style.new_grid(1 if effect is None else 2, 2, 3.2)
    scale, unit = style.scaled(max(g.values.max() for g in groups), style.PRESSURES)
    _probabilities(panels[0], groups, scale, unit)
    if effect is not None:
        _sizes(panels[1], groups, effect, (scale, unit))
    return figure


def _probabilities(axes, groups, scale, unit):
    for number, group in enumerate(groups):
        if group.fit is None:
            continue
        colour = style.run_style(number)["color"]
        values = np.sort(group.values)
        # median ranks, which are those of a straight line for a Weibull distribution
        failed = (np.arange(1, len(values) + 1) - 0.3) / (len(values) + 0.4)
        label = f"{group.label or 'all'}: m = {group.fit.modulus:.1f}"
        axes.plot(values * scale, _ordinate(failed), "o", markersize=3.5, color=colour, label=label)
        line = np.geomspace(0.9 * values[0], 1.1 * values[-1], 50)
        axes.plot(
            line * scale, _ordinate(group.fit.share_failed(line)), color=colour, linewidth=1.0
        )
    ticks = np.array([0.02, 0.05, 0.1, 0.2, 0.5, 0.8, 0.95])
    axes.set_yticks(_ordinate(ticks), [f"{tick:g}" for tick in ticks])
    axes.set(xscale="log", xlabel=f"tensile strength ({unit})", ylabel="share of weaker samples")
    axes.set_ylim(*_ordinate(np.array([0.02, 0.98])))
    style.few_ticks(axes.xaxis)
    style.legend(axes)


def _ordinate(share):
    return np.log(-np.log1p(-share))


def _sizes(axes, groups, effect, scaling):
    scale, unit = scaling
    colours = [style.run_style(number)["color"] for number in range(len(groups))]
    for group, colour in zip(groups, colours, strict=True):
        grains = np.full(len(group.values), group.grains)
        dots = {"markersize": 2.5, "markeredgewidth": 0, "alpha": 0.4}
        axes.plot(grains, group.values * scale, "o", color=colour, **dots)
        logs = np.log(group.values)
        mean = np.exp(logs.mean()) * scale
        error = mean * logs.std(ddof=1) / np.sqrt(len(logs)) if len(logs) > 1 else 0.0
        axes.errorbar(group.grains, mean, error, fmt="o", ms=5, capsize=2, color=colour)
    ends = np.array([min(g.grains for g in groups), max(g.grains for g in groups)])
    line = np.geomspace(0.8 * ends[0], 1.25 * ends[1], 50)
    text = rf"fit, $\propto N^{{{effect.exponent:.3f}\pm{effect.exponent_sigma:.3f}}}$"
    axes.plot(line, effect.strength(line) * scale, label=text, **style.look(style.GREY))
    weakest = effect.strength(ends[0]) * (line / ends[0]) ** effect.weakest_link
    text = rf"weakest link, $\propto N^{{{effect.weakest_link:.2f}}}$"
    dashes = style.look(style.BLACK, 1.0, style.DASHED)
    axes.plot(line, weakest * scale, label=text, **dashes)
    axes.set(xscale="log", yscale="log", xlabel="number of grains N")
    axes.set_ylabel(f"tensile strength ({unit})")
    axes.set_xticks(sorted({g.grains for g in groups}), minor=False)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:.0f}")
    axes.xaxis.set_minor_formatter(lambda value, _: "")
    style.few_ticks(axes.yaxis)
    style.legend(axes)
