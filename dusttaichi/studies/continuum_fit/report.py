"""Files and tables of `dust fit continuum`, from run directories."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from pydantic import ValidationError

from dusttaichi.analysis import open_run
from dusttaichi.analysis.grain_tests import grain_test
from dusttaichi.errors import DustError
from dusttaichi.files import RESULT, explain
from dusttaichi.plots import save
from dusttaichi.plots.continuum_fit import continuum_fit, pressing_speeds
from dusttaichi.results.outputs import check
from dusttaichi.scene.continuum_material import ContinuumMaterial
from dusttaichi.studies.continuum_fit import fitting, speeds
from dusttaichi.studies.continuum_fit.fitting import Fit, quantities
from dusttaichi.studies.continuum_fit.model import PARAMETERS
from dusttaichi.studies.continuum_fit.observations import QUANTITIES


@dataclass(frozen=True)
class Found:
    """A Fit, and the Curves of compression at all rates."""

    fit: Fit
    curves: list


def result_files(paths):
    """Result files of runs, or of all runs in folders of replicas. Raises DustError."""
    files = []
    for path in map(Path, paths):
        own = path if path.suffix == ".nc" else path / RESULT
        below = [] if own.exists() else sorted(path.glob(f"*/{RESULT}"))
        if not own.exists() and not below:
            raise DustError(f"{path} has no run: neither {RESULT} nor folders with one.")
        files += below or [own]
    if not files:
        raise DustError(
            "dust fit continuum needs grain runs, such as those of the scenes in "
            "configs/continuum_calibration/: dust run each, then give their folders here."
        )
    return files


def fit_runs(paths, phi_2=0.58, rate=None):
    """Fit of a material to run directories.

    Raises DustError where observations are missing, or where the result is not a valid material.
    """
    tests = [grain_test(open_run(path)) for path in result_files(paths)]
    found = Found(fitting.fit(tests, phi_2, rate), speeds.curves(tests))
    try:
        material(found.fit, "dust")
    except ValidationError as error:
        first = error.errors()[0]
        raise DustError(
            f"The fit gives no valid material: {'.'.join(map(str, first['loc']))} {first['msg']}"
        ) from None
    return found


def write(found, path):
    """Write material, figures and tables beside `path`; returns their paths."""
    path = Path(path)
    table, curves = path.with_suffix(".csv"), path.with_name(f"{path.stem}_speeds.csv")
    figure, second = path.with_suffix(".png"), path.with_name(f"{path.stem}_speeds.png")
    write_material(found.fit, path)
    write_table(found.fit, table)
    write_curves(found.curves, curves)
    save(continuum_fit(found.fit), figure)
    save(pressing_speeds(found.curves), second)
    return [path, figure, table, second, curves]


def numbers(found):
    """Numbers of a Found: the material with its sources, deviations, and Speeds, as dicts."""
    return {
        "material": block(found.fit, "dust"),
        "deviations": {name: deviation(found.fit, name) for name in QUANTITIES},
        "speeds": [asdict(one) for one in speeds.speeds(found.curves)],
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
        (meaning, str(counts[name]), f"{deviation(fit, name):.0%}")
        for name, meaning in QUANTITIES.items()
    ]


def speeds_table(curves):
    """Rows (rate, grains, runs, p_m of the axial stress, p_m of the pressure), with the scatter."""

    def text(value, spread):
        some = f" ± {value * spread / 1e3:.1f}" if np.isfinite(spread) else ""
        return f"{value / 1e3:.1f}{some}"

    return [
        (
            "at rest" if one.rate == 0 else f"{one.rate:.3g}",
            str(one.grains),
            str(one.runs),
            text(one.axial, one.axial_spread),
            text(one.p, one.p_spread),
        )
        for one in speeds.speeds(curves)
    ]


DIGITS = 4
DIMENSION = 3  # of the grains, and of the stresses and strains of the point that is fitted
_SEEN_IN = {
    "bulk_modulus": ("M", "lambda"), "exponent": ("M", "lambda"), "shear_ratio": ("M", "lambda"),
    "compressive.p_m": ("p",), "compressive.delta": ("p",), "compressive.phi_1": ("p",),
    "shear.factor": ("q",), "shear.exponent": ("q",), "tensile.a": ("tension",),
    "tensile.b": ("tension",),
}  # fmt: skip


def block(fit, name):
    """The material of a Fit as plain data of the YAML, with the source of every number."""
    values = dict(zip(PARAMETERS, (_rounded(v) for v in fit.values), strict=True))
    data = {
        "name": name,
        "bulk_modulus": f"{values['bulk_modulus']:g} Pa",
        "exponent": values["exponent"],
        "solid_density": f"{fit.solid_density:g} kg/m^3",
        "density": f"{_rounded(fit.density):g} kg/m^3",
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


def _rounded(value):
    return float(f"{value:.{DIGITS}g}")


def _reach(fit):
    return max(one.phi for _, one in fit.rows)


def _source(fit, key):
    """Source of a number: points, seeds, grains, rate, and standard deviation over the seeds."""
    counts = quantities(fit.rows)
    seen = " and ".join(f"{counts[name]} of {name}" for name in _SEEN_IN[key])
    tests = [test for test, one in fit.rows if one.quantity in _SEEN_IN[key]]
    grains = sorted({test.grains for test in tests})
    unit = PARAMETERS[key][0].replace("1", "")
    return (
        f"points: {seen}; {len({test.seed for test in tests})} seeds of "
        f"{', '.join(map(str, grains))} grains, compressed at {fit.rate:.3g} 1/s; standard "
        f"deviation over the seeds {fit.sigma(key):.2g} {unit}".rstrip()
    )


def material(fit, name):
    """The ContinuumMaterial of a Fit. Raises pydantic's ValidationError for an impossible one."""
    return ContinuumMaterial.model_validate(block(fit, name))


