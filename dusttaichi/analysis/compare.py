"""Several compression runs side by side: distance from the laboratory, and what lies behind it."""

import csv

import numpy as np

from dusttaichi.analysis.compression import compression_curve
from dusttaichi.analysis.summary import summary
from dusttaichi.errors import DustError

AT = (0.2, 0.3, 0.4, 0.45)  # filling factors at which pressure and contacts are told
HALF_WIDTH = 0.006  # of filling factor, averaged over


def compare(runs, at=AT):
    """Rows (dicts) for runs of closed boxes, SI: scene (grains, damping, wall_speed, time_step),
    p_m, delta and their sigma, rms and mean distance from S12 eq 31 with the share of 1-100 kPa
    covered, pressure on the top wall, contacts a grain and kinetic energy a grain at the filling
    factors `at` (NaN where not reached), worst ledger residual, steps, wall time, version.

    Raises DustError for a run without a compression curve.
    """
    return [_row(run, at) for run in runs]


def _row(run, at):
    compression_curve(run)  # says what is missing where there is no curve
    numbers, scene, series = summary(run), run.scene, run.series
    interaction = scene.get("interaction", {})
    row = {
        "name": run.name,
        "grains": run.grains,
        "damping": interaction.get("damping", {}).get("model", ""),
        "m_r": _modifier(interaction.get("rolling")),
        "m_s": _modifier(interaction.get("sliding")),
        "wall_speed": str(scene.get("boundary", {}).get("wall_speed", "")),
        "time_step_ns": float(run.attrs.get("time_step", np.nan)) * 1e9,
    }
    for key in ("p_m", "p_m_sigma", "delta", "delta_sigma", "rms", "rms_mean", "rms_covered"):
        row[key] = numbers[key]
    phi = series.filling_factor.to_numpy()
    for value in at:
        here = np.abs(phi - value) < HALF_WIDTH
        for name, of in (
            ("pressure_kpa", series.pressure.sel(wall="top").to_numpy() / 1e3),
            ("contacts_per_grain", series.contact_count.to_numpy() / run.grains),
            ("kinetic_fj_per_grain", series.kinetic_translation.to_numpy() / run.grains * 1e15),
        ):
            row[f"{name}_at_{value:g}"] = of[here].mean() if here.any() else np.nan
    row["ledger_worst"] = numbers["ledger_worst"]
    row["steps"] = numbers["steps"]
    row["wall_time"] = numbers["wall_time"]
    row["status"] = numbers["status"]
    row["version"] = run.attrs.get("git_commit", run.attrs.get("dusttaichi_version", ""))
    return row


def _modifier(effect):
    return effect.get("modifier") if isinstance(effect, dict) else effect


def to_csv(rows, path):
    """Write the rows of `compare`, numbers with five digits. Raises DustError."""
    try:
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(rows[0])
            for row in rows:
                writer.writerow([_text(value) for value in row.values()])
    except OSError as error:
        raise DustError(f"{path} cannot be written: {error.strerror}") from error


def _text(value):
    if value is None:
        return ""
    return f"{value:.5g}" if isinstance(value, float) else str(value)
