"""The few numbers that tell how a run went, and the table that shows them."""

import numpy as np

from dusttaichi.analysis import dynamic, sphere
from dusttaichi.analysis.arrival import sound_numbers
from dusttaichi.analysis.compression import (
    compression_curve,
    compression_law,
    fit_compression,
    onset,
    rms_from_law,
)
from dusttaichi.analysis.continuum import numbers as continuum
from dusttaichi.analysis.cycles import releases
from dusttaichi.analysis.error_bar import error_bar, error_bar_rows, filling_factor_error
from dusttaichi.analysis.fragments import compaction, fragments, growth_efficiency
from dusttaichi.analysis.isotropic import isotropic
from dusttaichi.analysis.ledger import ledger
from dusttaichi.analysis.loads import held_loads
from dusttaichi.analysis.outcome import outcome, settled
from dusttaichi.analysis.restitution import restitution
from dusttaichi.analysis.tensile import numbers as tensile_numbers
from dusttaichi.analysis.tensile import rows as tensile_rows
from dusttaichi.analysis.texts import quantity_text, rate_text
from dusttaichi.errors import DustError
from dusttaichi.scene import quantities


def summary(run, law=None):
    """The numbers of a Run as a dict (SI units; None where the run does not have them).

    name, status, grains, contacts, contacts_per_grain, coordination_number, steps, time,
    wall_time, steps_per_second, filling_factor, pressure (top wall), height: at the end;
    ledger_worst (relative), ledger_shares (channel -> share of the losses), error_bar and
    error_bar_phi (see analysis.error_bar);
    p_m, p_m_sigma, delta, delta_sigma and law_p_m, law_delta, law_name beside them;
    rms, rms_mean (signed), rms_p_low, rms_p_high, rms_covered: distance from the law over
    1-100 kPa (between plates 1-10 kPa), see `rms_from_law`; fit_problem: why there is no fit, or
    None; onset between plates, onset_peaks: of the largest of ten momentary pressures, as PD08;
    plateau, front_speed, p_m_plateau ... of a fast wall, see `analysis.dynamic.numbers`;
    release_modulus, release_sigma, release_pressure, release_phi of the last stage that lets go
    and has enough records, see `releases`;
    strength, strength_sigma, strength_phi, strength_strain, strength_passed, phi_init and
    strength_law of a sample that is stretched, see `tensile`, or strength_problem: why it has none;
    ratio, ratio_scatter, ratio_low, ratio_high of one pressed from all sides, see `isotropic`;
    missed_loads: (stage, pressure, wanted) [Pa] of each load not reached at the end of its stage;
    outcome (see `analysis.outcome`), settled (the last two snapshots hold the same fragments),
    fragments, largest_share (of the mass),
    growth_efficiency, compaction, restitution of a collision between its first and last snapshot;
    sound_speed, sound_speed_sigma after a push;
    of a run of the continuum those of `analysis.continuum.numbers`.
    law: the CompressionLaw to compare with (default: `compression_law`, by the boundary).
    """
    series = run.series
    numbers = {"name": run.name, "status": run.status, "grains": run.grains}
    last = series.isel(time=-1) if len(series.time) else None

    def final(name):
        return float(last[name]) if last is not None and name in series else None

    contacts, steps, wall_time = final("contact_count"), final("step"), final("wall_clock")
    numbers |= {
        "contacts": None if contacts is None else int(contacts),
        "contacts_per_grain": None if contacts is None or not run.grains else contacts / run.grains,
        "coordination_number": final("coordination_number"),
        "steps": None if steps is None else int(steps),
        "time": final("time"),
        "wall_time": wall_time,
        "steps_per_second": steps / wall_time if steps and wall_time else None,
        "filling_factor": final("filling_factor"),
        "height": final("height"),
        "pressure": _top_pressure(last) if last is not None else None,
    }
    energies = ledger(run)
    numbers |= {
        "ledger_worst": energies.worst,
        "ledger_shares": energies.shares,
        "error_bar": error_bar(run),
        "error_bar_phi": None,
    }
    if run.compresses and numbers["error_bar"] is not None:
        curve = compression_curve(run)
        numbers["error_bar_phi"] = filling_factor_error(numbers["error_bar"], curve)
    numbers |= _compression(run, law) | dynamic.numbers(run) | _release(run) | tensile_numbers(run)
    missed = [held for held in held_loads(run) if held.missed]
    numbers["missed_loads"] = [(held.stage, held.pressure, held.wanted) for held in missed]
    numbers |= _isotropic(run) | _collision(run) | sphere.numbers(run) | sound_numbers(run)
    return numbers | continuum.numbers(run)


