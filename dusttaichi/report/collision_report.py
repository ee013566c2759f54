"""The report of a study of collisions: outcomes, threshold speeds, figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dusttaichi import plots
from dusttaichi.analysis.collisions import format_collision_summary
from dusttaichi.analysis.outcome import PAGE
from dusttaichi.analysis.threshold_tables import (
    explain_missing_thresholds,
    format_threshold_columns,
)
from dusttaichi.analysis.thresholds import find_thresholds
from dusttaichi.report.interactive import make_interactive, render_picture
from dusttaichi.report.page import list_provenance, make_blank_report

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from dusttaichi.report.packing import Content

FIGURES = {
    "outcomes": "Outcomes over speed and impact parameter",
    "outcomes_mass_ratio": "Outcomes over speed and mass ratio",
    "thresholds": "Threshold speeds against the filling factor",
    "growth": "Growth efficiency",
    "spectrum": "Fragments beside the two largest",
    "phases": "Energy dissipated in compression and in stretching",
}
MAPS = {"outcomes", "outcomes_mass_ratio"}  # of rectangles, which are shown as a picture


def collect_collisions_data(data: xr.Dataset) -> Content:
    """Collect the report of a dataset of `analysis.open_collisions`: a dict for JSON."""
    keys, columns = format_threshold_columns(find_thresholds(data))
    names = [
        f"{body}, {ratio}:1" for body, ratio in zip(*(texts for _, texts in keys), strict=True)
    ]
    threshold_lines = [
        f"{name.removesuffix(' m/s')} of {body_name}: {speed_text} m/s"
        for name, texts in columns
        for body_name, speed_text in zip(names, texts, strict=True)
    ]
    threshold_lines = [
        speed_text for speed_text in threshold_lines if not speed_text.endswith(": - m/s")
    ]
    lines = [
        *threshold_lines,
        *explain_missing_thresholds(data),
        f"outcomes and thresholds are defined in {PAGE}",
    ]
    title = f"{data.attrs.get('title', 'collisions')}, collisions"
    return make_blank_report(title, f"{data.outcome.size:,} collisions") | {
        "table": _table(data),
        "remark": "; ".join(lines),
        "views": [],
        "members": [],
        "figures": [_figure(*pair) for pair in plots.collision_figures(data).items()],
        "scene": str(np.atleast_1d(data.attrs.get("scene_resolved", ""))[0]).strip(),
        "provenance": list_provenance(data.attrs),
    }


def _table(data: xr.Dataset) -> list[list[str]]:
    """Rows of text: a header, and means over impact parameters and seeds at each speed."""
    keys, columns = format_collision_summary(data)
    both = [*keys, *columns]
    rows = zip(*(texts for _, texts in both), strict=True)
    return [[head for head, _ in both], *map(list, rows)]


def _figure(name: str, figure: Figure) -> Content:
    if name in MAPS:
        return {
            "name": name,
            "title": FIGURES[name],
            "image": render_picture(figure),
            "wide": False,
        }
    return make_interactive(figure, name, FIGURES[name])
