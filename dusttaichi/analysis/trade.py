"""The file trade.nc: measurements of each point, and the Pareto front of cost and error."""

import numpy as np
import xarray as xr

from dusttaichi.analysis.observables import about

COLUMNS = {
    "parameter": "the varied parameter, or default, preset, combined",
    "label": "the point",
    "kind": "numerical, physical or sample: what the parameter changes",
    "status": "how the run ended, or why it was refused",
}
NUMBERS = {  # name -> (units, long name)
    "value": ("1", "value of the parameter, not a number for a word"),
    "cost": ("s", "core-seconds of the time steps, without start, compilation and writing"),
    "cost_ratio": ("1", "cost over that of the default, measured side by side"),
    "error": ("1", "relative error of the attribute `observable` against the converged reference"),
    "ledger_worst": ("1", "worst relative residual of the energy ledger"),
    "steps": ("1", "time steps"),
    "time_step": ("s", "time step"),
}


def trade_dataset(*, columns, numbers, flags, values, errors, observables, seeds, attrs):
    """Dataset of a trade; None in `numbers` becomes NaN.

    Parameters
    ----------
    columns : dict
        Name of COLUMNS -> texts, (point,).
    numbers : dict
        Name of NUMBERS -> (point,).
    flags : dict
        Name (free, accepted) -> bool, (point,).
    values : dict
        Observable -> (point,).
    errors : dict
        Observable -> (point,).
    observables : dict
        Name -> (observable,) of reference, scatter, convergence.
    seeds : dict
        Observable -> (seed,).
    attrs : dict
        Observable, tolerance and further global attributes.

    Returns
    -------
    xarray.Dataset
    """
    names = list(values)
    data = xr.Dataset(attrs=attrs, coords={"observable": names})
    for name, text in COLUMNS.items():
        data[name] = ("point", np.array(columns[name], dtype=str), {"long_name": text})
    for name, (units, text) in NUMBERS.items():
        column = np.array([np.nan if v is None else v for v in numbers[name]], dtype=float)
        data[name] = ("point", column, {"units": units, "long_name": text})
    texts = {
        "free": "the error is below the scatter of seeds (without seeds: the reference's own)",
        "accepted": "the error is within the tolerance, or free where the kind is numerical",
    }
    for name, column in flags.items():
        data[name] = ("point", np.array(column, dtype=np.int8), {"long_name": texts[name]})
    for name in names:
        text, unit = about(name)
        of = {"units": unit, "long_name": text}
        data[name] = ("point", np.array(values[name], dtype=float), of)
        of = {"units": "1", "long_name": f"relative error of: {text}"}
        data[f"error_{name}"] = ("point", np.array(errors[name], dtype=float), of)
        if name in seeds:
            of = {"units": unit, "long_name": f"with each seed: {text}"}
            data[f"seed_{name}"] = ("seed", np.array(seeds[name], dtype=float), of)
    texts = {
        "reference": "value of the reference, SI",
        "scatter": "standard deviation between seeds, as an error",
        "convergence": "difference of the reference from that at `check`, as an error",
    }
    for name, column in observables.items():
        data[name] = ("observable", np.array(column, dtype=float), {"long_name": texts[name]})
    return data


def front(cost, error):
    """Numbers of the points of the Pareto front of cost and error, by growing cost.

    Parameters
    ----------
    cost
        (points,).
    error
        (points,). Points with a value that is NaN are left out.

    Returns
    -------
    list of int
    """
    cost, error = np.asarray(cost, dtype=float), np.asarray(error, dtype=float)
    known = np.flatnonzero(np.isfinite(cost) & np.isfinite(error))
    order = known[np.lexsort((error[known], cost[known]))]
    best = np.minimum.accumulate(np.append(np.inf, error[order]))[:-1]
    return order[error[order] < best].tolist()
