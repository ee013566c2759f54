"""A page that shows runs: one HTML file that needs no network, and the same growing with a run."""

from dusttaichi.report.ensemble import ensemble_data
from dusttaichi.report.notebook import particle_view, run_html
from dusttaichi.report.page import html, report_data, write

__all__ = ["ensemble_data", "html", "particle_view", "report_data", "run_html", "write"]
