"""Fragments: their mass spectrum, and the fractal dimension of one of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi.analysis import compute_mass_spectrum as spectrum_of
from dusttaichi.analysis import find_fragments as fragments_of
from dusttaichi.analysis.fragments import fit_fragment_dimension as dimension_of
from dusttaichi.plots import style
from dusttaichi.plots.figure_registry import figure
from dusttaichi.plots.structure import has_box, has_structure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dusttaichi.analysis.fragments import MassSpectrum
    from dusttaichi.analysis.run import Run


@style.apply_style
def mass_spectrum(
    spectra: MassSpectrum | Sequence[MassSpectrum], labels: Sequence[str] | None = None
) -> Figure:
    """Number of fragments of at least a mass against that mass.

    Masses are shares of the mass of all fragments, drawn as steps.

    Parameters
    ----------
    spectra : MassSpectrum or list of MassSpectrum
    labels : list of str, optional
        One for each.
    """
    spectra = list(spectra) if isinstance(spectra, Sequence) else [spectra]
    texts = [""] * len(spectra) if labels is None else list(labels)
    figure, (axes,) = style.create_figure(height=3.4)
    for number, (spectrum, label) in enumerate(zip(spectra, texts, strict=True)):
        # the count holds from below its mass to it
        mass = np.concatenate([spectrum.mass[:1] * 0.8, spectrum.mass]) / spectrum.mass.sum()
        count = np.concatenate([spectrum.count[:1], spectrum.count])
        axes.step(mass, count, where="pre", label=label or None, **style.run_style(number))
        axes.plot(mass[-1], count[-1], "o", ms=4, color=style.run_style(number)["color"])
    style.set_logarithmic(axes)
    axes.set_ylim(0.8, None)
    axes.set(xlabel="mass of the fragment / total mass", ylabel="fragments of at least this mass")
    if any(texts):
        style.draw_legend(axes)
    return figure


@figure("Mass spectrum of the fragments", 31, applies=lambda run: run.collides)
def fragments(run: Run) -> Figure:
    """Mass spectrum of the fragments of a run that `collides`, in its first and last snapshot."""
    spectra = [spectrum_of(fragments_of(run, snapshot)) for snapshot in (0, -1)]
    return mass_spectrum(spectra, ["before", "after"])


@figure(
    "Fractal dimension of the largest fragment",
    132,
    applies=lambda run: has_structure(run) and not has_box(run),
    optional=True,
)
def fragment_dimension(run: Run, snapshot: int = -1, fragment: int = 0) -> Figure:
    """N(<R) of a fragment, with the line whose slope is its fractal dimension.

    Parameters
    ----------
    run : Run
    snapshot : int
    fragment : int
        Its number in the order of decreasing mass.

    Raises
    ------
    DustError
        The fragment is too small.
    """
    counts = dimension_of(run, snapshot, fragment)
    figure, (axes,) = style.create_figure(height=3.4)
    x = counts.radius / counts.grain_radius
    axes.plot(x, counts.number, "o", color=style.BLUE, label=f"{counts.grains} grains")
    line = np.exp(np.mean(np.log(counts.number)) - counts.dimension * np.mean(np.log(x)))
    axes.plot(
        x, line * x**counts.dimension, color=style.ORANGE, label=f"D = {counts.dimension:.2f}"
    )
    style.set_logarithmic(axes)
    axes.set(
        xlabel="R over the mean radius of a grain", ylabel="grains within R of a grain of the core"
    )
    style.draw_legend(axes)
    return figure
