"""Tensile strength of several runs (T19 Fig 5)."""

import numpy as np

from dusttaichi.analysis import fit_strength
from dusttaichi.analysis import tensile as tensile_of
from dusttaichi.errors import DustError
from dusttaichi.physics import laws
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure, in_common


@figure("Tensile strength", 111, together=in_common(lambda run: run.stretches))
def strength(runs, labels=None):
    """Tensile strength against initial filling factor for several runs, on logarithmic axes.

    With T19 eq 33 for each material among them and, where the runs differ in filling factor, the
    fitted power law. Hollow: the stress had not fallen yet.

    Raises
    ------
    DustError
        Nothing is stretched, or labels do not match the runs.
    """
    runs, labels = style.named(runs, labels)
    return strengths([tensile_of(run) for run in runs], labels, [run.material for run in runs])


@style.styled
def strengths(results, labels, materials):
    """The figure of `strength` of Tensile results, with a label each and the materials of them."""
    if any(t.strength <= 0 for t in results):
        raise DustError(
            "The largest stress of a run is still a pressure: it has no tensile strength to draw."
        )
    figure, (axes,) = style.new_figure()
    scale, unit = style.scaled(max(t.strength for t in results), style.PRESSURES)
    phi = [t.phi_init for t in results]
    line = np.geomspace(0.7 * min(phi), 1.4 * max(phi), 100)
    distinct = {(m.surface_energy, m.radius): m for m in materials if m}
    for number, m in enumerate(distinct.values()):
        law = laws.tensile_strength(line, m.surface_energy, m.radius)
        name = f" ({m.name})" if len(distinct) > 1 else ""
        text = rf"T19 eq 33, $0.12\,(F_{{\rm c}}/r^2)\,\phi^{{1.8}}${name}"
        axes.plot(line, law * scale, label=text, **style.law_style(number + 1, 1.2))
    fit = fit_strength(results) if len(distinct) <= 1 else None
    if fit is not None:
        sigma = "" if np.isnan(fit.exponent_sigma) else rf"\pm{fit.exponent_sigma:.2f}"
        text = rf"fit, $\propto\phi^{{{fit.exponent:.2f}{sigma}}}$"
        axes.plot(line, fit.strength(line) * scale, label=text, **style.look(style.GREY))
    _points(axes, results, labels, scale)
    style.logarithmic(axes)
    axes.set_xlabel(r"initial filling factor $\phi_{\rm init}$")
    axes.set_ylabel(f"tensile strength ({unit})")
    style.legend(axes)
    return figure


def _points(axes, results, labels, scale):
    """A point for each Tensile with its standard error, and the key of hollow points and bars."""
    many = len(results) > len(style.RUN_COLOURS)  # more than there are colours
    for number, (t, label) in enumerate(zip(results, labels, strict=True)):
        colour = style.BLUE if many else style.run_style(number)["color"]
        look = {"fmt": "o", "markersize": 5, "capsize": 2, "color": colour, "label": label}
        look["markerfacecolor"] = colour if t.passed else "white"
        sigma = np.nan_to_num(t.strength_sigma)
        axes.errorbar(t.phi_init, t.strength * scale, sigma * scale, **look)
    if not all(t.passed for t in results):
        hollow = {"marker": "o", "color": "none", "markeredgecolor": style.GREY}
        axes.plot([], [], label="hollow: at least, the stress had not fallen yet", **hollow)
    if any(t.strength_sigma > 0 for t in results):
        axes.plot([], [], "|", color=style.GREY, label="bars: standard error of the average")
