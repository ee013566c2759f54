"""Compression under a wall or from all sides, and unloading."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.analysis.compression import (
    INNER,
    choose_compression_law,
    find_onset,
    measure_compression_curve,
)
from dusttaichi.analysis.compression_fit import fit_compression, measure_deviation
from dusttaichi.analysis.cycles import Unloading, measure_unloadings
from dusttaichi.analysis.dynamic import PLATEAU, measure_dynamic_compression
from dusttaichi.analysis.isotropic import measure_isotropic_compression
from dusttaichi.analysis.kind import is_dynamic
from dusttaichi.analysis.numbers.number_registry import (
    AUTO,
    ENSEMBLES,
    FILE,
    Family,
    Observable,
    quiet,
    uncertainty,
)
from dusttaichi.analysis.texts import format_quantity
from dusttaichi.errors import DustError
from dusttaichi.results.datasets import read_at

if TYPE_CHECKING:
    from dusttaichi.analysis.isotropic import Ratio
    from dusttaichi.analysis.run import Run
    from dusttaichi.physics.laws import CompressionLaw


PEAKS = 10  #: Successive records whose largest force PD08 (section 3.1.2) took.
AT = (0.2, 0.3, 0.4, 0.45)  #: Filling factors at which comparisons list pressure and contacts.
HALF_WIDTH = 0.006  #: Half of the interval of filling factor for averages.
QUANTITIES = (
    ("pressure_kpa", "pressure", "kPa", lambda s, grains: read_at(s.pressure, wall="top") / 1e3),
    ("contacts_per_grain", "contacts per grain", "1",
     lambda s, grains: s.contact_count.values / grains),
    ("kinetic_fj_per_grain", "kinetic energy per grain", "fJ",
     lambda s, grains: s.kinetic_translation.values / grains * 1e15),
)  # fmt: skip
# pressures [Pa] between plates up to which small samples follow the laboratory (S12 section 5.3),
# else up to which the mean, and over which the largest distance from the law is sought
PLATES, HIGH_MEAN, ALL = 1e4, 1e5, (1e2, 1.5e5)
AFTER = 12.0  # place of the rows behind the fits of a fast wall
PD08 = "500 Pa (PD08)"
FITS = {"plateau": ("plateau", "bins"), "decades": ("whole", "decades")}  # of a fast wall


def _measure(run: Run) -> dict[str, Any]:
    law, curve, plates = (
        choose_compression_law(run),
        measure_compression_curve(run),
        run.boundary == "plates",
    )
    deviation = measure_deviation(curve, law, p_high=_choose_highest_pressure(run))
    overall = measure_deviation(curve, law, ALL[0], PLATES if plates else ALL[1])
    numbers = {
        "law_p_m": law.p_m,
        "law_delta": law.delta,
        "law_name": law.name,
        "rms": deviation.rms,
        "rms_mean": deviation.mean,
        "rms_p_low": deviation.p_low,
        "rms_p_high": deviation.p_high,
        "rms_covered": deviation.covered,
        "largest": overall.largest,
        "largest_p_low": overall.p_low,
        "largest_p_high": overall.p_high,
        "onset": find_onset(curve) if plates else None,
        "onset_peaks": find_onset(measure_compression_curve(run, peaks=PEAKS))
        if _is_momentary(run)
        else None,
    } | _measure_inner_part(run, law)
    try:
        fit = fit_compression(curve, phi2=law.phi2)
    except DustError as error:
        return numbers | {"fit_problem": str(error)}
    if fit.p_m_sigma > fit.p_m or fit.delta_sigma > fit.delta:
        problem = "the curve is too short or too rough to determine p_m and Delta"
        return numbers | {"fit_problem": problem}
    names = ("p_m", "p_m_sigma", "delta", "delta_sigma")
    return numbers | {name: getattr(fit, name) for name in names}


def _choose_highest_pressure(run: Run) -> float:
    """Pressure [Pa] up to which the mean distance from the law is taken."""
    return PLATES if run.boundary == "plates" else HIGH_MEAN


def _measure_inner_part(run: Run, law: CompressionLaw) -> dict[str, Any]:
    """Filling factor of the inner part at the end, and its mean distance from the law."""
    try:
        curve = measure_compression_curve(run, quantity=INNER)
    except DustError:  # neither a cylinder between plates nor profiles
        return {}
    phi = curve.raw_filling_factor
    return {
        "inner_filling_factor": phi[-1] if len(phi) else None,
        "inner_mean": measure_deviation(curve, law, p_high=_choose_highest_pressure(run)).mean,
    }


def _is_momentary(run: Run) -> bool:
    """True between plates for averages over a few steps, the condition of PD08's peaks."""
    window = run.scene.get("output", {}).get("window", "interval")
    return run.boundary == "plates" and window != "interval" and int(window) <= PEAKS


