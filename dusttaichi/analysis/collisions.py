"""Many collisions in one dataset, and the table that coagulation codes read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from dusttaichi.analysis.outcome import DEFINITIONS, PAGE
from dusttaichi.analysis.texts import format_csv

if TYPE_CHECKING:
    from dusttaichi.analysis.texts import TextColumn


AXES = ("body", "mass_ratio", "speed", "impact_parameter", "seed")
FAILED = "failed"
MISS = "miss"
OUTCOMES = (*DEFINITIONS, MISS)
# name -> (unit, long_name)
NUMBERS = {
    "growth_efficiency": ("1", "growth efficiency (M_largest - M_target)/M_projectile"),
    "largest": ("1", "mass of the largest fragment over the total mass"),
    "second": ("1", "mass of the second largest fragment over the total mass, 0 without one"),
    "fragments": ("1", "number of fragments, single grains among them"),
    "restitution": ("1", "coefficient of restitution, 0 where they stay together"),
    "time": ("s", "simulated time after the first touch"),
    "impact_energy": ("J", "kinetic energy of the relative motion before the collision"),
    "collision_loss": ("J", "dissipated from the first touch to the end"),
    "compression_loss": ("J", "dissipated from the touch until the centres stop approaching"),
    "stretching_loss": ("J", "dissipated then, until the bodies are apart or stop receding"),
    "kinetic": ("J", "kinetic energy at the end, about the common centre of mass"),
    "potential": ("J", "change of the potential energy of the contacts"),
    "residual": ("1", "residual of the energy ledger over the impact energy"),
    "outer_radii": ("m", "sum of the outer radii, which the impact parameter is a fraction of"),
    "target_filling_factor": ("1", "of the target within its characteristic radius"),
    "projectile_filling_factor": ("1", "of the projectile within its characteristic radius"),
    "grains": ("1", "number of grains of both bodies"),
    "actual_mass_ratio": ("1", "mass of the heavier body over that of the lighter"),
}
LEAST_FRAGMENTS = 10  # for a slope


def build_collisions_dataset(
    rows: Sequence[Mapping[str, Any]],
    axes: Mapping[str, Sequence[Any]],
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """One xr.Dataset, SI, of the rows of a study (studies.collide), in the order of its axes.

    axes: name -> values, those of AXES. Numbers (body, mass_ratio, speed, impact_parameter, seed)
    as NUMBERS has them, not a number of misses and failed collisions; outcome: text; settled: 1
    where the fragments no longer changed at the end; loss (..., channel) [J]. All fragments one
    after another: fragment_grains, fragment_mass (over the total mass), fragment_collision: the
    number of the collision, counted in the order of the dimensions.
    """
    shape, dims = tuple(len(axes[name]) for name in AXES), AXES
    data = xr.Dataset(coords={name: (name, list(values)) for name, values in axes.items()})
    data["speed"].attrs = {"units": "m/s", "long_name": "relative speed of the bodies"}
    data["impact_parameter"].attrs = {"units": "1", "long_name": "over the sum of outer radii"}
    data["mass_ratio"].attrs = {"units": "1", "long_name": "target over projectile, nominal"}
    data["seed"].attrs = {"long_name": "by how much the seeds of the sample are moved"}
    numbers_of_rows = [_read_numbers(row) for row in rows]
    for name, (unit, text) in NUMBERS.items():
        values = np.array(
            [numbers.get(name, np.nan) for numbers in numbers_of_rows], float
        ).reshape(shape)
        data[name] = (dims, values, {"units": unit, "long_name": text})
    outcomes = np.array([row.get("outcome", FAILED) for row in rows]).reshape(shape)
    data["outcome"] = (dims, outcomes, _describe_outcomes())
    settled = np.array([int(row.get("settled", True)) for row in rows]).reshape(shape)
    data["settled"] = (dims, settled, {"long_name": "1 where the fragments no longer changed"})
    channels = list(dict.fromkeys(name for row in rows for name in row.get("loss", {})))
    lost = [[row.get("loss", {}).get(c, np.nan) for c in channels] for row in rows]
    about = {"units": "J", "long_name": "energy dissipated, by channel"}
    data["loss"] = ((*dims, "channel"), np.array(lost).reshape(*shape, len(channels)), about)
    data.coords["channel"] = channels
    fragments = [
        (n, *pair)
        for n, row in enumerate(rows)
        for pair in zip(row.get("fragments", ()), row.get("masses", ()), strict=True)
    ]
    number, grains, mass = np.array(fragments).reshape(-1, 3).T
    data["fragment_collision"] = ("fragment", number.astype(int))
    data["fragment_grains"] = ("fragment", grains.astype(int))
    data["fragment_mass"] = ("fragment", mass, {"units": "1", "long_name": "over the total mass"})
    data.attrs = dict(attrs or {})
    return data


def _describe_outcomes() -> dict[str, str]:
    """Attributes of the variable `outcome`: its values and their definitions."""
    texts = [f"{name}: {text}" for name, text in DEFINITIONS.items()]
    texts += [f"{MISS}: the bodies have not touched", f"{FAILED}: stopped, its outcome is unknown"]
    about = "f: growth efficiency"
    return {
        "long_name": f"one of {', '.join(OUTCOMES)}, {FAILED}",
        "definitions": "; ".join([*texts, about, f"see {PAGE}"]),
    }


def _read_numbers(row: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of a row by the names of NUMBERS; None becomes not a number."""
    target, projectile = row.get("filling_factor") or (None, None)
    numbers = {"target_filling_factor": target, "projectile_filling_factor": projectile}
    numbers |= {name: row.get(name) for name in NUMBERS if name in row}
    numbers |= {"actual_mass_ratio": row.get("mass_ratio")}
    if masses := row.get("masses"):
        numbers |= {"largest": masses[0], "second": [*masses, 0.0][1], "fragments": len(masses)}
    return {name: value for name, value in numbers.items() if value is not None}


