"""The table of `dust trade --grid`: cost and error of each setting, beside the scatter of seeds.

Nothing here is of one run alone: a setting is the mean over its seeds, and its error the difference
of that from the mean of the scene as it is.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dusttaichi.errors import DustError

AS_IT_IS = "as it is"
CURVE, PHI = "phi(P)", "phi at "
# what a scene is run for, in the order of what is wanted first
WANTED = ("strength", "ratio", "growth_efficiency", "largest_share")
SHEAR = "shear strength "
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
    root of the mean square over its pressures. scatter: standard deviation between the seeds of the
    scene as it is, relative likewise. seeds: that ended. contacts: contacts a grain at the end.
    refused: why there is nothing, or "".
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
    """Rows of a `grid.csv` as dicts of text. Raises DustError."""
    try:
        with open(Path(path), newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise DustError(f"{path} cannot be read: {error}.") from error
    if not rows or not {"scene", "settings", "seed", "steps"} <= set(rows[0]):
        raise DustError(f"{path} is no table of dust trade --grid.")
    return rows


def outcomes(rows):
    """The Outcomes of rows, scene by scene, in the order of the settings."""
    found = []
    for scene, grains in dict.fromkeys((r["scene"], r["grains"]) for r in rows if r["grains"]):
        own = [r for r in rows if r["scene"] == scene and r["grains"] in (grains, "")]
        settings = list(dict.fromkeys(r["settings"] for r in own))
        base = [r for r in own if r["settings"] == AS_IT_IS and _ended(r)]
        for setting in settings if base else ():
            these = [r for r in own if r["settings"] == setting]
            found += _of_setting(scene, int(grains), setting, these, base)
    return found


def _ended(row):
    return row["status"].startswith("finished")


def _of_setting(scene, grains, setting, rows, base):
    ended = [r for r in rows if _ended(r)]
    about = {"scene": scene, "grains": grains, "settings": setting, "seeds": len(ended)}
    nothing = dict.fromkeys(("cost", "value", "error", "scatter", "contacts"), np.nan)
    if not ended:
        return [Outcome(**about, **nothing, observable="", refused=rows[0]["status"])]
    seeds = {r["seed"] for r in ended} & {r["seed"] for r in base}
    both = [[r for r in some if r["seed"] in seeds] for some in (ended, base)]
    steps = [np.mean([float(r["steps"]) for r in some]) for some in both]
    contacts = _mean(ended, "contacts a grain")
    out = []
    for name in _observables(base):
        values, reference = (_numbers(some, name) for some in both)
        everything = _numbers(base, name)
        known = np.isfinite(values).any(axis=0) & np.isfinite(reference).any(axis=0)
        if not known.any():
            continue
        mine, right = (np.nanmean(a[:, known], axis=0) for a in (values, reference))
        spread = np.nanstd(everything[:, known], axis=0, ddof=1) if len(base) > 1 else np.nan
        scale = abs(right.mean())
        out.append(
            Outcome(
                **about,
                observable=name,
                cost=float(steps[0] / steps[1]),
                value=float(mine.mean()),
                error=float(np.sqrt(np.mean((mine - right) ** 2)) / scale),
                scatter=float(np.sqrt(np.mean(spread**2)) / scale),
                contacts=contacts,
            )
        )
    return out


def _observables(rows):
    names = list(rows[0])
    found = [CURVE] if any(n.startswith(PHI) and rows[0][n] for n in names) else []
    found += [n for n in WANTED if rows[0].get(n)]
    return found + [n for n in names if n.startswith(SHEAR) and rows[0][n]]


def _numbers(rows, name):
    """(seeds, numbers) of an observable: of a curve all its pressures."""
    columns = [n for n in rows[0] if n.startswith(PHI)] if name == CURVE else [name]
    return np.array([[float(r.get(n) or "nan") for n in columns] for r in rows])


def _mean(rows, name):
    return float(np.mean([float(r.get(name) or "nan") for r in rows]))


def text_of(observable):
    """Description of an observable."""
    return TEXTS.get(observable, observable.replace("strength ", "strength in stage "))