def _measure_at_filling_factors(run: Run) -> dict[str, float]:
    """QUANTITIES at the filling factors AT."""
    series, numbers = run.part_that("compresses").series, {}
    for value in AT:
        is_near = np.abs(series.filling_factor.values - value) < HALF_WIDTH
        for name, *_, extract in QUANTITIES:
            values = extract(series, run.grains)
            numbers[f"{name}_at_{value:g}"] = values[is_near].mean() if is_near.any() else np.nan
    return numbers


def _build_deviation_rows(
    title: str, name: str
) -> Callable[[float, Mapping[str, Any]], list[tuple[str, str, str]]]:
    def rows(value: float, n: Mapping[str, Any]) -> list[tuple[str, str, str]]:
        low, high = n[f"{name}_p_low"], n[f"{name}_p_high"]
        within = "no common range of pressures"
        if np.isfinite(value):
            within = f"{value:.3f} ({low / 1e3:.3g}-{high / 1e3:.3g} kPa)"
        law = n["law_name"].split(" (")[0] or "the law"
        return [(f"{title} of the filling factor from {law}", within, "0.02 (scatter)")]

    return rows


def _choose_column(name: str, value: float) -> tuple[str, str, float] | None:
    """Only the contacts at two filling factors fit into a terminal."""
    shown = name == "contacts_per_grain" and value in (0.3, 0.45)
    return (f"contacts/grain at {value:g}", "{:.2f}", 1) if shown else None