# -- slope of the fragments ----------------------------------------------------------------------


def fit_fragment_slope(grains: ArrayLike, largest: float) -> tuple[float, float]:
    """(tau, its standard error) of fragments whose number falls as n(N) ~ N^-tau, N = 1..largest.

    grains: (F,) of each fragment. By the largest likelihood of whole numbers (Clauset et al. 2009,
    SIAM Review 51, 661, sec. 3.5), cut off at `largest`; the error is that of independent
    fragments.
    Not a number for fewer than ten, or where all are equal.
    """
    grains = np.asarray(grains, float)
    if len(grains) < LEAST_FRAGMENTS or np.ptp(grains) == 0.0:
        return np.nan, np.nan
    logs, mean_log = np.log(np.arange(1, int(largest) + 1)), np.log(grains).mean()

    def moments(tau: float) -> tuple[float, float]:
        weights = np.exp(-tau * logs)
        mean = weights @ logs / weights.sum()
        return mean, weights @ (logs - mean) ** 2 / weights.sum()

    tau = scipy.optimize.brentq(lambda t: moments(t)[0] - mean_log, -50.0, 50.0)
    return float(tau), float(1.0 / np.sqrt(len(grains) * moments(tau)[1]))


def select_fragments(
    data: xr.Dataset, is_selected: NDArray[np.bool_]
) -> tuple[NDArray[np.integer], int]:
    """(grains of all fragments but the two largest remnants of each collision, collisions).

    is_selected: a boolean array over the dimensions AXES, the collisions that count; misses do not.
    """
    selected = np.flatnonzero((is_selected & (data.outcome.values != MISS)).ravel())
    owner, grains = data.fragment_collision.values, data.fragment_grains.values
    # each collision has its fragments in a row, the largest first
    rank = np.arange(len(owner)) - np.searchsorted(owner, owner)
    return grains[np.isin(owner, selected) & (rank >= 2)], len(selected)


# -- the table -----------------------------------------------------------------------------------

AVERAGED = ("growth_efficiency", "largest", "second", "fragments", "restitution",
            "target_filling_factor", "projectile_filling_factor")  # fmt: skip


def tabulate_collisions(data: xr.Dataset) -> tuple[list[str], list[list[Any]]]:
    """(header, rows) of the table for coagulation codes: lists of values.

    There is a row for every body, mass ratio, speed and impact parameter (over: "point"); where
    these represent equal areas also one over all of them, without an impact parameter ("area").
    Means are over the seeds of the collisions in which the bodies touched, `_error` is the standard
    error of that mean, empty where there are fewer than two; hit: their share. share_OUTCOME: of
    these. compression_loss, stretching_loss: see
    `compute_phase_losses`. slope: of the fragments but the
    two largest remnants (`fit_fragment_slope`), of all seeds together. loss_CHANNEL, kinetic,
    potential: over the impact energy. not_settled: collisions that ended while fragments still
    changed; failed: those without numbers, left out of all means.
    """
    energies = {f"loss_{c}": data.loss.sel(channel=c) for c in data.channel.values.tolist()}
    energies |= {name: data[name] for name in ("kinetic", "potential")}
    columns = {name: data[name].values for name in AVERAGED}
    columns |= {name: (e / data.impact_energy).values for name, e in energies.items()}
    columns |= {name: values.values for name, values in compute_phase_losses(data).items()}
    outcomes_hit = [name for name in OUTCOMES if name != MISS]
    header = [
        "body", "mass_ratio", "speed_m_per_s", "over", "impact_parameter", "collisions", "hit",
    ]  # fmt: skip
    header += [f"share_{name.replace(' ', '_')}" for name in outcomes_hit]
    header += [suffix for name in columns for suffix in (name, f"{name}_error")]
    header += ["slope", "slope_error", "not_settled", "failed"]
    rows = []
    for index in np.ndindex(data.outcome.shape[:3]):
        impact_parameters = [*range(data.sizes["impact_parameter"])]
        groups = [
            (slice(n, n + 1), "point", data.impact_parameter.values[n]) for n in impact_parameters
        ]
        if data.attrs.get("by_area") and len(impact_parameters) > 1:
            groups.append((slice(None), "area", np.nan))
        for impact_parameter, *name in groups:
            keys = [data[axis].values[n] for axis, n in zip(AXES, index, strict=False)]
            is_selected = np.zeros(data.outcome.shape, bool)
            is_selected[(*index, impact_parameter)] = True
            rows.append([*keys, *name, *_average_row(data, is_selected, columns, outcomes_hit)])
    return header, rows


