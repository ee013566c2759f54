"""Compression from all sides: the pressure over T19 eq 9 and over Tatsuuma et al. 2023."""

import numpy as np

from dusttaichi.analysis.isotropic import isotropic
from dusttaichi.analysis.numbers.registry import Family, Observable, quiet


def _measure(run):
    found, own = isotropic(run), {}
    for name, ratio in (("", found.ratio_between()), ("dense_", found.dense_ratio_between())):
        if np.isfinite(ratio.value):
            own |= {
                f"{name}ratio": ratio.value,
                f"{name}ratio_scatter": ratio.scatter,
                f"{name}ratio_low": ratio.low,
                f"{name}ratio_high": ratio.high,
            }
    return own


def _text(name):
    def text(value, n):
        covered = f"phi {n[f'{name}_low']:.3g}-{n[f'{name}_high']:.3g}"
        return f"{value:.3g}, scatter {n[f'{name}_scatter']:.2f} dex ({covered})"

    return text


ISOTROPIC = Family(
    name="isotropic",
    title="compression from all sides",
    place=40,
    applies=lambda run: run.shrinks,
    measure=_measure,
    numbers=(
        Observable(name="ratio", title="pressure over (E_roll/r^3) phi^3", text=_text("ratio"),
                   literature="1 (T19 eq 9)", column=("P/(E_roll/r^3 phi^3)", "{:.2f}", 1),
                   short="pressure over T19 eq 9", wanted=3, figure="isotropic",
                   about="pressure over (E_roll/r^3) phi^3 (T19 eq 9)"),
        quiet("ratio_scatter", "its scatter, in decades", short="T19 eq 9: scatter"),
        quiet("ratio_low", "filling factor from which it is compared", short="T19 eq 9: from phi"),
        quiet("ratio_high", "filling factor up to which it is compared", short="T19 eq 9: to phi"),
        Observable(name="dense_ratio", title="… over (E_roll/r^3)(1/phi - 1/0.74)^-3",
                   text=_text("dense_ratio"), literature="1 (Tatsuuma et al. 2023)",
                   column=("P/Tatsuuma 2023", "{:.2f}", 1), short="pressure over Tatsuuma 2023",
                   figure="isotropic", about="pressure over the law of Tatsuuma et al. 2023"),
        quiet("dense_ratio_scatter", "its scatter, in decades", short="Tatsuuma 2023: scatter"),
        quiet("dense_ratio_low", "filling factor from which it is compared",
              short="Tatsuuma 2023: from phi"),
        quiet("dense_ratio_high", "filling factor up to which it is compared",
              short="Tatsuuma 2023: to phi"),
    ),
)  # fmt: skip
FAMILIES = (ISOTROPIC,)
