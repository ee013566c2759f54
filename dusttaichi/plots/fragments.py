"""Figures of collisions and of sound: mass spectrum, dimension, restitution, speed of sound."""

import numpy as np

from dusttaichi.analysis.fragments import fragment_dimension as dimension_of
from dusttaichi.plots import style


@style.styled
def mass_spectrum(spectra, labels=None):
    """Fragments of at least a mass against that mass, for one MassSpectrum or several.

    Masses are shares of the mass of all fragments, drawn as steps. labels: one for each.
    """
    spectra = list(spectra) if isinstance(spectra, (list, tuple)) else [spectra]
    labels = [None] * len(spectra) if labels is None else list(labels)
    figure, (axes,) = style.new_figure(height=3.4)
    for number, (spectrum, label) in enumerate(zip(spectra, labels, strict=True)):
        # the count holds from below its mass to it
        mass = np.concatenate([spectrum.mass[:1] * 0.8, spectrum.mass]) / spectrum.mass.sum()
        count = np.concatenate([spectrum.count[:1], spectrum.count])
        axes.step(mass, count, where="pre", label=label, **style.run_style(number))
        axes.plot(mass[-1], count[-1], "o", ms=4, color=style.run_style(number)["color"])
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(0.8, None)
    style.few_ticks(axes.xaxis)
    style.few_ticks(axes.yaxis)
    axes.set_xlabel("mass of the fragment / total mass")
    axes.set_ylabel("fragments of at least this mass")
    if any(labels):
        style.legend(axes)
    return figure


@style.styled
def sound_speed(arrivals, fit=None, references=()):
    """Speed of sound against distance, a point a grain (PD08 Fig 7).

    arrivals: an Arrival. fit: the SoundSpeed of it, drawn with its error. references: pairs of a
    speed [m/s] and its name, as of theory.
    """
    figure, (axes,) = style.new_figure(height=3.4)
    factor, unit = style.scaled(arrivals.distance.max(), ((1e-3, "mm"), (1e-6, "µm")))
    axes.plot(
        arrivals.distance * factor,
        arrivals.speed,
        "o",
        ms=2.5,
        mew=0,
        alpha=0.7,
        color=style.BLUE,
        label="grains: distance / time",
        zorder=4,
    )
    if fit is not None:
        axes.axhline(
            fit.speed,
            color=style.RED,
            zorder=3,
            label=rf"fit: {fit.speed:.4g} $\pm$ {fit.sigma:.1g} m/s",
        )
        axes.axhspan(
            fit.speed - fit.sigma, fit.speed + fit.sigma, color=style.RED, alpha=0.2, linewidth=0
        )
    for number, (speed, name) in enumerate(references, start=1):
        axes.axhline(
            speed,
            label=name,
            color=style.BLACK,
            linewidth=1.0,
            linestyle=style.RUN_DASHES[number % len(style.RUN_DASHES)],
        )
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, None)
    axes.set_xlabel(f"distance from the push ({unit})")
    axes.set_ylabel("speed of sound (m/s)")
    style.legend(axes)
    return figure


@style.styled
def restitution(speeds, coefficients, sticking_speed=None, label="run"):
    """Coefficient of restitution against the speed of approach [m/s].

    coefficients: as many as speeds, or rows of them with a label each.

    sticking_speed [m/s]: draws e = sqrt(1 - (v_s/v)^2), the closed form for two grains that lose
    the same energy at any speed, 0 below v_s.
    """
    speeds, coefficients = np.asarray(speeds, float), np.asarray(coefficients, float)
    figure, (axes,) = style.new_figure(height=3.4)
    if sticking_speed is not None:
        low, high = min(speeds.min(), sticking_speed) * 0.8, max(speeds.max(), sticking_speed) * 1.2
        # dense where the curve leaves 0 with an upright tangent
        above = sticking_speed + (high - sticking_speed) * np.linspace(0.0, 1.0, 400) ** 3
        closed = np.sqrt(np.maximum(0.0, 1.0 - (sticking_speed / above) ** 2))
        axes.plot(
            np.concatenate([[low], above]),
            np.concatenate([[0.0], closed]),
            color=style.BLACK,
            linewidth=1.2,
            label=r"$\sqrt{1-(v_s/v)^2}$, "
            rf"$v_s$ = {sticking_speed:.4g} m/s",
        )
    rows = np.atleast_2d(coefficients)
    labels = [label] if isinstance(label, str) else label
    for number, (row, text) in enumerate(zip(rows, labels, strict=True)):
        colour = style.run_style(number)["color"]
        axes.plot(speeds, row, "o", ms=4, color=colour, label=text, clip_on=False, zorder=3)
    axes.set_xscale("log")
    style.few_ticks(axes.xaxis)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel("speed of approach (m/s)")
    axes.set_ylabel("coefficient of restitution")
    style.legend(axes)
    return figure


@style.styled
def fragment_dimension(run, snapshot=-1, fragment=0):
    """N(<R) of a fragment of a snapshot of a Run, with the line whose slope is its dimension.

    fragment: its number in the order of falling mass. Raises DustError for one that is too small.
    """
    found = dimension_of(run, snapshot, fragment)
    figure, (axes,) = style.new_figure(height=3.4)
    x = found.radius / found.grain_radius
    axes.plot(x, found.number, "o", color=style.BLUE, label=f"{found.grains} grains")
    line = np.exp(np.mean(np.log(found.number)) - found.dimension * np.mean(np.log(x)))
    axes.plot(x, line * x**found.dimension, color=style.ORANGE, label=f"D = {found.dimension:.2f}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    style.few_ticks(axes.xaxis)
    style.few_ticks(axes.yaxis)
    axes.set_xlabel("R over the mean radius of a grain")
    axes.set_ylabel("grains within R of a grain of the core")
    style.legend(axes)
    return figure
