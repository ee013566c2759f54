"""Cheapest settings for a kind of scene, from measurements (docs/validation/softening.csv).

The table `measured.csv` is a part of the program; its origin is in `docs/studies/trade.md`.
"""

from importlib import resources

import numpy as np
import pandas as pd

from dusttaichi.analysis.observables import find_pareto_front
from dusttaichi.errors import DustError
from dusttaichi.scene.numerics import DRAFT
from dusttaichi.studies.trade_plan import find_parameters

TABLE = resources.files("dusttaichi.studies") / "measured.csv"
COLUMNS = "kind scene grains settings observable cost error uncertainty scatter seeds".split()
AS_IT_IS = "as it is"  # settings of the unchanged scene
TOLERANCE = 0.05
MOST = 4  # lines
SEEDS = 3  # fewest of a measurement


def kind_of(scene):
    """Kind of a scene, as the table names it; None where it is of none."""
    return find_parameters(scene).kind(scene)


def measured():
    """The table, rows with at least SEEDS seeds.

    cost: over that of the unchanged scene (`accuracy: balanced`). error: of the observable;
    uncertainty: of that error; scatter: between seeds.
    """
    with TABLE.open(encoding="utf-8") as file:
        table = pd.read_csv(file)
    return table[table.seeds >= SEEDS]


def suggestions(scene, tolerance=TOLERANCE):
    """(settings, text) for a scene, cheapest first.

    Their errors of all observables at all numbers of grains are below the tolerance or the scatter
    of the seeds; the text states cost and the largest error over the scatter. Raises DustError for
    a kind of scene without measurements.
    """
    table = measured()
    rows = table[table.kind == kind_of(scene)]
    if rows.empty:
        raise DustError(
            f"no measurements for this kind of scene; available: {', '.join(table.kind.unique())}. "
            "dust trade without --suggest measures this one"
        )
    fine = rows.error <= np.maximum(tolerance, rows.scatter)
    relative = rows.error / rows.scatter.clip(lower=1e-9)
    found = []
    for settings, some in rows.groupby("settings", sort=False):
        everywhere = some.grains.nunique() == rows.grains.nunique()
        if settings != AS_IT_IS and fine[some.index].all() and everywhere:
            worst = some.loc[relative[some.index].idxmax()]
            found.append((some.cost.max(), worst))
    best = find_pareto_front([cost for cost, _ in found], [worst.error for _, worst in found])[
        :MOST
    ]
    return [
        (worst.settings, f"cost {cost:.2f}, error {error_text(worst)}")
        for cost, worst in (found[number] for number in best)
    ]


def draft_rows(scene):
    """Rows (what, value) of the errors of a draft, as measured on scenes of its kind.

    Empty for a scene that is no draft.
    """
    if getattr(scene.numerics, "accuracy", None) != DRAFT:
        return []
    table = measured()
    rows = table[(table.kind == kind_of(scene)) & (table.settings == f"accuracy {DRAFT}")]
    return [
        (f"error in {row.scene} ({row.kind}, {row.grains} grains)", error_text(row))
        for row in rows.itertuples()
    ] or [("error", "not measured for this kind of scene")]


def error_text(row):
    """Error of a row of the table with its uncertainty and the observable."""
    worth = "within the scatter of seeds," if row.error <= row.scatter else "scatter of seeds"
    error, uncertainty, scatter = (
        f"{100 * share:.2g} %" for share in (row.error, row.uncertainty, row.scatter)
    )
    return f"{error} ± {uncertainty} ({row.observable}; {worth} {scatter})"
