"""Cheapest settings for a kind of scene, from measurements (docs/validation/softening.csv).

The table `measured.csv` is a part of the program; its origin is in `docs/studies/trade.md`.
"""

from importlib import resources
from typing import Any

import numpy as np
import pandas as pd

from dusttaichi.analysis.observables import find_pareto_front
from dusttaichi.errors import DustError
from dusttaichi.scene import Scene
from dusttaichi.scene.numerics import DRAFT
from dusttaichi.studies.trade_plan import find_parameters

TABLE = resources.files("dusttaichi.studies") / "measured.csv"
COLUMNS = "kind scene grains settings observable cost error uncertainty scatter seeds".split()
AS_IT_IS = "as it is"  # settings of the unchanged scene
TOLERANCE = 0.05
LINES = 4  # at most
SEEDS = 3  # fewest of a measurement


def classify_scene(scene: Scene) -> str | None:
    """Kind of a scene, as the table names it; None where it is of none."""
    return find_parameters(scene).kind(scene)


def read_measurements() -> pd.DataFrame:
    """The table, rows with at least SEEDS seeds.

    cost: over that of the unchanged scene (`accuracy: balanced`). error: of the observable;
    uncertainty: of that error; scatter: between seeds.
    """
    with TABLE.open(encoding="utf-8") as file:
        table = pd.read_csv(file)
    return table[table.seeds >= SEEDS]


def list_suggestions(scene: Scene, tolerance: float = TOLERANCE) -> list[tuple[str, str]]:
    """(settings, text) for a scene, cheapest first.

    Their errors of all observables at all numbers of grains are below the tolerance or the scatter
    of the seeds; the text states cost and the largest error over the scatter. Raises DustError for
    a kind of scene without measurements.
    """
    table = read_measurements()
    rows = table[table.kind == classify_scene(scene)]
    if rows.empty:
        raise DustError(
            f"no measurements for this kind of scene; available: {', '.join(table.kind.unique())}. "
            "dust trade without --suggest measures this one"
        )
    fine = rows.error <= np.maximum(tolerance, rows.scatter)
    relative = rows.error / rows.scatter.clip(lower=1e-9)
    costs, worst_rows = [], []
    for settings, measured in rows.groupby("settings", sort=False):
        at_all_sizes = measured.grains.nunique() == rows.grains.nunique()
        if settings != AS_IT_IS and fine[measured.index].all() and at_all_sizes:
            costs.append(measured.cost.max())
            worst_rows.append(measured.loc[relative[measured.index].idxmax()])
    best = find_pareto_front(costs, [row.error for row in worst_rows])[:LINES]
    return [
        (
            worst_rows[number].settings,
            f"cost {costs[number]:.2f}, error {format_error(worst_rows[number])}",
        )
        for number in best
    ]


def list_draft_errors(scene: Scene) -> list[tuple[str, str]]:
    """Rows (name, value) of the errors of a draft, as measured on scenes of its kind.

    Empty for a scene that is no draft.
    """
    if getattr(scene.numerics, "accuracy", None) != DRAFT:
        return []
    table = read_measurements()
    rows = table[(table.kind == classify_scene(scene)) & (table.settings == f"accuracy {DRAFT}")]
    return [
        (f"error in {row.scene} ({row.kind}, {row.grains} grains)", format_error(row))
        for row in rows.itertuples()
    ] or [("error", "not measured for this kind of scene")]


def format_error(row: Any) -> str:
    """Error of a row of the table with its uncertainty and the observable."""
    worth = "within the scatter of seeds," if row.error <= row.scatter else "scatter of seeds"
    error, uncertainty, scatter = (
        f"{100 * fraction:.2g} %" for fraction in (row.error, row.uncertainty, row.scatter)
    )
    return f"{error} ± {uncertainty} ({row.observable}; {worth} {scatter})"
