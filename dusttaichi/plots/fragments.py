"""Mass spectrum of the fragments of a collision, before and after."""

from dusttaichi.analysis import fragments as fragments_of
from dusttaichi.analysis import mass_spectrum as spectrum_of
from dusttaichi.plots.mass_spectrum import mass_spectrum
from dusttaichi.plots.registry import figure


@figure("Mass spectrum of the fragments", 31, applies=lambda run: run.collides)
def fragments(run):
    """Mass spectrum of the fragments of a run that `collides`, in its first and last snapshot."""
    spectra = [spectrum_of(fragments_of(run, snapshot)) for snapshot in (0, -1)]
    return mass_spectrum(spectra, ["before", "after"])
