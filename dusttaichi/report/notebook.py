"""HTML of a run for a notebook."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from dusttaichi.analysis import summarise, tabulate
from dusttaichi.errors import DustError
from dusttaichi.plots import draw_figures
from dusttaichi.report.interactive import render_picture
from dusttaichi.report.page import render_page
from dusttaichi.report.viewer_particles import collect_particles

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run

# main figures in the order of their priority
MAIN = ("compression", "tensile", "isotropic", "collision", "impact", "dust", "sound_speed")
HEIGHT = 470  # pixels of the particles in 3-D


class View:
    """HTML in a frame of a notebook. text: a complete page."""

    def __init__(self, text: str) -> None:
        self.text = text

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(self.text, quote=True)}" width="100%" '
            f'height="{HEIGHT}" style="border:0" loading="lazy"></iframe>'
        )


def view_particles(run: Run) -> View:
    """Show the particles of a Run in 3-D, a View. Raises DustError for a run without snapshots."""
    view = collect_particles(run) if run.tree is not None else None
    if view is None:
        raise DustError(f"{run.path} has no snapshots: set output: snapshots in the scene.")
    return View(render_page({"title": run.name, "viewer": view}))


def render_run(run: Run) -> str:
    """Render name, numbers with those of the literature, and main figure of a Run as HTML."""
    cells = [[*row] for row in tabulate(summarise(run))]
    rows = "".join(
        "<tr>" + "".join(f"<td style='text-align:left'>{escape(c)}</td>" for c in row) + "</tr>"
        for row in cells
    )
    shown = f"<table><caption><b>{escape(run.name)}</b></caption>{rows}</table>"
    figures = draw_figures(run, failed=[])
    name = next((name for name in (*MAIN, *figures) if name in figures), None)
    image = (
        ""
        if name is None
        else f'<img src="{render_picture(figures[name])}" style="max-width:520px">'
    )
    return f'<div style="display:flex;flex-wrap:wrap;gap:1.5em">{shown}<div>{image}</div></div>'
