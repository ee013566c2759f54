"""Files and tables of `dust fit continuum`, from run directories."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from dusttaichi.analysis import open_run
from dusttaichi.analysis.grain_tests import grain_test
from dusttaichi.errors import DustError
from dusttaichi.files import RESULT
from dusttaichi.plots import save
from dusttaichi.plots.continuum_fit import continuum_fit, pressing_speeds
from dusttaichi.studies.continuum_fit import fitting, speeds, writing
from dusttaichi.studies.continuum_fit.fitting import Fit
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
        writing.material(found.fit, "dust")
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
    writing.write_material(found.fit, path)
    writing.write_table(found.fit, table)
    writing.write_curves(found.curves, curves)
    save(continuum_fit(found.fit), figure)
    save(pressing_speeds(found.curves), second)
    return [path, figure, table, second, curves]


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
    counts = fitting.quantities(fit.rows)
    return [
        (meaning, str(counts[name]), f"{writing.deviation(fit, name):.0%}")
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