FIT_ERRORS = ("p_m_sigma", "delta_sigma", "plateau_sigma", "front_speed_sigma", "strength_sigma")
FIT_ERRORS += ("release_sigma", "sound_speed_sigma")
ONE_SAMPLE = "one sample: fit error only; replicas show the scatter between samples"


def _top_pressure(last):
    """Pressure on the top wall [Pa] in a record; None where there is none."""
    value = float(last.pressure.sel(wall="top")) if "pressure" in last else np.nan
    return value if np.isfinite(value) else None


_COMPRESSION = (
    "p_m",
    "p_m_sigma",
    "delta",
    "delta_sigma",
    "law_p_m",
    "law_delta",
    "law_name",
    "rms",
    "rms_mean",
    "rms_p_low",
    "rms_p_high",
    "rms_covered",
    "fit_problem",
    "onset",
    "onset_peaks",
)


PEAKS = 10
"""Successive records of which PD08 (section 3.1.2) took the largest force."""


def _momentary(run):
    """Between plates, with pressures of a few steps: what PD08's peaks are taken of."""
    window = run.scene.get("output", {}).get("window", "interval")
    return run.boundary == "plates" and window != "interval" and int(window) <= PEAKS


def _compression(run, law):
    numbers = dict.fromkeys(_COMPRESSION)
    if not run.compresses:
        return numbers
    law = compression_law(run) if law is None else law
    curve = compression_curve(run)
    plates = run.boundary == "plates"
    # above 10 kPa small samples spread further than the laboratory's (S12 section 5.3)
    deviation = rms_from_law(curve, law, p_high=1e4 if plates else 1e5)
    numbers |= {
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
    }
    try:
        fit = fit_compression(curve, phi2=law.phi2)
    except DustError as error:
        return numbers | {"fit_problem": str(error)}
    if fit.p_m_sigma > fit.p_m or fit.delta_sigma > fit.delta:
        return numbers | {"fit_problem": "the curve is too short or too rough to fix p_m and Delta"}
    return numbers | {
        "p_m": fit.p_m,
        "p_m_sigma": fit.p_m_sigma,
        "delta": fit.delta,
        "delta_sigma": fit.delta_sigma,
    }


_RELEASE = {"release_modulus": "modulus", "release_sigma": "modulus_sigma"}
_RELEASE |= {"release_pressure": "pressure", "release_phi": "filling_factor"}


def _release(run):
    """The last stage that lets go, of those with enough records for a modulus."""
    known = [r for r in releases(run) if np.isfinite(r.modulus)] if run.unloads else []
    return {key: getattr(known[-1], name) if known else None for key, name in _RELEASE.items()}


def _isotropic(run):
    ratio = isotropic(run).ratio_between() if run.shrinks else None
    if ratio is None or not np.isfinite(ratio.value):
        return dict.fromkeys(("ratio", "ratio_scatter", "ratio_low", "ratio_high"))
    return {
        "ratio": ratio.value,
        "ratio_scatter": ratio.scatter,
        "ratio_low": ratio.low,
        "ratio_high": ratio.high,
    }


_COLLISION = (
    "outcome",
    "settled",
    "fragments",
    "largest_share",
    "growth_efficiency",
    "compaction",
    "restitution",
)


def _collision(run):
    numbers = dict.fromkeys(_COLLISION)
    if not run.collides:
        return numbers
    bodies, parts = run.bodies(), fragments(run)
    numbers |= {
        "fragments": len(parts),
        "largest_share": float(parts.mass[0] / parts.mass.sum()),
        "growth_efficiency": growth_efficiency(run, bodies=bodies),
    }
    if min(len(body) for body in bodies) > 2:  # R_g of one or two grains tells of no volume
        numbers["compaction"] = compaction(run).ratio
    numbers |= {"outcome": outcome(run, parts, bodies), "settled": settled(run)}
    if numbers["outcome"] not in ("sticking", "growth", "bouncing"):
        return numbers  # bodies that break up pass through each other: there is no normal
    try:
        return numbers | {"restitution": restitution(run, bodies=bodies).coefficient}
    except DustError:  # they pass each other, or have not met yet
        return numbers


