"""Pressure of a cell compressed from all sides, compared with the law of Tatsuuma et al. 2023.

Named by the scenes in this folder under `extensions`; after arXiv:2306.09259.
"""

import numpy as np

from dusttaichi.analysis import isotropic, numbers
from dusttaichi.analysis.numbers.compression import ratio_numbers, ratio_text
from dusttaichi.analysis.numbers.registry import Family, Observable, quiet
from dusttaichi.physics.laws import rolling_energy
from dusttaichi.results.shown import PRESSURES

CLOSEST_PACKING = 0.74  #: Filling factor at which equal spheres cannot be packed closer.
DENSE = 0.105  #: Smallest filling factor of the comparison: no bin of runs to 0.1.


def compressive_strength(phi, surface_energy, radius, critical_rolling):
    """Pressure [Pa] at `phi` up to dense packing, (E_roll/r^3) (1/phi - 1/0.74)^-3.

    `physics.laws.isotropic_pressure` where phi is small. Infinite from 0.74 on.
    """
    scale = rolling_energy(surface_energy, radius, critical_rolling) / radius**3
    with np.errstate(divide="ignore"):
        room = 1.0 / np.asarray(phi, dtype=float) - 1.0 / CLOSEST_PACKING
        return scale * np.maximum(room, 0.0) ** -3.0


def dense_ratio(run, low=DENSE, high=1.0):
    """Ratio of the pressure of a Run to this law, between two filling factors."""
    return isotropic(run, law=compressive_strength).ratio_between(low, high)


DENSE_COMPRESSION = Family(
    name="dense compression",
    title="compression from all sides up to dense packing",
    place=40.5,
    applies=lambda run: run.shrinks,
    measure=lambda run: ratio_numbers("dense_ratio", dense_ratio(run)),
    numbers=(
        Observable(name="dense_ratio", title="… over (E_roll/r^3)(1/phi - 1/0.74)^-3",
                   text=ratio_text("dense_ratio"), literature="1 (Tatsuuma et al. 2023)",
                   column=("P/Tatsuuma 2023", "{:.2f}", 1), short="pressure over Tatsuuma 2023",
                   figure="isotropic",
                   about="pressure over the law of Tatsuuma et al. 2023"),
        quiet("dense_ratio_scatter", "its scatter, in decades", short="Tatsuuma 2023: scatter"),
        quiet("dense_ratio_low", "smallest filling factor of the comparison",
              short="Tatsuuma 2023: from phi"),
        quiet("dense_ratio_high", "largest filling factor of the comparison",
              short="Tatsuuma 2023: to phi"),
    ),
)  # fmt: skip
numbers.register(DENSE_COMPRESSION)
PRESSURES[r"$(E_{\rm roll}/r^3)(1/\phi-1/0.74)^{-3}$, Tatsuuma+ 2023"] = compressive_strength
