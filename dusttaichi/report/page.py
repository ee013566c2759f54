"""The report of one run or several: its data as JSON, and the HTML with data and code."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from html import escape
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dusttaichi import plots
from dusttaichi.analysis import summarise, tabulate
from dusttaichi.analysis.names import name_runs
from dusttaichi.analysis.numbers import reason
from dusttaichi.analysis.plain import convert_value
from dusttaichi.report.interactive import make_interactive
from dusttaichi.report.viewer_particles import collect_particles
from dusttaichi.results import outputs
from dusttaichi.results.provenance import __version__

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run
    from dusttaichi.plots.figure_registry import Drawn
    from dusttaichi.report.packing import Content

MARK = '<meta name="generator" content="dusttaichi'
NOT_DRAWN = "figure not drawn"
NOT_SHOWN = (
    *("scene", "scene_given", "scene_resolved", "sample", "history"),
    *("summary_numbers", "convention", "coordinate", "title"),
)


def collect_report_data(runs: Sequence[Run]) -> Content:
    """Collect the content of the report of Runs, a dict for JSON: title, lead, runs.

    Several runs have a table and figures that compare them.
    """
    first_run = runs[0]
    if len(runs) == 1:
        data = make_blank_report(first_run.name, _describe_run(first_run))
    else:
        data = make_blank_report(f"{len(runs)} runs", ", ".join(name_runs(runs)))
    names = name_runs(runs) if len(runs) > 1 else [first_run.name]
    data["runs"] = [_make_run_entry(run, name) for run, name in zip(runs, names, strict=True)]
    if len(runs) > 1:
        data["figures"], failed = _convert_figures(plots.draw_runs(runs))
        empty_cells = [""] * (len(runs) - 1)
        data["table"] = _compare_numbers(runs) + [
            [heading, problem, *empty_cells] for heading, problem, _ in failed
        ]
    return data


def make_blank_report(title: str, lead: str) -> Content:
    """Make a report without content."""
    empty: Content = {"table": [], "figures": [], "runs": []}
    return {"title": title, "lead": lead, "live": False, "stamp": 0, **empty}


def _describe_run(run: Run) -> str:
    count, word = (run.attrs.get("particles"), "particles")
    if run.grains:
        count, word = run.grains, "grains"
    boundary_texts = {
        "box": "in a box",
        "plates": "between plates",
        "tube": "in a tube",
        "periodic": "in a periodic cell",
    }
    count_text = f"{int(count):,} {word}" if count else ""
    return f"{count_text} {boundary_texts.get(run.boundary, '')}".strip()


def _make_run_entry(run: Run, name: str) -> Content:
    figures, failed = _convert_figures(plots.draw_run(run))
    return {
        "name": name,
        "status": run.status,
        "table": [list(row) for row in [*tabulate(summarise(run)), *failed]],
        "figures": figures,
        "particles": collect_particles(run) if run.tree is not None else None,
        "scene": run.attrs.get("scene_resolved", "").strip(),
        "provenance": list_provenance(run.attrs),
    }


def list_provenance(attrs: Mapping[str, Any]) -> list[list[str]]:
    """List the provenance in the attributes of a result, as rows."""
    return [[name, f"{value}"] for name, value in attrs.items() if name not in NOT_SHOWN]


def _convert_figures(
    figure_results: Iterable[Drawn],
) -> tuple[list[Content], list[tuple[str, str, str]]]:
    """(interactive figures, table rows of the failed ones), of the results of `plots.draw_run`."""
    interactive_figures, failed = [], []
    for row, figure, problem in figure_results:
        try:
            if figure is not None and not problem:
                interactive_figures.append(make_interactive(figure, row.name, row.title))
        except Exception as error:  # does not affect the others
            problem = reason(error)
        failed += [(NOT_DRAWN, f"{row.title}: {problem}", "")] if problem else []
    return interactive_figures, failed


def _compare_numbers(runs: Sequence[Run]) -> list[list[str]]:
    """Rows of the numbers, a column for each run."""
    tables = [
        dict((heading, value) for heading, value, _ in tabulate(summarise(run))) for run in runs
    ]
    names = list(dict.fromkeys(name for rows in tables for name in rows))
    rows = [[name, *(rows.get(name, "") for rows in tables)] for name in names]
    return [["", *name_runs(runs)], *rows]


# -- HTML ----------------------------------------------------------------------------------------


@cache
def read_asset(name: str) -> str:
    """Read the text of a bundled file."""
    return resources.files("dusttaichi.report").joinpath("assets", name).read_text("utf-8")


def format_json(data: object) -> str:
    """JSON that is valid in HTML: without infinities and ends of scripts."""
    return json.dumps(convert_value(data), ensure_ascii=False, allow_nan=False).replace(
        "<", "\\u003c"
    )


def render_page(data: Content) -> str:
    """Render the report of `collect_report_data` as one self-contained HTML text."""

    def script(name: str) -> str:
        return read_asset(name).replace("</script", "<\\/script")

    licence = read_asset("LICENSES.txt").replace("--", "- -")
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'{MARK} {__version__}">',
            '<link rel="icon" href="data:,">',
            f"<title>{escape(data['title'], quote=False)}</title>",
            f"<!--\n{licence}\n-->",
            f"<style>{read_asset('report.css')}</style></head>",
            "<body><main><p>This page needs JavaScript.</p></main>",
            f'<script type="application/json" id="data">{format_json(data)}</script>',
            *([] if "viewer" in data else [f"<script>{script('plotly.js')}</script>"]),
            f"<script>{script('report.js')}</script>",
            "</body></html>",
        ]
    )


def check_output(path: str | Path) -> Path:
    """The Path of a report, if it may be written. Raises DustError; see results.outputs."""
    return outputs.check(path, MARK)


def write(data: Content, path: str | Path) -> Path:
    """Write the report to `path`; returns it. Raises DustError where it cannot be written."""
    return outputs.write(path, render_page(data), MARK)
