"""The files of a fit: the material as a block of YAML, and all observations as a table."""

import csv
import io
from pathlib import Path

import numpy as np
import yaml

from dusttaichi.errors import DustError
from dusttaichi.files import explain
from dusttaichi.results.outputs import check
from dusttaichi.scene.continuum_material import ContinuumMaterial
from dusttaichi.studies.continuum_fit.fitting import quantities
from dusttaichi.studies.continuum_fit.model import PARAMETERS

DIGITS = 4
DIMENSION = 3  # of the grains, and of the stresses and strains of the point that is fitted
_SEEN_IN = {
    "bulk_modulus": ("M", "lambda"),
    "exponent": ("M", "lambda"),
    "shear_ratio": ("M", "lambda"),
    "compressive.p_m": ("p",),
    "compressive.delta": ("p",),
    "compressive.phi_1": ("p",),
    "shear.factor": ("q",),
    "shear.exponent": ("q",),
    "tensile.a": ("tension",),
    "tensile.b": ("tension",),
}


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
            "compressive.phi_2": f"fixed; the grains were pressed to {_reach(fit):.3g}",
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
    """'24 points (p) of 3 seeds, pressed at 1e+04 1/s; standard deviation over the seeds 120 Pa'"""
    counts = quantities(fit.rows)
    seen = " and ".join(f"{counts[name]} of {name}" for name in _SEEN_IN[key])
    tests = [test for test, one in fit.rows if one.quantity in _SEEN_IN[key]]
    grains = sorted({test.grains for test in tests})
    unit = PARAMETERS[key][0].replace("1", "")
    return (
        f"points: {seen}; {len({test.seed for test in tests})} seeds of "
        f"{', '.join(map(str, grains))} grains, pressed at {fit.rate:.3g} 1/s; standard "
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
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(
        ["run", "seed", "grains", "rate [1/s]", "filling factor", "p [Pa]", "axial stress [Pa]"]
    )
    for curve in found:
        for numbers in zip(curve.phi, curve.p, curve.axial, strict=True):
            row = [curve.run, curve.seed, curve.grains, f"{curve.rate:.4g}"]
            table.writerow(row + [f"{number:.5g}" for number in numbers])
    _write(path, text.getvalue())


def write_table(fit, path):
    """Write every observation and what the material gives in its place."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(
        ["run", "seed", "grains", "rate [1/s]", "quantity", "filling factor", "grains show [Pa]",
         "material gives [Pa]", "relative error"]
    )  # fmt: skip
    for (test, one), model in zip(fit.rows, fit.model, strict=True):
        numbers = (one.phi, one.value, model, one.error)
        table.writerow(
            [test.name, test.seed, test.grains, f"{one.rate:.4g}", one.quantity]
            + [f"{number:.5g}" for number in numbers]
        )
    _write(path, text.getvalue())


def deviation(fit, quantity):
    """Standard deviation of the material from the grains, of the logarithm (of M for lambda)."""
    rows = [
        (model - one.value) / one.scale if quantity == "lambda" else np.log(model / one.value)
        for (_, one), model in zip(fit.rows, fit.model, strict=True)
        if one.quantity == quantity
    ]
    return float(np.sqrt(np.mean(np.square(rows)))) if rows else np.nan
