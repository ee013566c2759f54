"""Mass spectrum of fragments."""

import numpy as np

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
