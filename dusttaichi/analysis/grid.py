"""The table of `dust trade --grid`: cost and error of each setting, and the scatter of seeds.

A setting is the mean over its seeds; its error is the difference of that mean from the mean of the
scene as it is.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from dusttaichi.errors import DustError

AS_IT_IS = "as it is"
CURVE, PHI = "phi(P)", "phi at "
SHEAR = "shear strength "
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

    cost: steps over those of the scene as it is. value: mean (of a curve the mean filling factor).
    error: of the mean, relative to that of the scene as it is with the same seeds; of a curve the
    root mean square over its pressures. scatter: standard deviation between the seeds of the scene
    as it is, relative as well. seeds: number of finished runs. contacts: contacts a grain at the
    end. refused: why there is no result, or "".
    """

    scene: str
    grains: int
    settings: str
    observable: str
    cost: float
    value: float
    error: float
    scatter: float
    seeds: int
    contacts: float
    refused: str = ""

    @property
    def hidden(self):
        """True where the error is within the scatter of the seeds."""
        return self.error <= self.scatter


def read(path):
    """The pandas.DataFrame of a `grid.csv`. Raises DustError."""
    try:
        table = pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise DustError(f"{path} cannot be read: {error}.") from error
    if table.empty or not {"scene", "settings", "seed", "steps"} <= set(table):
        raise DustError(f"{path} is no table of dust trade --grid.")
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
        nothing = dict.fromkeys(("cost", "value", "error", "scatter", "contacts"), np.nan)
        return [Outcome(**about, **nothing, observable="", refused=rows.status.iloc[0])]
    seeds = set(finished.seed) & set(base.seed)
    both = [some[some.seed.isin(seeds)] for some in (finished, base)]
    cost = np.divide(*(some.steps.mean() for some in both))
    contacts = finished.get("contacts a grain", pd.Series(dtype=float)).mean()
    result = []
    for name, columns in _observables(base).items():
        mean, right = (some[columns].mean() for some in both)
        known = mean.notna() & right.notna()
        if known.any():
            mean, right, spread = (v[known].to_numpy() for v in (mean, right, base[columns].std()))
            scale = abs(right.mean())
            error, scatter = (np.sqrt(np.mean(d**2)) / scale for d in (mean - right, spread))
            numbers = dict(cost=cost, value=mean.mean(), error=error, scatter=scatter)
            numbers = {key: float(v) for key, v in (numbers | {"contacts": contacts}).items()}
            result.append(Outcome(**about, **numbers, observable=name))
    return result


def _observables(rows):
    """Observable -> its columns, of those that the first row has; of a curve all pressures."""
    known = rows.columns[rows.iloc[0].notna()]
    curve = [name for name in rows if name.startswith(PHI)]
    result = {CURVE: curve} if set(curve) & set(known) else {}
    single = [n for n in TEXTS if n in known] + [n for n in known if n.startswith(SHEAR)]
    return result | {name: [name] for name in single}


def text_of(observable):
    """Description of an observable."""
    return TEXTS.get(observable, observable.replace("strength ", "strength in stage "))
