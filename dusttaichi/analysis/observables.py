"""Observables: numbers by which two runs of one scene are compared."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dusttaichi.analysis.compression import measure_compression_curve
from dusttaichi.analysis.ledger import sum_losses_by_channel
from dusttaichi.analysis.numbers import Observable, index_observables
from dusttaichi.analysis.summary import summarise
from dusttaichi.physics.contact.effect_numbers import CHANNELS, EXTRA_CHANNELS

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


CURVE = "phi_rms"
GRID = 201  # pressures at which two curves are compared


def _sum_last_record(*names: str) -> Callable[[Run], float]:
    """Sum of variables of the series in the last record."""
    return lambda run: float(
        sum(np.nansum(run.series[name].values[-1]) for name in names if name in run.series)
    )


def _read_final_losses(run: Run) -> dict[str, float]:
    """Channel -> energy lost until the last record [J]."""
    return {name: float(loss[-1]) for name, loss in sum_losses_by_channel(run.series).items()}


# energies at the end, for scenes without any of the wanted numbers
ENERGIES = tuple(
    Observable(name=name, title=title, unit="J", value=value)
    for name, title, value in (
        ("lost", "energy lost in all channels", lambda run: sum(_read_final_losses(run).values())),
        *(
            (
                f"lost_{name}",
                f"energy lost on {name}",
                lambda run, n=name: _read_final_losses(run).get(n, 0.0),
            )
            for name in (*CHANNELS, *EXTRA_CHANNELS)
        ),
        (
            "kinetic",
            "kinetic energy at the end",
            _sum_last_record("kinetic_translation", "kinetic_rotation"),
        ),
        (
            "potential",
            "potential energy at the end",
            _sum_last_record("potential", "potential_wall"),
        ),
    )
)


def rank_observables() -> list[Observable]:
    """Numbers of the registry by which runs are compared, the most wanted first.

    The curve of a compression precedes them all.
    """
    return sorted(
        (n for n in index_observables().values() if n.trade_rank),
        key=lambda number: number.trade_rank,
    )


def describe_observable(name: str) -> tuple[str, str]:
    """(description, unit) of an observable."""
    if name == CURVE:
        return "rms distance of phi(P) from the reference", "1"
    for number in (*rank_observables(), *ENERGIES):
        if name == (number.trade_name or number.name):
            return number.about or number.title, number.unit or ""
    return name, "1"  # of a method or an extension that is not installed


LoadingCurve = tuple[list[float], list[float]]  # (lg P [Pa], filling factor), (bins,) each


@dataclass(frozen=True)
class ObservableValues:
    """Observables of a run.

    values: name -> number [SI]. curve: (lg P [Pa], phi), (bins,), of a compression under a wall
    (`Curve.monotone`), or None.
    """

    values: dict[str, float]
    curve: LoadingCurve | None = None

    @property
    def names(self) -> list[str]:
        """Names of its observables, the most wanted first."""
        return ([CURVE] if self.curve is not None else []) + list(self.values)


def measure_observables(run: Run) -> ObservableValues:
    """Observables of a Run: its numbers of `rank_observables`, else ENERGIES; and its curve."""
    numbers = summarise(run)
    curve = measure_compression_curve(run).monotone() if run.compresses else None
    if curve is not None and len(curve[0]) < 2:
        curve = None
    values = _select_finite(
        {n.trade_name or n.name: numbers.get(n.name) for n in rank_observables()}
    )
    if not values and curve is None and len(run.series.time):
        values = _select_finite({number.name: number.evaluate(run) for number in ENERGIES})
    return ObservableValues(values, curve and (curve[0].tolist(), curve[1].tolist()))


def _select_finite(numbers: Mapping[str, Any]) -> dict[str, float]:
    return {n: float(v) for n, v in numbers.items() if v is not None and np.isfinite(v)}


def resample_curves(
    curves: Sequence[LoadingCurve],
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Curves (lg P, phi) at GRID common pressures: (lg P, (curves, GRID)); None without any."""
    low, high = max(c[0][0] for c in curves), min(c[0][-1] for c in curves)
    if not high > low:
        return None
    grid = np.linspace(low, high, GRID)
    return grid, np.array([np.interp(grid, *c) for c in curves])


def compute_differences(
    observables: ObservableValues, reference: ObservableValues
) -> dict[str, tuple[float, float]]:
    """Name -> (value, error) of ObservableValues against the reference; nan for a missing number.

    The error of a number is |value - reference value| / |reference value|. For a reference of 0 (a
    pair that sticks: no restitution) it is |value| of a number without a unit; with a unit, 0 or
    infinity.
    The value of CURVE is the rms difference of the filling factors, at GRID even steps of lg P over
    the pressures that both curves reach; its error is that over the mean filling factor of the
    reference there. A tolerance of 5 % thus is a twentieth of the filling factor.
    """
    errors_by_name = {}
    for name in reference.names:
        if name == CURVE:
            errors_by_name[name] = _compare_curves(observables, reference)
            continue
        value, expected = observables.values.get(name, np.nan), reference.values[name]
        errors_by_name[name] = (
            value,
            _divide_by_reference(abs(value - expected), expected, describe_observable(name)[1]),
        )
    return errors_by_name


def _compare_curves(
    observables: ObservableValues, reference: ObservableValues
) -> tuple[float, float]:
    curves = [curve for curve in (observables.curve, reference.curve) if curve is not None]
    resampled = resample_curves(curves) if len(curves) == 2 else None
    if resampled is None:
        return np.nan, np.nan
    phi, expected = resampled[1]
    rms = float(np.sqrt(np.mean((phi - expected) ** 2)))
    return rms, rms / float(expected.mean())


def _divide_by_reference(difference: float, expected: float, units: str) -> float:
    if expected != 0.0:
        return difference / abs(expected)
    if units == "1":
        return difference
    return np.inf if difference > 0.0 else difference


def measure_scatter(
    runs: Sequence[ObservableValues], reference: ObservableValues
) -> dict[str, float]:
    """Name -> standard deviation (n - 1) of observables of several seeds, over the reference value.

    For CURVE it is the root of the mean variance over the pressures that all reach, over the mean
    filling factor there. nan where fewer than two have the number.
    """
    out = {}
    for name in reference.names:
        out[name] = np.nan
        if name == CURVE:
            curves = [run.curve for run in runs if run.curve is not None]
            resampled = resample_curves(curves) if len(curves) > 1 else None
            if resampled is not None:
                phi = resampled[1]
                out[name] = float(np.sqrt(phi.var(axis=0, ddof=1).mean()) / phi.mean())
            continue
        values = [run.values[name] for run in runs if name in run.values]
        if len(values) > 1:
            spread = float(np.std(values, ddof=1))
            out[name] = _divide_by_reference(
                spread, reference.values[name], describe_observable(name)[1]
            )
    return out


def find_pareto_front(cost: ArrayLike, error: ArrayLike) -> list[int]:
    """Numbers of the points of the Pareto front of cost and error, by growing cost.

    Parameters
    ----------
    cost
        (points,).
    error
        (points,). Points with a value that is NaN are left out.
    """
    cost, error = np.asarray(cost, dtype=float), np.asarray(error, dtype=float)
    finite = np.flatnonzero(np.isfinite(cost) & np.isfinite(error))
    order = finite[np.lexsort((error[finite], cost[finite]))]
    best = np.minimum.accumulate(np.append(np.inf, error[order]))[:-1]
    front: list[int] = order[error[order] < best].tolist()
    return front
