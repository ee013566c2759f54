"""Families of numbers, figures and statistics of extensions, by their names.

Filled by `dusttaichi.analysis.numbers.register` and `dusttaichi.plots.register`.
"""

from typing import Any

NUMBERS: dict[str, Any] = {}
FIGURES: dict[str, Any] = {}
STATISTICS: dict[str, Any] = {}
