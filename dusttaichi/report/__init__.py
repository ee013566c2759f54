"""A page that shows runs: one HTML file that needs no network, and the same growing with a run."""

from dusttaichi.report.page import html, particle_view, report_data, write

__all__ = ["html", "particle_view", "report_data", "write"]
