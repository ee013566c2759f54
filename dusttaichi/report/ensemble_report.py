"""The report of an ensemble or a sweep: curves, numbers, and the runs in 3-D."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dusttaichi import plots
from dusttaichi.analysis import ensemble_tables as tables
from dusttaichi.analysis import open_run
from dusttaichi.analysis.numbers import statistics
from dusttaichi.errors import DustError
from dusttaichi.report.interactive import make_interactive
from dusttaichi.report.page import list_provenance, make_blank_report
from dusttaichi.report.viewer_particles import MOST, collect_particles

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.report.packing import Content

FIGURES = {
    "ensemble": "Mean and scatter of the replicas",
    "sweep": "Mean and scatter of each point",
    "points": "Each curve, with the others in the background",
    "numbers": "Numbers of the runs",
}
MOST_RUNS = 24  # largest number of runs with particles, evenly chosen


def collect_ensemble_data(data: xr.Dataset, file: Path) -> Content:
    """Collect the report of a dataset of `analysis.gather` in `file`: a dict for JSON.

    Curves, numbers against the swept keys, and the particles of the runs in the same folder.
    """
    title = f"{data.attrs['title']}, {'sweep' if tables.axes_of(data) else 'ensemble'}"
    table, remark = _make_table(data)
    titles = FIGURES | {row.name: row.title for row in statistics()}
    failed: list[tuple[str, str]] = []
    figures = plots.draw_figures(data, failed)
    missing_lines = [
        f"no {quantity}{label and f', {label}'} ({runs}): {problem}"
        for quantity, label, runs, problem in tables.list_missing_numbers(data)
    ]
    missing_lines += [f"figure not drawn: {title}: {problem}" for title, problem in failed]
    statistics_lines = [
        f"{row.title}: {line}"
        for row, _, lines, _ in tables.statistics_tables(data)
        for line in lines
    ]
    return make_blank_report(title, _describe_axes(data)) | {
        "table": table,
        "remark": "; ".join(filter(None, [remark, *statistics_lines, *missing_lines])),
        "figures": [
            make_interactive(figure, name, titles[name]) for name, figure in figures.items()
        ],
        "views": _read_views(data, Path(file).parent),
        "members": _list_members(data),
        "scene": str(np.atleast_1d(data.attrs.get("scene_resolved", ""))[0]).strip(),
        "provenance": list_provenance(data.attrs),
    }


def _describe_axes(data: xr.Dataset) -> str:
    replicas, axis_texts = data.sizes["replica"], []
    values = zip(*tables.point_values(data), strict=True)
    for axis, texts in zip(tables.axes_of(data), values, strict=True):
        count = data.sizes[axis]
        value_text = f"at {count} values" if count > 1 else f"= {texts[0]}"
        (name,), key = tables.key_labels(data, [axis]), tables.key_of(data, axis)
        axis_texts.append(f"{name} ({key}) {value_text}")
    return ", ".join([*axis_texts, *[f"{replicas} replicas"] * (replicas > 1)])


def _make_table(data: xr.Dataset) -> tuple[list[list[str]], str]:
    """(rows of text, remark): a header, and the numbers, a row for each point or number."""
    axes = tables.axes_of(data)
    if not axes:
        names = tables.table_numbers(data)
        rows = [[tables.title_of(name), *tables.number_texts(data, name)] for name in names]
        return [["", "mean ± standard deviation"], *rows], ""
    keys, columns, remark = tables.head_and_columns(data)
    heads = [*(name for name, _ in keys), *(head for head, _ in columns)]
    lines = zip(*(texts for _, texts in [*keys, *columns]), strict=True)
    return [heads, *map(list, lines)], remark


def _list_members(data: xr.Dataset) -> list[list[str]]:
    """Rows of text: a header, and the status of each run."""
    status = data.status.values.ravel().tolist() if "status" in data else []
    rows = [
        [label, run_status] for label, run_status in zip(_label_runs(data), status, strict=False)
    ]
    return [["run", "status"], *rows] if rows else []


def _label_runs(data: xr.Dataset) -> list[str]:
    """A name for each run, in the order of the axes and then of the replicas."""
    several = data.sizes["replica"] > 1
    ends = [f"replica {n}" if several else "" for n in range(data.sizes["replica"])]
    points = tables.point_labels(data)
    return [", ".join(filter(None, pair)) for pair in ((p, e) for p in points for e in ends)]


def _read_views(data: xr.Dataset, parent: Path) -> list[Content]:
    """Read the particles of the runs in the folder that have snapshots, with their names."""
    if "directory" not in data:  # of an older version
        return []
    run_folders = [parent / str(folder_of_run) for folder_of_run in data.directory.values.ravel()]
    existing_runs = [
        pair for pair in zip(_label_runs(data), run_folders, strict=True) if pair[1].is_dir()
    ]
    if len(existing_runs) > MOST_RUNS:
        existing_runs = [
            existing_runs[n]
            for n in np.linspace(0, len(existing_runs) - 1, MOST_RUNS).round().astype(int)
        ]
    views = []
    for label, folder_of_run in existing_runs:
        try:
            with open_run(folder_of_run) as run:
                view = (
                    collect_particles(run, MOST // len(existing_runs))
                    if run.tree is not None
                    else None
                )
        except DustError:
            continue  # it failed or was replaced
        if view is not None:
            views.append({"name": label, "particles": view})
    return views
