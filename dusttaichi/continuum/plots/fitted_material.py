"""A fitted material of the continuum beside the grain runs that it was fitted to."""

import numpy as np

from dusttaichi.continuum.physics import elasticity, strength
from dusttaichi.physics.laws import G09_OMNIDIRECTIONAL, tensile_strength_laboratory
from dusttaichi.plots import style

CALIBRATED = 1.3e3  #: p_m of G09's law for the pressure, by the bead (section 4.2) [Pa].

_MARKS = ("o", "s", "^", "D", "v", "P")


@style.apply_style
def continuum_fit(fit):
    """Four panels over the filling factor: pressures, shear, slopes and tension of a Fit.

    Points are the grains', one mark for each seed; lines are the material's.
    """
    figure, axes = style.create_figure(height=9.0, rows=4)
    phi = np.linspace(*_range(fit), 200)
    m = fit.numbers
    seeds = sorted({test.seed for test, _ in fit.rows})
    reference = phi * m.rho_s

    def points(panel, quantity, colour, label):
        for number, seed in enumerate(seeds):
            observations = [o for t, o in fit.rows if o.quantity == quantity and t.seed == seed]
            panel.plot(
                [observation.phi for observation in observations],
                [observation.value / 1e3 for observation in observations],
                _MARKS[number % len(_MARKS)],
                markersize=3.5,
                color=colour,
                markerfacecolor="none",
                label=f"{label}, grains" if number == 0 else "_",
            )

    def line(panel, values, colour, label, dashes="-"):
        panel.plot(phi, np.asarray(values) / 1e3, color=colour, linestyle=dashes, label=label)

    points(axes[0], "p", style.BLUE, "pressure")
    line(axes[0], strength.compressive(phi, m), style.BLUE, "Σ of the material")
    line(axes[0], strength.compute_confined(phi, m), style.RED, "axial stress of it, Σ + 2Y/3")
    law = G09_OMNIDIRECTIONAL.pressure(phi)
    line(axes[0], law, style.BLACK, "G09, 13 kPa (laboratory, axial)", "--")
    line(axes[0], law * CALIBRATED / G09_OMNIDIRECTIONAL.p_m, style.GREY, "G09, 1.3 kPa (Σ)", ":")
    points(axes[1], "q", style.ORANGE, "axial less side stress")
    line(axes[1], strength.shear(phi, m), style.ORANGE, "Y of the material")
    K, mu = elasticity.bulk_modulus(reference, m), elasticity.shear_modulus(reference, m)
    points(axes[2], "M", style.GREEN, "axial slope M")
    line(axes[2], K + 4 / 3 * mu, style.GREEN, "K + 4μ/3 of the material")
    points(axes[2], "lambda", style.PURPLE, "side slope λ")
    line(axes[2], K - 2 / 3 * mu, style.PURPLE, "K - 2μ/3 of the material")
    points(axes[3], "tension", style.SKY, "largest mean tension")
    line(axes[3], -strength.tensile(phi, m), style.SKY, "|T| of the material")
    line(
        axes[3], tensile_strength_laboratory(phi), style.BLACK, "laboratory, G09 eq 8 (axial)", "--"
    )
    for panel in axes:
        panel.set_yscale("log")
        style.draw_legend(panel)
    for panel, text in zip(axes, ("stress", "shear stress", "modulus", "tension"), strict=True):
        panel.set_ylabel(f"{text} (kPa)")
    style.set_few_ticks(axes[3].yaxis)
    axes[-1].set_xlabel(r"filling factor $\phi$")
    return figure


def _range(fit):
    phi = [observation.phi for _, observation in fit.rows]
    return min(phi), max(phi)


@style.apply_style
def pressing_speeds(curves):
    """Axial stress and mean pressure over the filling factor at each rate of pressing, beside G09.

    curves: of analysis.continuum_observations.curves.
    """
    figure, axes = style.create_figure(height=6.4, rows=2)
    groups = {}
    for curve in curves:
        groups.setdefault((curve.rate, curve.grains), []).append(curve)
    phi = np.linspace(0.16, 0.42, 200)
    law = G09_OMNIDIRECTIONAL.pressure(phi) / 1e3
    calibrated = law * CALIBRATED / G09_OMNIDIRECTIONAL.p_m
    axes[0].plot(phi, law, "--", color=style.BLACK, label="laboratory, G09: 13 kPa")
    axes[1].plot(phi, law, "--", color=style.BLACK, label="G09's 13 kPa as Σ")
    axes[1].plot(phi, calibrated, ":", color=style.BLACK, label="G09's Σ: 1.3 kPa")
    for number, ((rate, grains), group) in enumerate(sorted(groups.items())):
        colour = style.RUN_COLOURS[number % len(style.RUN_COLOURS)]
        text = "at rest" if rate == 0 else _rate(rate)
        for panel, which in zip(axes, ("axial", "p"), strict=True):
            pressures = [p_m for curve in group if np.isfinite(p_m := curve.p_m(which))]
            number_text = (
                f"{np.exp(np.log(pressures).mean()) / 1e3:.1f} kPa" if pressures else "none"
            )
            label = f"{text}, {grains} grains: {number_text}" if which == "axial" else number_text
            for n, curve in enumerate(group):
                panel.plot(
                    curve.phi,
                    getattr(curve, which) / 1e3,
                    "o" if rate == 0 else "-",
                    color=colour,
                    markersize=3.5,
                    linewidth=1.0,
                    label="_" if n else label,
                )
    for panel, text in zip(axes, ("axial stress", "mean pressure"), strict=True):
        panel.set(yscale="log", ylabel=f"{text} (kPa)", ylim=(0.02, 60))
    style.draw_legend(axes[0], title=r"nearest $p_{\rm m}$ of G09's law")
    style.draw_legend(axes[1], title="the same, colours as above", ncols=2)
    axes[-1].set_xlabel(r"filling factor $\phi$")
    return figure


def _rate(rate):
    """A rate [1/s] as a label."""
    first, power = f"{rate:.1e}".split("e")
    first = "" if first == "1.0" else rf"{first.removesuffix('.0')} \times "
    return f"${first}10^{{{int(power)}}}$ s$^{{-1}}$"
