"""Interactive report of runs: a self-contained HTML file, also updated while a run proceeds."""

from dusttaichi.names import exported
from dusttaichi.report.ensemble import ensemble_data
from dusttaichi.report.notebook import particle_view, run_html
from dusttaichi.report.page import check_output, html, report_data, write

__all__ = exported(globals())
