"""A material of the continuum from grain runs (`dust fit continuum`).

Observations of grain runs are compared with a material point under the same strain, in one fit of
all numbers of the material: least squares.
"""

from collections import defaultdict
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import scipy

from dusttaichi.continuum.analysis.observations import (
    BIN,
    QUANTITIES,
    middle,
    observations,
    same_rate,
    seen,
)
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.physics.point import MaterialPoint
from dusttaichi.continuum.scene.dusts import SCALES
from dusttaichi.errors import DustError

# name in the YAML -> (unit, lowest, highest); of SCALES the logarithm is fitted
PARAMETERS = {
    "bulk_modulus": ("Pa", 1e2, 1e9),
    "exponent": ("1", 1.0, 20.0),
    "shear_ratio": ("1", 0.02, 1.5),
    "compressive.p_m": ("Pa", 1.0, 1e7),
    "compressive.delta": ("1", 0.05, 4.0),
    "compressive.phi_1": ("1", 0.0, 0.5),
    "shear.factor": ("1", 0.02, 50.0),
    "shear.exponent": ("1", 0.0, 1.0),
    "tensile.a": ("1", -2.0, 8.0),
    "tensile.b": ("1", 0.0, 25.0),
}
START = (2e5, 4.5, 0.7, 5e3, 0.6, 0.12, 1.5, 0.6, 2.8, 1.5)
STEP = 1e-4
LEAST_PULLED_SPAN = 0.03  # of filling factors, for the slope of tensions
LOGS = np.array([name in SCALES for name in PARAMETERS])
LOWEST, HIGHEST = (
    np.array([np.log(row[k]) if name in SCALES else row[k] for name, row in PARAMETERS.items()])
    for k in (1, 2)
)
NEEDED = {
    "p": "confined compression (a stage in which the filling factor grows)",
    "q": "confined compression with the stress at the sides",
    "M": "a small unloading between two compressions (a stage with a strain of 1e-4 to 1e-2 back)",
    "tension": "tension until its maximum has passed (stop.past_maximum)",
}


def numbers_of(values, solid_density, density, phi_2):
    """MaterialNumbers of values (..., parameters) in the order of PARAMETERS, each an array."""
    v = dict(zip(PARAMETERS, np.moveaxis(np.asarray(values, dtype=float), -1, 0), strict=True))
    squeeze = {name: v[f"compressive.{name}"] for name in ("p_m", "delta", "phi_1")}
    return MaterialNumbers.from_material(
        SimpleNamespace(
            solid_density=solid_density,
            density=density,
            bulk_modulus=v["bulk_modulus"],
            exponent=v["exponent"],
            shear_ratio=v["shear_ratio"],
            compressive=SimpleNamespace(phi_2=phi_2, **squeeze),
            tensile=SimpleNamespace(a=v["tensile.a"], b=v["tensile.b"]),
            shear=SimpleNamespace(factor=v["shear.factor"], exponent=v["shear.exponent"]),
        )
    )


def stresses(test, m):
    """Stress [Pa], positive in compression, of points of the materials m strained as the test.

    A list of arrays (records, materials, 3) by segment of the GrainTest, means over the intervals.
    """
    density = np.broadcast_to(test.phi * test.solid_density, np.shape(m.p_m))
    point = MaterialPoint.make_unstressed(m, density)
    out = []
    for segment in test.segments:
        rows = [-point.stress]
        for step in np.diff(segment.strain, axis=0):
            point = point.apply_strain(step) if step.any() else point
            rows.append(-point.stress)
        rows = np.stack(rows)
        out.append(0.5 * (rows[1:] + rows[:-1]))
    return out


def predict_observations(test, test_observations, m):
    """Predictions of the materials m for Observations of a test, (observations, m)."""
    history = stresses(test, m)
    return np.array(
        [
            seen(
                observation.quantity,
                middle(test.segments[observation.segment].strain)[observation.rows],
                history[observation.segment][observation.rows],
            )
            for observation in test_observations
        ]
    ).reshape(len(test_observations), -1)


