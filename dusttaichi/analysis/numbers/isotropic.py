"""Compression from all sides: the pressure over T19 eq 9."""

import numpy as np

from dusttaichi.analysis.isotropic import isotropic
from dusttaichi.analysis.numbers.registry import Family, Observable, quiet


def _measure(run):
    ratio = isotropic(run).ratio_between()
    if not np.isfinite(ratio.value):
        return {}
    names = {"ratio": "value", "ratio_scatter": "scatter", "ratio_low": "low", "ratio_high": "high"}
    return {key: getattr(ratio, name) for key, name in names.items()}


def _ratio(value, n):
    covered = f"phi {n['ratio_low']:.3g}-{n['ratio_high']:.3g}"
    return f"{value:.3g}, scatter {n['ratio_scatter']:.2f} dex ({covered})"


ISOTROPIC = Family(
    name="isotropic",
    title="compression from all sides",
    place=40,
    applies=lambda run: run.shrinks,
    measure=_measure,
    numbers=(
        Observable(name="ratio", title="pressure over (E_roll/r^3) phi^3", text=_ratio,
                   literature="1 (T19 eq 9)", column=("P/(E_roll/r^3 phi^3)", "{:.2f}", 1),
                   short="pressure over T19 eq 9", wanted=3, figure="isotropic",
                   about="pressure over (E_roll/r^3) phi^3 (T19 eq 9)"),
        quiet("ratio_scatter", "its scatter, in decades", short="T19 eq 9: scatter"),
        quiet("ratio_low", "filling factor from which it is compared", short="T19 eq 9: from phi"),
        quiet("ratio_high", "filling factor up to which it is compared", short="T19 eq 9: to phi"),
    ),
)  # fmt: skip
FAMILIES = (ISOTROPIC,)