def compute_phase_losses(data: xr.Dataset) -> dict[str, xr.DataArray]:
    """Shares of the energy that are dissipated in compression and in stretching.

    DataArrays between 0 and 1: compression_loss, share of the available energy; stretching_loss,
    share of the rest. Available is what is dissipated from the touch on, and the kinetic energy at
    the end: the impact energy, and the potential energy that contacts formed in the collision
    release.
    """
    if "collision_loss" not in data:  # of an older version
        return {}
    available = data.collision_loss + data.kinetic
    return {
        "compression_loss": data.compression_loss / available,
        "stretching_loss": data.stretching_loss / (available - data.compression_loss),
    }


def _average_row(
    data: xr.Dataset,
    is_selected: NDArray[np.bool_],
    columns: Mapping[str, NDArray[np.float64]],
    outcomes_hit: Sequence[str],
) -> list[Any]:
    outcomes = data.outcome.values[is_selected]
    has_outcome = outcomes != FAILED
    hit = has_outcome & (outcomes != MISS)
    count = hit.sum()
    row = [int(has_outcome.sum()), count / max(1, has_outcome.sum())]
    row += [(outcomes == name).sum() / count if count else np.nan for name in outcomes_hit]
    for values in columns.values():
        row += compute_mean_and_error(values[is_selected])
    grains, _ = select_fragments(data, is_selected)
    row += fit_fragment_slope(grains, np.nanmax(data.grains.values[is_selected], initial=1))
    return [*row, int((data.settled.values[is_selected] == 0).sum()), int((~has_outcome).sum())]


def compute_mean_and_error(values: NDArray[np.float64]) -> list[float]:
    """[mean, standard error] of those that are numbers; not a number of none, or fewer than two."""
    values = values[np.isfinite(values)]
    mean = values.mean() if len(values) else np.nan
    error = values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return [mean, error]


def format_collision_table(data: xr.Dataset) -> str:
    """The table as CSV, empty where there is no number."""
    header, rows = tabulate_collisions(data)
    return format_csv([header, *([_format_cell(value) for value in row] for row in rows)])


def _format_cell(value: Any) -> Any:
    if isinstance(value, (float, np.floating)):
        return "" if np.isnan(value) else f"{value:.6g}"
    return value


def format_collision_summary(data: xr.Dataset) -> tuple[list[TextColumn], list[TextColumn]]:
    """(keys, columns) of a table to print: (header, texts), over impact parameters and seeds."""
    index = list(np.ndindex(data.outcome.shape[:3]))
    keys: list[TextColumn] = [("speed m/s", [f"{data.speed.values[n[2]]:.3g}" for n in index])]
    for axis, name in ((1, "mass_ratio"), (0, "body")):
        if data.sizes[name] > 1:
            values = [data[name].values[n[axis]] for n in index]
            texts = [f"{value:g}" if axis else str(value) for value in values]
            keys.insert(0, (name.replace("_", " "), texts))
    points = [data.isel(body=n[0], mass_ratio=n[1], speed=n[2]) for n in index]
    columns: list[TextColumn] = [
        ("growth efficiency", [_format_mean(point.growth_efficiency) for point in points])
    ]
    columns.append(("largest fragment", [_format_mean(point.largest) for point in points]))
    present = [name for name in (*OUTCOMES, FAILED) if (data.outcome == name).any()]
    columns += [
        (name, [str(int((point.outcome == name).sum())) for point in points]) for name in present
    ]
    return keys, columns


def _format_mean(values: xr.DataArray) -> str:
    mean, error = compute_mean_and_error(values.values.ravel())
    if np.isnan(mean):
        return "-"
    return f"{mean:.3f}" + (f" ± {error:.3f}" if np.isfinite(error) else "")
