"""Several runs side by side: distance from the laboratory, strength, and what lies behind it."""

import csv

import numpy as np
import yaml

from dusttaichi.analysis import dynamic, sphere
from dusttaichi.analysis.arrival import SOUND_UNITS
from dusttaichi.analysis.continuum import numbers as continuum
from dusttaichi.analysis.drive import is_dynamic
from dusttaichi.analysis.summary import summary
from dusttaichi.analysis.tension import missing_strength
from dusttaichi.errors import DustError
from dusttaichi.results.outputs import check

AT = (0.2, 0.3, 0.4, 0.45)  # filling factors at which pressure and contacts are told
HALF_WIDTH = 0.006  # of filling factor, averaged over
DRIVES = ("wall_speed", "face_speed", "strain_rate", "compression_rate", "pressure", "stress")
DRIVES += ("shear_speed", "shear_rate")


def compare(runs, at=AT):
    """Rows (dicts) for runs of any kind, SI, all with the same keys.

    Scene (grains, damping, modifiers, wall_speed, time_step, and the drive of every stage where
    anything else than compression under a wall is among them). Where one of the runs is compressed
    under a wall: p_m, delta and their sigma, rms and mean distance from the laboratory's law with
    the share of 1-100 kPa covered, the pressure on the top wall, contacts a grain and kinetic
    energy a grain at the filling factors `at`. Where one is pressed by a fast wall: the numbers of
    `analysis.dynamic`. Where one is stretched: strength, its sigma,
    filling factor and strain there, phi_init, T19 eq 33 (`strength_law`), strength_passed, or
    strength_problem, why a tensile test has no strength. Where
    one is pressed from all sides: ratio of the pressure to T19 eq 9 and its scatter. Where one is
    of the continuum: its material and resolution, and the numbers of `analysis.continuum.numbers`.
    Where one collides: speed, outcome, fragments, largest_share, growth_efficiency, restitution.
    Where one is pushed: sound_speed and its sigma. Where one is a sphere among grains: its depth,
    stopping time and largest force. Then worst ledger residual, steps, simulated and
    wall time, version. None or nan for what a run has not.
    """
    parts = [part for part in COLUMNS if any(_has(run, part) for run in runs)]
    return [_row(run, parts, at) for run in runs]


def _has(run, part):
    if part == FAST:
        return is_dynamic(run)
    return getattr(run, part) or (part == "stretches" and missing_strength(run) is not None)


def _row(run, parts, at):
    numbers, scene = summary(run), run.scene
    row = {"name": run.name}
    if not run.is_continuum or parts != ["is_continuum"]:
        row |= _of_grains(run, scene)
        if not set(parts) <= {"compresses", FAST}:
            row["drive"] = _drive(scene)
    for part in parts:
        row |= COLUMNS[part](run, numbers, at)
    row["ledger_worst"] = numbers["ledger_worst"]
    row["steps"] = numbers["steps"]
    row["time"] = numbers["time"]
    row["wall_time"] = numbers["wall_time"]
    row["status"] = numbers["status"]
    row["version"] = run.attrs.get("git_commit", run.attrs.get("dusttaichi_version", ""))
    return row


def _of_grains(run, scene):
    interaction = scene.get("interaction", {})
    return {
        "grains": run.grains,
        "damping": interaction.get("damping", {}).get("model", ""),
        "m_r": _modifier(interaction.get("rolling")),
        "m_s": _modifier(interaction.get("sliding")),
        "wall_speed": str(scene.get("boundary", {}).get("wall_speed") or ""),
        "time_step_ns": float(run.attrs.get("time_step", np.nan)) * 1e9,
    }


def _compression(run, numbers, at):
    keys = ("p_m", "p_m_sigma", "delta", "delta_sigma", "rms", "rms_mean", "rms_covered")
    row = {key: numbers[key] for key in keys}
    series = run.part_that("compresses").series
    for value in at:
        here = np.zeros(0, dtype=bool)
        if run.compresses:
            here = np.abs(series.filling_factor.values - value) < HALF_WIDTH
        for name, of in (
            ("pressure_kpa", lambda: series.pressure.sel(wall="top").values / 1e3),
            ("contacts_per_grain", lambda: series.contact_count.values / run.grains),
            ("kinetic_fj_per_grain", lambda: series.kinetic_translation.values / run.grains * 1e15),
        ):
            row[f"{name}_at_{value:g}"] = of()[here].mean() if here.any() else np.nan
    return row


def _dynamic(run, numbers, at):
    return {key: numbers[key] for key in dynamic.UNITS}


def _tension(run, numbers, at):
    keys = (
        "strength",
        "strength_sigma",
        "strength_phi",
        "strength_strain",
        "phi_init",
        "strength_law",
        "strength_passed",
        "strength_problem",
    )
    return {key: numbers[key] for key in keys}


def _isotropic(run, numbers, at):
    return {key: numbers[key] for key in ("ratio", "ratio_scatter", "ratio_low", "ratio_high")}


def _continuum(run, numbers, at):
    return continuum.settings(run) | {key: numbers[key] for key in continuum.NAMES}


def _collision(run, numbers, at):
    keys = ("outcome", "fragments", "largest_share", "growth_efficiency", "restitution")
    info = yaml.safe_load(run.attrs.get("sample", "")) or {}
    return {"speed": info.get("speed") if run.collides else None} | {k: numbers[k] for k in keys}


def _sphere(run, numbers, at):
    return {key: numbers[key] for key in sphere.UNITS}


def _sound(run, numbers, at):
    return {key: numbers[key] for key in SOUND_UNITS}


FAST = "fast wall"
COLUMNS = {
    "compresses": _compression,
    FAST: _dynamic,
    "stretches": _tension,
    "shrinks": _isotropic,
    "collides": _collision,
    "pushes": _sound,
    "has_sphere": _sphere,
    "is_continuum": _continuum,
}


def _drive(scene):
    """What moves and how fast, as the scene has it; of each stage where there are stages."""
    stages = scene.get("stages") or [{"drive": scene.get("boundary", {})}]
    texts = []
    for stage in stages:
        drive = stage.get("drive") or {}
        moved = [f"{key} {_text(drive[key])}" for key in DRIVES if drive.get(key) is not None]
        name = f"{stage['name']}: " if "name" in stage else ""
        texts.extend(f"{name}{text}" for text in moved)
    return "; ".join(texts)


def _modifier(effect):
    return effect.get("modifier") if isinstance(effect, dict) else effect


def to_csv(rows, path):
    """Write the rows of `compare`, numbers with five digits. Raises DustError."""
    check(path, ",".join(list(rows[0])[:5]))
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
    if isinstance(value, (list, tuple)):
        return ", ".join(map(_text, value))
    return f"{value:.5g}" if isinstance(value, float) else str(value)
