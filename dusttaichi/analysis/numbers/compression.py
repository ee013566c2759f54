"""Compression under a wall: the fit of S12 eq 31, the distance from the law, the onset."""

import numpy as np

from dusttaichi.analysis.compression import (
    compression_curve,
    compression_law,
    fit_compression,
    onset,
    rms_from_law,
)
from dusttaichi.analysis.error_bar import error_bar, filling_factor_error
from dusttaichi.analysis.numbers.registry import (
    ENSEMBLES,
    FILE,
    Family,
    Observable,
    quiet,
    uncertainty,
)
from dusttaichi.analysis.texts import quantity_text
from dusttaichi.errors import DustError

PEAKS = 10
"""Successive records of which PD08 (section 3.1.2) took the largest force."""
AT = (0.2, 0.3, 0.4, 0.45)
"""Filling factors at which comparisons tell pressure and contacts."""
HALF_WIDTH = 0.006
"""Of the filling factor, averaged over."""
QUANTITIES = (
    ("pressure_kpa", "pressure", "kPa", lambda s, grains: s.pressure.sel(wall="top").values / 1e3),
    ("contacts_per_grain", "contacts per grain", "1",
     lambda s, grains: s.contact_count.values / grains),
    ("kinetic_fj_per_grain", "kinetic energy per grain", "fJ",
     lambda s, grains: s.kinetic_translation.values / grains * 1e15),
)  # fmt: skip
AFTER = 12.0  # place of what follows the fits of a fast wall
PD08 = "500 Pa (PD08)"


def _measure(run):
    law, curve, plates = compression_law(run), compression_curve(run), run.boundary == "plates"
    # above 10 kPa small samples spread further than the laboratory's (S12 section 5.3)
    deviation = rms_from_law(curve, law, p_high=1e4 if plates else 1e5)
    found = {
        "law_p_m": law.p_m,
        "law_delta": law.delta,
        "law_name": law.name,
        "rms": deviation.rms,
        "rms_mean": deviation.mean,
        "rms_p_low": deviation.p_low,
        "rms_p_high": deviation.p_high,
        "rms_covered": deviation.covered,
        "onset": onset(curve) if plates else None,
        "onset_peaks": onset(compression_curve(run, peaks=PEAKS)) if _momentary(run) else None,
        "error_bar_phi": filling_factor_error(error_bar(run), curve),
    }
    try:
        fit = fit_compression(curve, phi2=law.phi2)
    except DustError as error:
        return found | {"fit_problem": str(error)}
    if fit.p_m_sigma > fit.p_m or fit.delta_sigma > fit.delta:
        return found | {"fit_problem": "the curve is too short or too rough to fix p_m and Delta"}
    return found | {
        name: getattr(fit, name) for name in ("p_m", "p_m_sigma", "delta", "delta_sigma")
    }


def _momentary(run):
    """Between plates, with pressures of a few steps: what PD08's peaks are taken of."""
    window = run.scene.get("output", {}).get("window", "interval")
    return run.boundary == "plates" and window != "interval" and int(window) <= PEAKS


def _at(run):
    """QUANTITIES at the filling factors AT."""
    series, found = run.part_that("compresses").series, {}
    for value in AT:
        here = np.abs(series.filling_factor.values - value) < HALF_WIDTH
        for name, *_, of in QUANTITIES:
            values = of(series, run.grains)
            found[f"{name}_at_{value:g}"] = values[here].mean() if here.any() else np.nan
    return found


def _deviation_rows(value, n):
    within = "no pressure reached at which they can be compared"
    if n["rms_covered"]:
        within = f"{value:.3f} ({n['rms_p_low'] / 1e3:.3g}-{n['rms_p_high'] / 1e3:.3g} kPa)"
    law = n["law_name"].split(" (")[0] or "the law"
    return [(f"rms of the filling factor from {law}", within, "0.02 (scatter)")]


def _onset_rows(what, beside):
    def rows(value, n):
        return [(what, f"{value:.3g} Pa", beside(n))] if value and np.isfinite(value) else []

    return rows


def _column(name, value):
    """Only the contacts at two filling factors have room in a terminal."""
    shown = name == "contacts_per_grain" and value in (0.3, 0.45)
    return (f"contacts/grain at {value:g}", "{:.2f}", 1) if shown else None


ONSET = "onset of compression"
FIT = Family(
    name="fit",
    title="compression under a wall",
    place=10,
    applies=lambda run: run.compresses,
    measure=_measure,
    numbers=(
        Observable(name="p_m", title="p_m", unit="Pa", symbol=r"$p_{\rm m}$", error="p_m_sigma",
                   why="fit_problem", literature=lambda n: quantity_text(n["law_p_m"], "Pa"),
                   column=("p_m kPa", "{:.1f}", 1e3), wanted=1, figure="compression",
                   about="p_m of S12 eq 31 fitted to phi(P)"),
        uncertainty("p_m_sigma", "Pa", sweeps=FILE, column=("± kPa", "{:.1f}", 1e3)),
        Observable(name="delta", title="Delta", symbol=r"$\Delta$", error="delta_sigma",
                   why="fit_problem", literature=lambda n: f"{n['law_delta']:.3g}",
                   column=("Delta", "{:.2f}", 1), figure="compression",
                   about="Delta of S12 eq 31, in decades of the pressure"),
        uncertainty("delta_sigma", sweeps=FILE, column=("±", "{:.2f}", 1)),
        quiet("law_p_m", "p_m of the law", "Pa", sweeps=FILE),
        quiet("law_delta", "Delta of the law", sweeps=FILE),
        quiet("law_name", "name of the law", ""),
        Observable(name="rms", title="rms of the filling factor from the law",
                   rows=_deviation_rows, column=("rms in phi", "{:.3f}", 1), figure="compression",
                   place=AFTER),
        quiet("rms_mean", "mean distance from the law", sweeps=ENSEMBLES,
              column=("mean in phi", "{:+.3f}", 1), place=AFTER),
        quiet("rms_p_low", "lowest pressure compared", "Pa", sweeps=FILE),
        quiet("rms_p_high", "highest pressure compared", "Pa", sweeps=FILE),
        quiet("rms_covered", "share of these pressures covered",
              column=("law covered", "{:.2f}", 1), sweeps=FILE, place=AFTER),
        Observable(name="fit_problem", title="fit", unit="", column=None, place=AFTER - 0.5,
                   about="why there is no fit"),
        Observable(name="onset", title=ONSET, unit="Pa", place=AFTER,
                   rows=_onset_rows(ONSET, lambda n: PD08 if n["onset_peaks"] is None else "")),
        Observable(name="onset_peaks", title=f"{ONSET}, largest of {PEAKS} records", unit="Pa",
                   rows=_onset_rows(f"{ONSET}, largest of {PEAKS} records", lambda n: PD08),
                   place=AFTER),
        quiet("error_bar_phi", "error of the time step, filling factor at a pressure", None),
    ),
)  # fmt: skip
CURVE = Family(
    name="curve",
    title="at a filling factor",
    place=AFTER,
    applies=lambda run: run.compresses,
    measure=_at,
    compared=True,
    numbers=tuple(
        Observable(name=f"{name}_at_{value:g}", title=f"{title} at filling factor {value:g}",
                   unit=unit, column=_column(name, value))
        for value in AT for name, title, unit, _ in QUANTITIES
    ),
)  # fmt: skip
FAMILIES = (FIT, CURVE)
