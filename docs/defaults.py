"""Defaults beside the settings of the validation: `python docs/defaults.py [SCENE ...]`.

docs/defaults.yaml has the plainest scene of each kind, its main number and the careful settings.
Each is run as it is and with these; a row of each goes to docs/validation/defaults.csv.
"""

import json
from pathlib import Path

import numpy as np
import yaml
from scipy.stats import t as student
from tables import update

from dusttaichi import analysis
from dusttaichi.analysis.summary import summarise
from dusttaichi.errors import DustError, GuardStop, Interrupted
from dusttaichi.physics.geometry import WALLS
from dusttaichi.running import execute
from dusttaichi.scene import Scene

HERE = Path(__file__).parent
CASES = yaml.safe_load((HERE / "defaults.yaml").read_text())
TOP = WALLS.index("top")
ALONE = {"numerics.threads": 1}


def series(name, take):
    """Number of a run: `take` of a variable of its series."""
    return lambda run: float(take(run.series[name].values))


# numbers that the registry does not have
NUMBERS = {
    "end_pressure": series("pressure", lambda p: p[-1, TOP]),
    "end_stress": series("stress", lambda s: -s[-1, 2, 2]),
    "end_force": series("wall_force", lambda f: np.abs(f[-20:, TOP, 2]).mean()),
    "largest_tension": series("pressure", lambda p: -np.nanmin(p[:, TOP])),
    "largest_pull": series("stress_mean", lambda s: s[:, 2].max()),
    "largest_mean_filling": series("filling_factor_mean", np.max),
    "largest_sag": series("body_position", lambda x: x[0, 0, 2] - x[:, 0, 2].min()),
    "energy_kept": lambda run: float(np.divide(*(_energy(run)[k] for k in (-1, 0)))),
    "shear_share": lambda run: summarise(run)["ledger_shares"]["shear"],
    "body_rebound": series("body_velocity", lambda v: -v[-1, 0, 2] / v[0, 0, 2]),
    "grain_rebound": series("kinetic_translation", lambda e: (e[-1] / e[0]) ** 0.5),
}


def _energy(run):
    return (run.series.kinetic + run.series.elastic_energy).values


def measure_case(case, changes, folder):
    """Values of the number of a case with changes of its scene, one for each seed; or a text."""
    values = []
    for seed in case.get("seeds") or [None]:
        seed_change = changes | ({} if seed is None else {case.get("seed", "sample.seed"): seed})
        try:
            scene = Scene.from_dict({"name": "defaults"} | case["scene"], HERE)
            run = execute(scene.with_values(seed_change | ALONE), folder, force=True)
            run = analysis.open_run(run)
            number = NUMBERS.get(case["number"])
            value = number(run) if number else summarise(run)[case["number"]]
        except GuardStop as stop:
            return f"stopped by a guard: {stop}"
        except Interrupted:
            raise
        except DustError as error:
            return str(error)
        if value is None:
            return _explain_missing(summarise(run))
        values.append(float(value))
    return np.array(values)


def _explain_missing(numbers):
    """Why a run has no number, as its table says."""
    missed = numbers["missed_loads"]
    return "load missed" if missed else "none: " + numbers["status"]


def row(name, case, settings, plain, careful):
    """Row of the table: both values, their difference and the verdict."""
    limit, absolute = case["error"], case.get("absolute", False)
    cells = [format_mean(plain), format_settings(settings), format_mean(careful)]
    error = f"{limit:g}" if absolute else f"{limit:.2%}"
    difference, verdict = "", "differs"
    if isinstance(plain, str) and isinstance(careful, str):
        verdict = "no number"
    if not isinstance(plain, str) and not isinstance(careful, str):
        change = plain - careful
        if not absolute:
            change = change / np.abs(careful.mean())
        mean_change, spread = change.mean(), 0.0
        if len(change) > 1:
            spread = change.std(ddof=1) / len(change) ** 0.5
        form = "{:+.2g}" if absolute else "{:+.2%}"
        difference = form.format(mean_change) + (
            f" ± {form[:-1].replace('+', '')}}}".format(spread) if spread else ""
        )
        if abs(mean_change) <= limit:
            verdict = "agrees"
        elif len(change) > 1 and abs(mean_change) <= student.ppf(0.975, len(change) - 1) * spread:
            verdict = "within the scatter"
    return [name, case["about"], case["number"], *cells, difference, error, verdict]


def format_mean(values):
    """Mean of the values of the seeds."""
    return values if isinstance(values, str) else f"{values.mean():.4g}"


def format_settings(settings):
    """Settings as the YAML has them."""
    return ", ".join(
        f"{key}: {value if isinstance(value, str) else json.dumps(value)}"
        for key, value in settings.items()
    )


def rows(name, folder):
    """Rows of a case, one for each of its careful settings."""
    case = CASES[name]
    plain = measure_case(case, {}, folder)
    return [row(name, case, s, plain, measure_case(case, s, folder)) for s in case["careful"]]


if __name__ == "__main__":
    update("defaults.csv", CASES, rows)
