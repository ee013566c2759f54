"""Interactive report of runs: a self-contained HTML file, also updated while a run proceeds."""

from dusttaichi.report.collisions import collisions_data
from dusttaichi.report.ensemble import ensemble_data
from dusttaichi.report.notebook import particle_view, run_html
from dusttaichi.report.page import check_output, html, report_data, write

__all__ = [
    "check_output",
    "collisions_data",
    "ensemble_data",
    "html",
    "particle_view",
    "report_data",
    "run_html",
    "write",
]
