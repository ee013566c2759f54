"""Cost against error of settings over their seeds, one panel for each scene."""

import numpy as np

from dusttaichi.analysis.grid import AS_IT_IS, text_of
from dusttaichi.plots import style

KINDS = (  # parameters in the settings -> colour, marker, label
    (("accuracy",), style.BLACK, "*", "preset"),
    (("stiffness_scaling",), style.RED, "s", "stiffness"),
    (("mass_scaling",), style.ORANGE, "s", "mass"),
    (("speed",), style.BLUE, "s", "speed"),
    (("step_fraction",), style.GREEN, "o", "step"),
    (("mass_scaling", "stiffness_scaling"), style.PURPLE, "D", "stiffness and mass"),
    (("speed", "stiffness_scaling"), style.SKY, "D", "stiffness and speed"),
    (("step_fraction", "stiffness_scaling"), style.YELLOW, "D", "stiffness and step"),
)
OTHER = (style.BLACK, "D", "three or more")
COLUMNS = 2


@style.styled
def grid(outcomes, observables=()):
    """The figure of Outcomes (analysis.grid): a panel for each scene.

    A panel shows the first of `observables` that the scene has, else its first. Dashed: a fifth of
    the cost; bars: standard errors; open: of a single seed.
    """
    panels = {}
    for o in outcomes:
        if not o.refused and o.settings != AS_IT_IS:
            panels.setdefault((o.scene, o.grains), {}).setdefault(o.observable, []).append(o)
    figure, axes = style.new_grid(len(panels), COLUMNS, height=2.3)
    handles = {}
    for place, ((scene, grains), found) in zip(axes, panels.items(), strict=True):
        name = next((n for n in observables if n in found), next(iter(found)))
        _panel(place, found[name])
        title = f"{scene.removeprefix('trade_')}, {grains} grains:\n{text_of(name)}"
        place.set_title(title, fontsize=7)
        handles |= dict(zip(*reversed(place.get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles, loc="outside lower center", ncols=4, fontsize=7)
    return figure


def _panel(axes, outcomes):
    scatter = outcomes[0].scatter
    errors = np.array([max(o.error, 1e-4) for o in outcomes])
    axes.axhspan(1e-5, scatter, color=style.GREY, alpha=0.18, linewidth=0, label="scatter of seeds")
    axes.axvline(0.2, **style.look(style.BLACK, 0.8, (0, (5, 2))))
    for o, error in zip(outcomes, errors, strict=True):
        colour, marker, label = _look(o.settings)
        open_ = {"markerfacecolor": "white"} if o.seeds < 2 else {}
        bar = 0.0 if np.isnan(o.uncertainty) else o.uncertainty
        bars = [[min(bar, 0.9 * error)], [bar]]  # on a logarithmic axis
        look = open_ | {"color": colour, "markersize": 7 if marker == "*" else 4}
        axes.errorbar(o.cost, error, bars, fmt=marker, label=label, elinewidth=0.8, **look)
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("steps over those as it is", fontsize=7)
    axes.set_ylabel("error of the mean", fontsize=7)
    axes.set_xlim(min(0.05, 0.8 * min(o.cost for o in outcomes)), 1.2)
    axes.tick_params(labelsize=7, which="both")
    style.few_ticks(axes.xaxis)
    axes.set_ylim(0.5 * min(errors.min(), scatter), 2.0 * max(errors.max(), scatter))


def _look(settings):
    varied = tuple(sorted(part.split()[0] for part in settings.split(", ")))
    return next((look for parameters, *look in KINDS if parameters == varied), OTHER)
