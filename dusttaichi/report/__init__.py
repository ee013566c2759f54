"""Interactive report of runs: a self-contained HTML file, also updated while a run proceeds."""

from dusttaichi.report.collision_report import collect_collisions_data
from dusttaichi.report.ensemble_report import collect_ensemble_data
from dusttaichi.report.notebook import render_run, view_particles
from dusttaichi.report.page import check_output, collect_report_data, render_page, write

__all__ = [
    "check_output",
    "collect_collisions_data",
    "collect_ensemble_data",
    "render_page",
    "view_particles",
    "collect_report_data",
    "render_run",
    "write",
]
