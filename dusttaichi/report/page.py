"""The report of one run or several: its data as JSON, and the HTML with data and code."""

import json
from functools import cache
from html import escape
from importlib import resources

from dusttaichi import __version__, plots
from dusttaichi.analysis import summary, table
from dusttaichi.analysis.names import labels_of
from dusttaichi.analysis.numbers import reason
from dusttaichi.analysis.plain import plain
from dusttaichi.report.interactive import interactive
from dusttaichi.report.particles import particles
from dusttaichi.results import outputs

MARK = '<meta name="generator" content="dusttaichi'
NOT_DRAWN = "figure not drawn"
NOT_SHOWN = (
    *("scene", "scene_given", "scene_resolved", "sample", "history"),
    *("summary_numbers", "convention", "coordinate", "title"),
)


def report_data(runs):
    """Content of the report of Runs, a dict for JSON: title, lead, runs.

    Several runs have a table and figures that compare them.
    """
    one = runs[0]
    if len(runs) == 1:
        data = blank(one.name, _lead(one))
    else:
        data = blank(f"{len(runs)} runs", ", ".join(labels_of(runs)))
    names = labels_of(runs) if len(runs) > 1 else [one.name]
    data["runs"] = [_run(run, name) for run, name in zip(runs, names, strict=True)]
    if len(runs) > 1:
        data["figures"], failed = _shown(plots.draw_runs(runs))
        rest = [""] * (len(runs) - 1)
        data["table"] = _side_by_side(runs) + [[what, why, *rest] for what, why, _ in failed]
    return data


def blank(title, lead):
    """A report without content."""
    empty = {"table": [], "figures": [], "runs": []}
    return {"title": title, "lead": lead, "live": False, "stamp": 0, **empty}


def _lead(run):
    count, word = (run.attrs.get("particles"), "particles")
    if run.grains:
        count, word = run.grains, "grains"
    kind = {"box": "in a box", "plates": "between plates", "periodic": "in a periodic cell"}
    what = f"{int(count):,} {word}" if count else ""
    return f"{what} {kind.get(run.boundary, '')}".strip()


def _run(run, name):
    figures, failed = _shown(plots.draw_run(run))
    return {
        "name": name,
        "status": run.status,
        "table": [list(row) for row in [*table(summary(run)), *failed]],
        "figures": figures,
        "particles": particles(run) if run.tree is not None else None,
        "scene": run.attrs.get("scene_resolved", "").strip(),
        "provenance": provenance(run.attrs),
    }


def provenance(attrs):
    """Rows of the provenance in the attributes of a result."""
    return [[name, f"{value}"] for name, value in attrs.items() if name not in NOT_SHOWN]


def _shown(drawn):
    """(interactive figures, table rows of the failed ones), of the results of `plots.draw_run`."""
    shown, failed = [], []
    for row, figure, why in drawn:
        try:
            shown += [] if why else [interactive(figure, row.name, row.title)]
        except Exception as error:  # does not affect the others
            why = reason(error)
        failed += [(NOT_DRAWN, f"{row.title}: {why}", "")] if why else []
    return shown, failed


def _side_by_side(runs):
    """Rows of the numbers, a column for each run."""
    tables = [dict((what, value) for what, value, _ in table(summary(run))) for run in runs]
    names = list(dict.fromkeys(name for rows in tables for name in rows))
    rows = [[name, *(rows.get(name, "") for rows in tables)] for name in names]
    return [["", *labels_of(runs)], *rows]


# -- HTML ----------------------------------------------------------------------------------------


@cache
def asset(name):
    """The text of a bundled file."""
    return resources.files("dusttaichi.report").joinpath("assets", name).read_text("utf-8")


def as_json(data):
    """JSON that is valid in HTML: without infinities and ends of scripts."""
    return json.dumps(plain(data), ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")


def html(data):
    """The report of `report_data` as one self-contained HTML text."""

    def script(name):
        return asset(name).replace("</script", "<\\/script")

    licence = asset("LICENSES.txt").replace("--", "- -")
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'{MARK} {__version__}">',
            '<link rel="icon" href="data:,">',
            f"<title>{escape(data['title'], quote=False)}</title>",
            f"<!--\n{licence}\n-->",
            f"<style>{asset('report.css')}</style></head>",
            "<body><main><p>This page needs JavaScript.</p></main>",
            f'<script type="application/json" id="data">{as_json(data)}</script>',
            *([] if "viewer" in data else [f"<script>{script('plotly.js')}</script>"]),
            f"<script>{script('report.js')}</script>",
            "</body></html>",
        ]
    )


def check_output(path):
    """The Path of a report, if it may be written. Raises DustError; see results.outputs."""
    return outputs.check(path, MARK)


def write(data, path):
    """Write the report to `path`; returns it. Raises DustError where it cannot be written."""
    return outputs.write(path, html(data), MARK)