@dataclass(frozen=True)
class Fit:
    """A fitted material. tests: the GrainTests; rows: (test, Observation) of the fit.

    values (parameters,), in the order of PARAMETERS; by_seed: seed -> values of a fit to it alone;
    covariance (parameters, parameters) of these. model (rows,): predictions for the observations.
    density, solid_density [kg/m^3], phi_2, rate [1/s]: fixed numbers.
    """

    tests: tuple
    rows: tuple
    values: np.ndarray
    by_seed: dict
    covariance: np.ndarray
    model: np.ndarray
    density: float
    solid_density: float
    phi_2: float
    rate: float

    @property
    def numbers(self):
        """MaterialNumbers of the fit."""
        return numbers_of(self.values, self.solid_density, self.density, self.phi_2)

    def sigma(self, name):
        """Standard deviation of a number over the seeds."""
        return float(np.sqrt(self.covariance.diagonal()[list(PARAMETERS).index(name)]))

    def deviation(self, quantity):
        """Standard deviation of the material from the grains, of the logarithm; of lambda, over M.

        quantity: of QUANTITIES.
        """
        differences = [
            (model - observation.value) / observation.scale
            if quantity == "lambda"
            else np.log(model / observation.value)
            for (_, observation), model in zip(self.rows, self.model, strict=True)
            if observation.quantity == quantity
        ]
        return float(np.sqrt(np.mean(np.square(differences)))) if differences else np.nan


def all_rows(tests):
    """(test, Observation) of all tests, without duplicates of runs with common first stages."""
    rows, seen_keys = [], set()
    for test in tests:
        for observation in observations(test):
            key = (test.seed, test.grains, observation.quantity, observation.phi, observation.value)
            if key not in seen_keys:
                seen_keys.add(key)
                rows.append((test, observation))
    return rows


def fit(tests, phi_2=0.58, rate=None):
    """The Fit of GrainTests.

    phi_2: largest filling factor, a fixed number. rate [1/s]: of the fitted compression, by default
    that of most grains; tests at other rates are left out. Raises DustError where an observation
    that a number depends on is missing.
    """
    rows = all_rows(tests)
    _refuse_missing(tests, rows)
    rate = _main_rate(rows) if rate is None else rate
    rows = _with_errors([row for row in rows if same_rate(row[1].rate, rate)])
    solid = {test.solid_density for test, _ in rows}
    if len(solid) > 1:
        raise DustError("The grains of the runs have several densities; use runs of one material.")
    rows_by_seed = _by_seed(rows, rate)
    fixed = {
        "solid_density": solid.pop(),
        "density": float(np.mean([test.phi * test.solid_density for test, _ in rows])),
        "phi_2": phi_2,
    }
    best = _least_squares(rows, _inner(np.array(START)), fixed)
    by_seed = {
        seed: _outer(_least_squares(seed_rows, best, fixed))
        for seed, seed_rows in rows_by_seed.items()
    }
    values = _outer(best)
    return Fit(
        tests=tuple(tests),
        rows=tuple(rows),
        values=values,
        by_seed=by_seed,
        covariance=np.cov(np.array(list(by_seed.values())), rowvar=False),
        model=_predict_rows(rows, values[None], fixed)[:, 0],
        rate=rate,
        **fixed,
    )


def _refuse_missing(tests, rows):
    observed = {observation.quantity for _, observation in rows}
    missing = [text for quantity, text in NEEDED.items() if quantity not in observed]
    if missing:
        names = ", ".join(test.name for test in tests) or "none"
        raise DustError(
            f"A material needs more than these runs ({names}). Missing: "
            f"{'; '.join(missing)}. configs/continuum_calibration/ has scenes of all."
        )


def _by_seed(rows, rate):
    """Rows of each seed with compression and unloading.

    Seeds without tension from two filling factors have the tensions of all seeds. Raises DustError
    for less than two seeds.
    """
    seeds = sorted({test.seed for test, _ in rows})
    rows_by_seed = {}
    for seed in seeds:
        seed_rows = [row for row in rows if row[0].seed == seed]
        seen_in = {observation.quantity for _, observation in seed_rows}
        if {"p", "q", "M"} <= seen_in:
            phi = [
                observation.phi for _, observation in seed_rows if observation.quantity == "tension"
            ]
            if not phi or np.ptp(phi) < LEAST_PULLED_SPAN:
                seed_rows = [row for row in seed_rows if row[1].quantity != "tension"]
                seed_rows += [row for row in rows if row[1].quantity == "tension"]
            rows_by_seed[seed] = seed_rows
    if len(rows_by_seed) < 2:
        raise DustError(
            "A fit needs compression and a small unloading of at least two seeds. At "
            f"{rate:.3g} 1/s there are such runs for {len(rows_by_seed)} of the seeds "
            f"{', '.join(map(str, seeds)) or '(none)'}; another --rate may have more."
        )
    return rows_by_seed