def _collision_rows(n, row):
    if n["outcome"] is None:
        return
    share = f"{n['largest_share']:.1%} of the mass in the largest"
    row(
        "outcome",
        n["outcome"],
        lambda v: f"{v}, {n['fragments']} fragments, {share}" if n["fragments"] > 1 else v,
    )
    if not n["settled"]:
        row("note", "the last two snapshots differ in their fragments: let it run on", str)
    row("growth efficiency", n["growth_efficiency"], "{:.3f}".format)
    row("compaction of the largest fragment", n["compaction"], "{:.3f}".format)
    row("coefficient of restitution", n["restitution"], "{:.4f}".format)


def _duration(seconds):
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {seconds:02d} s"


def _isotropic_rows(n, row):
    if n["ratio"] is None:
        return
    scatter, covered = n["ratio_scatter"], f"phi {n['ratio_low']:.3g}-{n['ratio_high']:.3g}"
    row(
        "pressure over (E_roll/r^3) phi^3",
        n["ratio"],
        lambda v: f"{v:.3g}, scatter {scatter:.2f} dex ({covered})",
        "1 (T19 eq 9)",
    )


def table(numbers):
    """Rows (what, run, literature) of text for a summary, in the order to print them.

    What the run does not have is left out.
    """
    n, rows = numbers, []

    def row(what, value, text, laboratory=""):
        if value is not None:
            rows.append((what, text(value), laboratory))

    row("status", n["status"], str)
    if n["p_m"] is not None:
        law_p_m, law_delta = quantity_text(n["law_p_m"], "Pa"), f"{n['law_delta']:.3g}"
        row("p_m", quantity_text(n["p_m"], "Pa", n["p_m_sigma"]), str, law_p_m)
        row("Delta", quantity_text(n["delta"], "1", n["delta_sigma"]), str, law_delta)
    dynamic.rows(n, row)
    row("fit", n["fit_problem"], str)
    if n["rms"] is not None:
        within = "no pressure reached at which they can be compared"
        if n["rms_covered"]:
            within = f"{n['rms']:.3f} ({n['rms_p_low'] / 1e3:.3g}-{n['rms_p_high'] / 1e3:.3g} kPa)"
        law = n["law_name"].split(" (")[0] or "the law"
        row(f"rms of the filling factor from {law}", within, str, "0.02 (scatter)")
    for key, what in (("onset", ""), ("onset_peaks", f", largest of {PEAKS} records")):
        onset_ = n[key] if n[key] and np.isfinite(n[key]) else None
        beside = "500 Pa (PD08)" if key == "onset_peaks" or n["onset_peaks"] is None else ""
        row(f"onset of compression{what}", onset_, lambda v: f"{v:.3g} Pa", beside)
    if n["release_modulus"] is not None:
        text = quantity_text(n["release_modulus"], "Pa", n["release_sigma"])
        pressure = quantity_text(n["release_pressure"], "Pa")
        where = f"from {pressure}, filling factor {n['release_phi']:.3g}"
        row("modulus where it is let go", f"{text} ({where})", str)
    tensile_rows(n, row)
    _isotropic_rows(n, row)
    _collision_rows(n, row)
    sphere.rows(n, row)
    if n["sound_speed"] is not None:
        row("speed of sound", quantity_text(n["sound_speed"], "m/s", n["sound_speed_sigma"]), str)
    continuum.rows(n, row)
    if any(n.get(name) is not None and np.isfinite(n[name]) for name in FIT_ERRORS):
        row("± of the numbers above", ONE_SAMPLE, str)
    row("filling factor", n["filling_factor"], "{:.4f}".format)
    row("pressure on the top wall", n["pressure"], lambda v: f"{v / 1e3:.4g} kPa")
    for stage, pressure, wanted in n["missed_loads"]:
        there, asked = (quantity_text(p, "Pa") for p in (pressure, wanted))
        row(f"load at the end{f' of {stage}' if stage else ''}", f"{there}, {asked} asked for", str)
    row("worst residual of the energy ledger", n["ledger_worst"], "{:.1e}".format)
    rows.extend(error_bar_rows(n["error_bar"], n["error_bar_phi"]))
    row("grains", n["grains"], "{:,}".format)
    row("contacts", n["contacts"], "{:,}".format)
    around = n["coordination_number"]
    shared = "" if around is None else f" (coordination number {around:.2f}: each has two grains)"
    row("contacts per grain", n["contacts_per_grain"], lambda v: f"{v:.2f}{shared}")
    row("steps", n["steps"], "{:,}".format)
    row("simulated time", n["time"], lambda v: quantities.format(v, "time", 5))
    row("wall time", n["wall_time"], _duration)
    row("steps per second", n["steps_per_second"], rate_text)
    return rows
