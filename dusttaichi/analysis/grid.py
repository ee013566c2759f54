"""Cost and error of each setting of a table of runs, and the scatter of seeds.

A setting is the mean over its seeds. Its error is the mean difference from the unchanged scene,
each run compared with that of the same seed: what the seeds have in common cancels, so that the
mean difference is known better than either mean.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from dusttaichi.errors import DustError

AS_IT_IS = "as it is"
CURVE, PHI = "phi(P)", "phi at "
# of a stage, whose name follows
SHEAR, DEVIATOR = "shear strength ", "deviator "
LOAD, UNLOADING = "filling factor under load ", "unloading modulus "
MOST = 0.5  # share of the pairs of runs that must reach a pressure for it to count
STAGES = (SHEAR, DEVIATOR, LOAD, UNLOADING)
NUMBERS = ("cost", "value", "shift", "error", "uncertainty", "scatter", "contacts")
# observables in the order of their priority
TEXTS = {
    CURVE: "filling factor against pressure",
    "strength": "tensile strength",
    "ratio": "pressure over T19 eq 9",
    "growth_efficiency": "growth efficiency",
    "largest_share": "share of the largest fragment",
}


@dataclass(frozen=True)
class Outcome:
    """One observable of a setting, over all its seeds.

    cost: steps over those of the unchanged scene. value: mean (of a curve the mean filling factor).
    shift: mean difference from the unchanged scene with the same seeds, over its mean (of a curve
    the mean over its pressures). error: the same without its sign; of a curve the root mean square
    over its pressures. uncertainty: standard error of it, from the scatter of the differences; not
    a number for one seed. scatter: standard deviation between the seeds of the unchanged scene,
    relative as well. seeds: number of finished runs. contacts: contacts a grain at the end.
    refused: why there is no result, or "".
    """

    scene: str
    grains: int
    settings: str
    observable: str
    cost: float
    value: float
    shift: float
    error: float
    uncertainty: float
    scatter: float
    seeds: int
    contacts: float
    refused: str = ""

    @property
    def hidden(self):
        """True where the error is within the scatter of the seeds."""
        return self.error <= self.scatter

    @property
    def resolved(self):
        """True where the error is more than twice its uncertainty: a shift, not chance."""
        return self.error > 2.0 * self.uncertainty


def read(path):
    """The pandas.DataFrame of a CSV file. Raises DustError."""
    try:
        table = pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise DustError(f"{path} cannot be read: {error}.") from error
    if table.empty or not {"scene", "settings", "seed", "steps"} <= set(table):
        raise DustError(f"{path} is no table of runs by scene, settings and seed.")
    return table


def outcomes(table):
    """The Outcomes of a table of `read`, scene by scene, in the order of the settings."""
    result = []
    for scene, grains in table[["scene", "grains"]].dropna().drop_duplicates().values.tolist():
        # a run that was refused has no number of grains
        rows = table[(table.scene == scene) & table.grains.isin([grains, np.nan])]
        base = _finished(rows[rows.settings == AS_IT_IS])
        for settings, own in rows.groupby("settings", sort=False) if len(base) else ():
            result += _of_setting(own, base, scene=scene, grains=int(grains), settings=settings)
    return result


def _finished(rows):
    return rows[rows.status.str.startswith("finished")]


def _of_setting(rows, base, **about):
    finished = _finished(rows)
    about["seeds"] = len(finished)
    if finished.empty:
        nothing = dict.fromkeys(NUMBERS, np.nan)
        return [Outcome(**about, **nothing, observable="", refused=rows.status.iloc[0])]
    seeds = set(finished.seed) & set(base.seed)
    both = [some[some.seed.isin(seeds)].set_index("seed") for some in (finished, base)]
    cost = np.divide(*(some.steps.mean() for some in both))
    contacts = finished.get("contacts a grain", pd.Series(dtype=float)).mean()
    result = []
    for name, columns in _observables(base).items():
        mine, right = (some[columns] for some in both)
        paired = mine.notna() & right.notna()
        if known := [name for name in columns if paired[name].mean() > MOST]:
            mine, right = (some.where(paired)[known] for some in (mine, right))
            numbers = _numbers(mine, right, base[known].std())
            numbers |= {"cost": float(cost), "contacts": float(contacts)}
            result.append(Outcome(**about, **numbers, observable=name))
    return result


def _numbers(mine, right, spread):
    """Numbers of an Outcome from tables (seed, pressure) of a setting and of the unchanged scene.

    Both are NaN where a pair of runs has no value. spread: standard deviation between seeds,
    (pressure,).
    """
    scale, change = abs(right.mean().mean()), mine - right
    rms = {"error": change.mean(), "uncertainty": change.sem(), "scatter": spread}
    numbers = {name: np.sqrt(np.mean(d.to_numpy() ** 2)) / scale for name, d in rms.items()}
    numbers |= {"value": mine.mean().mean(), "shift": change.mean().mean() / scale}
    return {name: float(v) for name, v in numbers.items()}


def _observables(rows):
    """Observable -> its columns, of those that the first row has; of a curve all pressures."""
    known = rows.columns[rows.iloc[0].notna()]
    curve = [name for name in rows if name.startswith(PHI)]
    result = {CURVE: curve} if set(curve) & set(known) else {}
    single = [n for n in TEXTS if n in known] + [n for n in known if n.startswith(STAGES)]
    return result | {name: [name] for name in single}


def text_of(observable):
    """Description of an observable."""
    prefix = next((p for p in STAGES if observable.startswith(p)), None)
    return f"{prefix}in stage {observable[len(prefix) :]}" if prefix else TEXTS[observable]


def front(cost, error) -> list[int]:
    """Numbers of the points of the Pareto front of cost and error, by growing cost.

    Parameters
    ----------
    cost
        (points,).
    error
        (points,). Points with a value that is NaN are left out.
    """
    cost, error = np.asarray(cost, dtype=float), np.asarray(error, dtype=float)
    known = np.flatnonzero(np.isfinite(cost) & np.isfinite(error))
    order = known[np.lexsort((error[known], cost[known]))]
    best = np.minimum.accumulate(np.append(np.inf, error[order]))[:-1]
    return order[error[order] < best].tolist()