def _main_rate(rows):
    """Rate of the compression with unloading that has most grains in all [1/s]."""
    grains = defaultdict(int)
    for rate, size in {
        (observation.rate, t.grains) for t, observation in rows if observation.quantity == "M"
    }:
        grains[rate] += size
    return max(grains, key=grains.get)


def _with_errors(rows):
    """The rows with the scatter over the seeds added to the errors of the observations."""
    same = defaultdict(list)
    for test, observation in rows:
        same[_key(test, observation)].append(
            np.log(max(observation.value, 1e-3 * observation.scale))
        )
    spread = {key: np.std(v, ddof=1) if len(v) > 1 else 0.0 for key, v in same.items()}
    return [
        (
            test,
            replace(
                observation,
                error=float(np.hypot(observation.error, spread[_key(test, observation)])),
            ),
        )
        if observation.quantity != "lambda"
        else (test, observation)
        for test, observation in rows
    ]


def _key(test, observation):
    width = BIN if observation.quantity in ("p", "q") else 0.02
    return (observation.quantity, test.grains, round(observation.phi / width))


def _inner(values):
    return np.where(LOGS, np.log(np.where(LOGS, values, 1.0)), values)


def _outer(inner):
    return np.where(LOGS, np.exp(np.where(LOGS, inner, 0.0)), inner)


def _predict_rows(rows, values, fixed):
    """Predictions of materials (materials, parameters) for the rows, (rows, materials)."""
    m = numbers_of(values, **fixed)
    of_test = defaultdict(list)
    for number, (test, _) in enumerate(rows):
        of_test[id(test)].append(number)
    out = np.empty((len(rows), len(values)))
    for numbers in of_test.values():
        test = rows[numbers[0]][0]
        out[numbers] = predict_observations(test, [rows[n][1] for n in numbers], m)
    return out


def _residuals(rows, predicted_values):
    """Differences over their errors: of logarithms, of `lambda` over M; (rows, materials).

    Each quantity has the same weight, whatever its number of points.
    """
    out = np.empty_like(predicted_values)
    counts = {name: count for name, count in quantities(rows).items() if count}
    for n, (_, observation) in enumerate(rows):
        predictions = predicted_values[n]
        if observation.quantity == "lambda":
            out[n] = (predictions - observation.value) / observation.scale / observation.error
        else:
            # a logarithm down to a tenth, then a straight line, which has no pole
            ratio = predictions / observation.value
            low = np.log(0.1) + (ratio - 0.1) / 0.1
            out[n] = np.where(ratio > 0.1, np.log(np.maximum(ratio, 0.1)), low) / observation.error
        out[n] *= np.sqrt(len(rows) / len(counts) / counts[observation.quantity])
    return out


def _least_squares(rows, start, fixed):
    lowest, highest = LOWEST + 2 * STEP, HIGHEST - 2 * STEP
    least_phi = min(observation.phi for _, observation in rows)
    highest[list(PARAMETERS).index("compressive.phi_1")] = least_phi - 0.006

    def differences(x):
        return _residuals(rows, _predict_rows(rows, _outer(x)[None], fixed))[:, 0]

    def slopes(x):
        moved = x + STEP * np.vstack([np.eye(len(x)), -np.eye(len(x))])
        both = _residuals(rows, _predict_rows(rows, _outer(moved), fixed))
        return (both[:, : len(x)] - both[:, len(x) :]) / (2 * STEP)

    start = np.clip(start, lowest + 1e-6, highest - 1e-6)
    minimum = scipy.optimize.least_squares(
        differences, start, slopes, (lowest, highest), loss="soft_l1", xtol=1e-6, max_nfev=60
    )
    return minimum.x


def quantities(rows):
    """Number of rows of each quantity."""
    return {
        name: sum(observation.quantity == name for _, observation in rows) for name in QUANTITIES
    }