def _write(path, text):
    check(path, text.partition("\n")[0])
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise DustError(f"{path} cannot be written: {explain(error, path)}") from error


def write_material(fit, path):
    """Write the block; `material: PATH` of a scene reads it."""
    path = Path(path)
    head = "# A dust of the continuum, fitted to grain runs by `dust fit continuum`.\n"
    text = yaml.safe_dump(block(fit, path.stem), sort_keys=False, allow_unicode=True, width=100)
    _write(path, head + text)


def write_curves(found, path):
    """Write the Curves of `speeds.curves` as a table."""
    names = ["run", "seed", "grains", "rate [1/s]", "filling factor", "p [Pa]", "axial stress [Pa]"]
    rows = [
        (curve.run, curve.seed, curve.grains, f"{curve.rate:.4g}", *numbers)
        for curve in found
        for numbers in zip(curve.phi, curve.p, curve.axial, strict=True)
    ]
    _write(path, _csv(names, rows))


def write_table(fit, path):
    """Write all observations with the predictions of the material."""
    names = ["run", "seed", "grains", "rate [1/s]", "quantity", "filling factor", "grains [Pa]",
             "material [Pa]", "relative error"]  # fmt: skip
    rows = [
        (test.name, test.seed, test.grains, f"{one.rate:.4g}", one.quantity, one.phi, one.value,
         model, one.error)
        for (test, one), model in zip(fit.rows, fit.model, strict=True)
    ]  # fmt: skip
    _write(path, _csv(names, rows))


def _csv(names, rows):
    table = pd.DataFrame(rows, columns=names)
    return table.to_csv(index=False, float_format="%.5g", lineterminator="\n")


def deviation(fit, quantity):
    """Standard deviation of the material from the grains, of the logarithm; of lambda, over M."""
    rows = [
        (model - one.value) / one.scale if quantity == "lambda" else np.log(model / one.value)
        for (_, one), model in zip(fit.rows, fit.model, strict=True)
        if one.quantity == quantity
    ]
    return float(np.sqrt(np.mean(np.square(rows)))) if rows else np.nan
