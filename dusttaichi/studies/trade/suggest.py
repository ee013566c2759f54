"""Cheapest settings for a kind of scene, from measurements (docs/validation/softening.csv).

The table `measured.csv` is a part of the program; its origin is in `docs/studies/trade.md`.
"""

import csv
from dataclasses import dataclass
from importlib import resources

from dusttaichi.errors import DustError
from dusttaichi.scene.numerics import DRAFT
from dusttaichi.studies.trade.point import parameters_of

TABLE = "measured.csv"
AS_IT_IS = "as it is"  # settings of the unchanged scene
COLUMNS = "kind scene grains settings observable cost error uncertainty scatter seeds".split()
TOLERANCE = 0.05
MOST = 4  # lines
SEEDS = 3  # fewest of a measurement
KINDS = {
    "trade_omni": "compression in a box",
    "trade_omni_slow": "compression in a box",
    "trade_omni_3000": "compression in a box",
    "omni_box": "compression in a box",
    "trade_uni": "compression between plates",
    "uni_static": "compression between plates",
    "trade_tensile": "tension",
    "tensile_ice": "tension",
    "trade_isotropic": "compression from all sides",
    "trade_shear": "shear",
    "trade_collision": "collision",
}
"""Kind of the scenes that were measured, by name."""


@dataclass(frozen=True)
class Suggestion:
    """Settings with their cost and largest error.

    cost: over that of the unchanged scene (`accuracy: balanced`). observable: the one with the
    largest error over the scatter of its seeds; uncertainty: of that error.
    """

    settings: str
    cost: float
    error: float
    uncertainty: float
    scatter: float
    observable: str

    @classmethod
    def of(cls, row, cost=None):
        """Setting from a row of the table; cost: in place of that of the row."""
        numbers = (float(row[name]) for name in ("error", "uncertainty", "scatter"))
        cost = float(row["cost"]) if cost is None else cost
        return cls(row["settings"], cost, *numbers, row["observable"])

    def text(self):
        """Cost, error and observable in one line."""
        return f"cost {self.cost:.2f}, error {self.error_text()}"

    def error_text(self):
        """Error with its uncertainty and the observable."""
        if self.error <= self.scatter:
            worth = f"within the scatter of seeds, {_percent(self.scatter)}"
        else:
            worth = f"scatter of seeds {_percent(self.scatter)}"
        error = f"{_percent(self.error)} ± {_percent(self.uncertainty)}"
        return f"{error} ({self.observable}; {worth})"


def _percent(share):
    return f"{100 * share:.2g} %"


def kind_of(scene):
    """Kind of a scene, of KINDS; None where it is of none."""
    return parameters_of(scene).kind(scene)


def kind_of_grains(scene):
    """Kind of a scene of grains, see `kind_of`."""
    if scene.push or scene.sphere is not None:
        return None
    if scene.sample.flies:
        return "collision"
    drives = [plan.drive for plan in scene.stage_plans]
    if any(drive.shears for drive in drives):
        return "shear"
    if any(any(speed > 0 for speed in drive.face_speed or ()) for drive in drives):
        return "tension"
    pressed = any((drive.wall_speed or 0.0) > 0 or drive.pressure is not None for drive in drives)
    if pressed and scene.boundary.kind in ("box", "plates"):
        return "compression in a box" if scene.boundary.kind == "box" else KINDS["trade_uni"]
    if scene.boundary.kind == "periodic" and any(drive.moving_faces for drive in drives):
        return KINDS["trade_isotropic"]
    return None


def measured(kind):
    """Rows of the table for a kind of scene, with at least SEEDS seeds, dicts of text."""
    text = resources.files("dusttaichi.studies.trade").joinpath(TABLE).read_text("utf-8")
    rows = [row for row in csv.DictReader(text.splitlines()) if row["kind"] == kind]
    return [row for row in rows if int(row["seeds"]) >= SEEDS]


def suggestions(scene, tolerance=TOLERANCE):
    """Suggestions for a scene, cheapest first.

    Their errors of all observables at all numbers of grains are below the tolerance or the scatter
    of the seeds. Raises DustError for a kind of scene without measurements.
    """
    kind = kind_of(scene)
    rows = [] if kind is None else measured(kind)
    if not rows:
        known = ", ".join(own for own in dict.fromkeys(KINDS.values()) if measured(own))
        raise DustError(
            f"no measurements for this kind of scene; available: {known}. dust trade without "
            "--suggest measures this one"
        )
    groups = {}
    for row in rows:
        groups.setdefault(row["settings"], []).append(row)
    sizes = {row["grains"] for row in rows}
    found = []
    groups.pop(AS_IT_IS, None)
    for some in groups.values():
        if any(float(row["error"]) > max(tolerance, float(row["scatter"])) for row in some):
            continue
        if {row["grains"] for row in some} != sizes and len(sizes) > 1:
            continue
        worst = max(some, key=lambda row: float(row["error"]) / max(float(row["scatter"]), 1e-9))
        cost = max(float(row["cost"]) for row in some)
        found.append(Suggestion.of(worst, cost))
    return _front(sorted(found, key=lambda own: own.cost))


def draft_rows(scene):
    """Rows (what, value) of the errors of a draft, as measured on scenes of its kind.

    Empty for a scene that is no draft.
    """
    if getattr(scene.numerics, "accuracy", None) != DRAFT:
        return []
    rows = [row for row in measured(kind_of(scene)) if row["settings"] == f"accuracy {DRAFT}"]
    if not rows:
        return [("error", "not measured for this kind of scene")]
    return [
        (
            f"error in {row['scene']} ({row['kind']}, {row['grains']} grains)",
            Suggestion.of(row).error_text(),
        )
        for row in rows
    ]


def _front(found):
    """The cheapest, and each more expensive one with a smaller error."""
    out, least = [], float("inf")
    for own in found:
        if own.error < least:
            out.append(own)
            least = own.error
    return out[:MOST]


def to_table(outcomes):
    """Rows of the table for the Outcomes of docs/outcomes.py, dicts of text."""
    out = []
    for own in outcomes:
        if own.refused or own.scene not in KINDS:
            continue
        row = {"kind": KINDS[own.scene]}
        row |= {name: getattr(own, name) for name in COLUMNS if name != "kind"}
        numbers = {k: f"{v:.4g}" for k, v in row.items() if isinstance(v, float)}
        out.append(row | numbers)
    return out