ONSET = "onset of compression"
FIT = Family(
    name="fit",
    title="compression under a wall",
    order=10,
    applies=lambda run: run.compresses,
    measure=_measure,
    numbers=(
        Observable(name="p_m", title="p_m", unit="Pa", symbol=r"$p_{\rm m}$", error="p_m_sigma",
                   reason_row="fit_problem",
                   literature=lambda n: format_quantity(n["law_p_m"], "Pa"),
                   column=("p_m kPa", "{:.1f}", 1e3), trade_rank=1, figure="compression",
                   about="p_m of S12 eq 31 fitted to phi(P)"),
        uncertainty("p_m_sigma", "Pa", sweeps=FILE, column=("± kPa", "{:.1f}", 1e3)),
        Observable(name="delta", title="Delta", symbol=r"$\Delta$", error="delta_sigma",
                   reason_row="fit_problem", literature=lambda n: f"{n['law_delta']:.3g}",
                   column=("Delta", "{:.2f}", 1), figure="compression",
                   about="Delta of S12 eq 31, in decades of the pressure"),
        uncertainty("delta_sigma", sweeps=FILE, column=("±", "{:.2f}", 1)),
        quiet("law_p_m", "p_m of the law", "Pa", sweeps=FILE),
        quiet("law_delta", "Delta of the law", sweeps=FILE),
        quiet("law_name", "name of the law", ""),
        Observable(name="rms", title="rms distance of the filling factor from the law",
                   rows=_build_deviation_rows("rms distance", "rms"), figure="compression",
                   column=("rms distance in phi", "{:.3f}", 1), short="rms distance in phi",
                   order=AFTER),
        quiet("rms_mean", "mean distance from the law", sweeps=ENSEMBLES,
              column=("mean distance in phi", "{:+.3f}", 1), short="mean distance in phi",
              order=AFTER),
        quiet("rms_p_low", "lowest pressure compared", "Pa", sweeps=FILE),
        quiet("rms_p_high", "highest pressure compared", "Pa", sweeps=FILE),
        quiet("rms_covered", "share of these pressures covered",
              column=("range covered", "{:.2f}", 1), sweeps=FILE, order=AFTER),
        Observable(name="largest", title="largest distance from the law",
                   rows=_build_deviation_rows("largest distance", "largest"), figure="compression",
                   column=("largest distance in phi", "{:.3f}", 1),
                   short="largest distance in phi", order=AFTER),
        quiet("largest_p_low", "lowest pressure of this comparison", "Pa", sweeps=FILE),
        quiet("largest_p_high", "highest pressure of this comparison", "Pa", sweeps=FILE),
        Observable(name="inner_filling_factor", title="filling factor of the inner part",
                   text="{:.4f}", column=None, sweeps=FILE, order=AFTER,
                   about="… at the end: without two grain diameters beside both walls (S12 Fig 5), "
                   "between plates PD08's inner cylinder"),
        quiet("inner_mean", "mean distance of the inner part from the law", sweeps=ENSEMBLES,
              short="mean distance in phi, inner part"),
        Observable(name="fit_problem", title="fit", unit="", column=None, order=AFTER - 0.5,
                   about="why there is no fit"),
        Observable(name="onset", title=ONSET, unit="Pa", text="{:.3g} Pa", order=AFTER,
                   literature=lambda n: PD08 if n["onset_peaks"] is None else ""),
        Observable(name="onset_peaks", title=f"{ONSET}, largest of {PEAKS} records", unit="Pa",
                   text="{:.3g} Pa", literature=PD08, order=AFTER),
    ),
)  # fmt: skip
CURVE = Family(
    name="curve",
    title="at a filling factor",
    order=AFTER,
    applies=lambda run: run.compresses,
    measure=_measure_at_filling_factors,
    compared=True,
    numbers=tuple(
        Observable(name=f"{name}_at_{value:g}", title=f"{title} at filling factor {value:g}",
                   unit=unit, column=_choose_column(name, value))
        for value in AT for name, title, unit, _ in QUANTITIES
    ),
)  # fmt: skip


# -- a fast wall ---------------------------------------------------------------------------------


def _measure_fast(run: Run) -> dict[str, float]:
    numbers = dict(vars(measure_dynamic_compression(run, FITS.values())))
    fits = numbers.pop("fits")
    for key, which in FITS.items():
        if (fit := fits[which]) is not None:
            numbers |= {f"p_m_{key}": fit.p_m, f"delta_{key}": fit.delta}
    return {name: value for name, value in numbers.items() if np.isfinite(value)}


def _format_kpa(value: float, n: Mapping[str, Any] | None = None) -> str:
    return f"{value / 1e3:.3g} kPa"


def _format_momentum(n: Mapping[str, Any]) -> str:
    value = n["plateau_momentum"]
    return "" if value is None else f"{_format_kpa(value)} (momentum)"


def _format_front(value: float, n: Mapping[str, Any]) -> str:
    speed = format_quantity(value, "m/s", n["front_speed_sigma"])
    return f"{speed}, phi {n['layer']:.2g} behind it"


LOW, HIGH = PLATEAU
FAST = Family(
    name="fast wall",
    title="a fast wall",
    order=11,
    applies=lambda run: is_dynamic(run) and run.material is not None,
    measure=_measure_fast,
    numbers=(
        Observable(name="p_m_plateau", title=f"… of the bins up to phi {HIGH:g}", unit="Pa",
                   text=_format_kpa, about=f"p_m fitted to the bins up to phi {HIGH:g}",
                   sweeps=ENSEMBLES),
        quiet("delta_plateau", "Delta of these bins", sweeps=ENSEMBLES),
        Observable(name="p_m_decades", title="… with equal weights per decade of pressure",
                   unit="Pa", text=_format_kpa, about="p_m fitted with equal weights per decade of "
                   "pressure", sweeps=ENSEMBLES),
        quiet("delta_decades", "Delta of this fit", sweeps=ENSEMBLES),
        Observable(name="plateau", title=f"plateau of the pressure, phi {LOW:g}-{HIGH:g}",
                   unit="Pa", error="plateau_sigma", literature=_format_momentum,
                   figure="dynamic_speeds"),
        uncertainty("plateau_sigma", "Pa", sweeps=FILE),
        quiet("plateau_momentum", "plateau by the balance of momentum", "Pa", sweeps=ENSEMBLES,
              value="momentum"),
        Observable(name="front_speed", title="compaction front", unit="m/s", text=_format_front,
                   value="front", error="front_speed_sigma", figure="dynamic_speeds"),
        uncertainty("front_speed_sigma", "m/s", value="front_sigma", sweeps=FILE),
        quiet("layer", "filling factor behind the front", short="phi behind the front"),
    ),
)  # fmt: skip


