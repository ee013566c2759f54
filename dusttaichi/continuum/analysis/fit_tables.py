"""Material, tables and numbers of `dust fit continuum`, from run directories."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from pydantic import ValidationError

from dusttaichi.analysis.run import open_run
from dusttaichi.continuum.analysis import material_fit
from dusttaichi.continuum.analysis.grain_tests import grain_test
from dusttaichi.continuum.analysis.material_fit import PARAMETERS, quantities
from dusttaichi.continuum.analysis.observations import QUANTITIES, curves, speeds
from dusttaichi.continuum.scene.material import ContinuumMaterial
from dusttaichi.errors import DustError
from dusttaichi.results.files import RESULT

DIGITS = 4
DIMENSION = 3  # of the grains, and of the stresses and strains of the point that is fitted
_SEEN_IN = {
    "bulk_modulus": ("M", "lambda"), "exponent": ("M", "lambda"), "shear_ratio": ("M", "lambda"),
    "compressive.p_m": ("p",), "compressive.delta": ("p",), "compressive.phi_1": ("p",),
    "shear.factor": ("q",), "shear.exponent": ("q",), "tensile.a": ("tension",),
    "tensile.b": ("tension",),
}  # fmt: skip


def result_files(paths):
    """Result files of runs, or of all runs in folders of replicas. Raises DustError."""
    files = []
    for path in map(Path, paths):
        file = path if path.suffix == ".nc" else path / RESULT
        below = [] if file.exists() else sorted(path.glob(f"*/{RESULT}"))
        if not file.exists() and not below:
            raise DustError(f"{path} has no run: neither {RESULT} nor folders with one.")
        files += below or [file]
    if not files:
        raise DustError(
            "dust fit continuum needs grain runs, such as those of the scenes in "
            "configs/continuum_calibration/: dust run each, then give their folders here."
        )
    return files


def fit_runs(paths, phi_2=0.58, rate=None):
    """The Fit (`material_fit.fit`) of a material to run directories.

    Raises DustError where observations are missing, or where the result is not a valid material.
    """
    tests = [grain_test(open_run(path)) for path in result_files(paths)]
    fit = material_fit.fit(tests, phi_2, rate)
    try:
        ContinuumMaterial.model_validate(block(fit, "dust"))
    except ValidationError as error:
        first = error.errors()[0]
        raise DustError(
            f"The fit gives no valid material: {'.'.join(map(str, first['loc']))} {first['msg']}"
        ) from None
    return fit


def block(fit, name):
    """The material of a Fit as plain data of the YAML, with the source of every number."""
    values = dict(zip(PARAMETERS, (_round_number(v) for v in fit.values), strict=True))
    data = {
        "name": name,
        "bulk_modulus": f"{values['bulk_modulus']:g} Pa",
        "exponent": values["exponent"],
        "solid_density": f"{fit.solid_density:g} kg/m^3",
        "density": f"{_round_number(fit.density):g} kg/m^3",
        "shear_ratio": values["shear_ratio"],
        "compressive": {
            "phi_1": values["compressive.phi_1"],
            "phi_2": fit.phi_2,
            "p_m": f"{values['compressive.p_m']:g} Pa",
            "delta": values["compressive.delta"],
        },
        "tensile": {"a": values["tensile.a"], "b": values["tensile.b"]},
        "shear": {"factor": values["shear.factor"], "exponent": values["shear.exponent"]},
    }
    source = {
        "runs": sorted({test.name for test, _ in fit.rows}),
        "dimension": DIMENSION,
        "numbers": {key: _source(fit, key) for key in PARAMETERS}
        | {
            "compressive.phi_2": f"fixed; the grains were compressed to {_reach(fit):.3g}",
            "density": "mean of the samples at the start",
            "solid_density": "of the grains",
        },
        "names": list(PARAMETERS),
        "values": [float(v) for v in fit.values],
        "covariance": [[float(f"{v:.4g}") for v in row] for row in fit.covariance],
    }
    return {**data, "source": source}


def _round_number(value):
    return float(f"{value:.{DIGITS}g}")


def _reach(fit):
    return max(observation.phi for _, observation in fit.rows)


def _source(fit, key):
    """Source of a number: points, seeds, grains, rate, and standard deviation over the seeds."""
    counts = quantities(fit.rows)
    seen = " and ".join(f"{counts[name]} of {name}" for name in _SEEN_IN[key])
    tests = [test for test, observation in fit.rows if observation.quantity in _SEEN_IN[key]]
    grains = sorted({test.grains for test in tests})
    unit = PARAMETERS[key][0].replace("1", "")
    return (
        f"points: {seen}; {len({test.seed for test in tests})} seeds of "
        f"{', '.join(map(str, grains))} grains, compressed at {fit.rate:.3g} 1/s; standard "
        f"deviation over the seeds {fit.sigma(key):.2g} {unit}".rstrip()
    )


def material_text(fit, name):
    """Text of the file of the material, which `material: PATH` of a scene reads."""
    head = "# A dust of the continuum, fitted to grain runs by `dust fit continuum`.\n"
    return head + yaml.safe_dump(block(fit, name), sort_keys=False, allow_unicode=True, width=100)


def numbers(fit):
    """Numbers of a Fit: the material with its sources, deviations, and Speeds, as dicts."""
    return {
        "material": block(fit, "dust"),
        "deviations": {name: fit.deviation(name) for name in QUANTITIES},
        "speeds": [asdict(speed) for speed in speeds(curves(fit.tests))],
    }


def numbers_table(fit):
    """Rows (number, value, standard deviation over the seeds, unit)."""
    rows = [
        (name, f"{value:.4g}", f"{fit.sigma(name):.2g}", PARAMETERS[name][0])
        for name, value in zip(PARAMETERS, fit.values, strict=True)
    ]
    rows.append(("compressive.phi_2", f"{fit.phi_2:g}", "fixed", "1"))
    return [*rows, ("density", f"{fit.density:.4g}", "", "kg/m^3")]


def deviations_table(fit):
    """Rows (quantity, number of points, standard deviation of the material from them)."""
    counts = quantities(fit.rows)
    return [
        (meaning, str(counts[name]), f"{fit.deviation(name):.0%}")
        for name, meaning in QUANTITIES.items()
    ]


def speeds_table(fit):
    """Rows (rate, grains, runs, p_m of the axial stress, p_m of the pressure), with the scatter."""

    def text(value, spread):
        some = f" ± {value * spread / 1e3:.1f}" if np.isfinite(spread) else ""
        return f"{value / 1e3:.1f}{some}"

    return [
        (
            "at rest" if speed.rate == 0 else f"{speed.rate:.3g}",
            str(speed.grains),
            str(speed.runs),
            text(speed.axial, speed.axial_spread),
            text(speed.p, speed.p_spread),
        )
        for speed in speeds(curves(fit.tests))
    ]


def curves_csv(fit):
    """The Curves of compression at all rates, as CSV."""
    names = ["run", "seed", "grains", "rate [1/s]", "filling factor", "p [Pa]", "axial stress [Pa]"]
    rows = [
        (curve.run, curve.seed, curve.grains, f"{curve.rate:.4g}", *numbers)
        for curve in curves(fit.tests)
        for numbers in zip(curve.phi, curve.p, curve.axial, strict=True)
    ]
    return _csv(names, rows)


def observations_csv(fit):
    """All observations with the predictions of the material, as CSV."""
    names = ["run", "seed", "grains", "rate [1/s]", "quantity", "filling factor", "grains [Pa]",
             "material [Pa]", "relative error"]  # fmt: skip
    rows = [
        (test.name, test.seed, test.grains, f"{observation.rate:.4g}", observation.quantity,
         observation.phi, observation.value, model, observation.error)
        for (test, observation), model in zip(fit.rows, fit.model, strict=True)
    ]  # fmt: skip
    return _csv(names, rows)


def _csv(names, rows):
    table = pd.DataFrame(rows, columns=names)
    return table.to_csv(index=False, float_format="%.5g", lineterminator="\n")
