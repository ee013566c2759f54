"""The report of an ensemble or a sweep: curves, numbers, and the runs in 3-D."""

from pathlib import Path

import numpy as np

from dusttaichi import plots
from dusttaichi.analysis import ensemble_tables as tables
from dusttaichi.analysis import open_run
from dusttaichi.analysis.numbers import statistics
from dusttaichi.errors import DustError
from dusttaichi.report.interactive import interactive
from dusttaichi.report.page import blank, provenance
from dusttaichi.report.particles import MOST, particles

FIGURES = {
    "ensemble": "Mean and scatter of the replicas",
    "sweep": "Mean and scatter of each point",
    "points": "Each curve, with the others in the background",
    "numbers": "Numbers of the runs",
}
MOST_RUNS = 24  # largest number of runs with particles, evenly chosen


def ensemble_data(data, file):
    """Content of the report of a dataset of `analysis.gather` in `file`, as a dict for JSON.

    Curves, numbers against the swept keys, and the particles of the runs in the same folder.
    """
    title = f"{data.attrs['title']}, {'sweep' if tables.axes_of(data) else 'ensemble'}"
    table, remark = _table(data)
    titles = FIGURES | {row.name: row.title for row in statistics()}
    failed = []
    figures = plots.draw_figures(data, failed)
    lost = [f"no {what}{label and f', {label}'} ({runs}): {why}" for what, label, runs, why in
            tables.missing(data)]  # fmt: skip
    lost += [f"figure not drawn: {title}: {why}" for title, why in failed]
    said = [f"{row.title}: {line}" for row, _, lines, _ in tables.statistics_tables(data)
            for line in lines]  # fmt: skip
    return blank(title, _lead(data)) | {
        "table": table,
        "remark": "; ".join(filter(None, [remark, *said, *lost])),
        "figures": [interactive(figure, name, titles[name]) for name, figure in figures.items()],
        "views": _views(data, Path(file).parent),
        "members": _members(data),
        "scene": str(np.atleast_1d(data.attrs.get("scene_resolved", ""))[0]).strip(),
        "provenance": provenance(data.attrs),
    }


def _lead(data):
    replicas, said = data.sizes["replica"], []
    values = zip(*tables.point_values(data), strict=True)
    for axis, texts in zip(tables.axes_of(data), values, strict=True):
        count = data.sizes[axis]
        here = f"at {count} values" if count > 1 else f"= {texts[0]}"
        (name,), key = tables.key_labels(data, [axis]), tables.key_of(data, axis)
        said.append(f"{name} ({key}) {here}")
    return ", ".join([*said, *[f"{replicas} replicas"] * (replicas > 1)])


def _table(data):
    """(rows of text, remark): a header, and the numbers, a row for each point or number."""
    axes = tables.axes_of(data)
    if not axes:
        names = tables.table_numbers(data)
        rows = [[tables.title_of(name), *tables.number_texts(data, name)] for name in names]
        return [["", "mean ± standard deviation"], *rows], ""
    keys, columns, remark = tables.head_and_columns(data)
    heads = [*(name for name, _ in keys), *(head for head, _ in columns)]
    rows = zip(*(texts for _, texts in [*keys, *columns]), strict=True)
    return [heads, *map(list, rows)], remark


def _members(data):
    """Rows of text: a header, and the status of each run."""
    status = data.status.values.ravel().tolist() if "status" in data else []
    rows = [[label, said] for label, said in zip(_labels(data), status, strict=False)]
    return [["run", "status"], *rows] if rows else []


def _labels(data):
    """A name for each run, in the order of the axes and then of the replicas."""
    several = data.sizes["replica"] > 1
    ends = [f"replica {n}" if several else "" for n in range(data.sizes["replica"])]
    points = tables.point_labels(data)
    return [", ".join(filter(None, pair)) for pair in ((p, e) for p in points for e in ends)]


def _views(data, folder):
    """Particles of the runs in the folder that have snapshots, with their names."""
    if "directory" not in data:  # of an older version
        return []
    places = [folder / str(place) for place in data.directory.values.ravel()]
    there = [pair for pair in zip(_labels(data), places, strict=True) if pair[1].is_dir()]
    if len(there) > MOST_RUNS:
        there = [there[n] for n in np.linspace(0, len(there) - 1, MOST_RUNS).round().astype(int)]
    found = []
    for label, place in there:
        try:
            with open_run(place) as run:
                view = particles(run, MOST // len(there)) if run.tree is not None else None
        except DustError:
            continue  # it failed or was replaced
        if view is not None:
            found.append({"name": label, "particles": view})
    return found