# -- from all sides, and unloading ---------------------------------------------------------------


def list_ratio_numbers(name: str, ratio: Ratio) -> dict[str, float]:
    """Values of the rows of a `Ratio` by their names, {} of one without bins."""
    if not np.isfinite(ratio.value):
        return {}
    ends = {f"{name}_{end}": getattr(ratio, end) for end in ("scatter", "low", "high")}
    return {name: ratio.value} | ends


def build_ratio_text(name: str) -> Callable[[float, Mapping[str, Any]], str]:
    """Text of the row `name` of a `Ratio`, with its scatter and range."""

    def text(value: float, n: Mapping[str, Any]) -> str:
        covered = f"phi {n[f'{name}_low']:.3g}-{n[f'{name}_high']:.3g}"
        return f"{value:.3g}, scatter {n[f'{name}_scatter']:.2f} dex ({covered})"

    return text


ISOTROPIC = Family(
    name="isotropic",
    title="compression from all sides",
    order=40,
    applies=lambda run: run.shrinks,
    measure=lambda run: list_ratio_numbers(
        "ratio", measure_isotropic_compression(run).ratio_between()
    ),
    numbers=(
        Observable(name="ratio", title="pressure over (E_roll/r^3) phi^3",
                   text=build_ratio_text("ratio"), literature="1 (T19 eq 9)",
                   column=("P/(E_roll/r^3 phi^3)", "{:.2f}", 1),
                   short="pressure over T19 eq 9", trade_rank=3, figure="isotropic",
                   about="pressure over (E_roll/r^3) phi^3 (T19 eq 9)"),
        quiet("ratio_scatter", "its scatter, in decades", short="T19 eq 9: scatter"),
        quiet("ratio_low", "smallest filling factor of the comparison", short="T19 eq 9: from phi"),
        quiet("ratio_high", "largest filling factor of the comparison", short="T19 eq 9: to phi"),
    ),
)  # fmt: skip


def _find_last_unloading(run: Run) -> Unloading | dict[str, Any]:
    """The last Unloading with enough records for a modulus, or {}."""
    with_modulus = [
        unloading for unloading in measure_unloadings(run) if np.isfinite(unloading.modulus)
    ]
    return with_modulus[-1] if with_modulus else {}


def _format_modulus(value: float, n: Mapping[str, Any]) -> str:
    text, pressure = format_quantity(value, "Pa", n["release_sigma"]), n["release_pressure"]
    return f"{text} (from {format_quantity(pressure, 'Pa')}, filling factor {n['release_phi']:.3g})"


UNLOADING = Family(
    name="unloading",
    title="unloading",
    order=20,
    applies=lambda run: run.unloads,
    measure=_find_last_unloading,
    numbers=(
        Observable(name="release_modulus", title="unloading modulus", unit="Pa", value="modulus",
                   error="release_sigma", text=_format_modulus, figure="cycles"),
        uncertainty("release_sigma", "Pa", value="modulus_sigma"),
        quiet("release_pressure", "pressure at the start of the unloading", "Pa",
              value="pressure", column=AUTO),
        quiet("release_phi", "filling factor at the start of the unloading",
              value="filling_factor"),
    ),
)  # fmt: skip
FAMILIES = (FIT, FAST, CURVE, UNLOADING, ISOTROPIC)
