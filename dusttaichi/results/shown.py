"""Numbers, figures, statistics and thresholds of extensions, by their names.

Filled by `register` of `dusttaichi.analysis.numbers`, `plots` and `analysis.thresholds`.
"""

from typing import Any

NUMBERS: dict[str, Any] = {}
FIGURES: dict[str, Any] = {}
STATISTICS: dict[str, Any] = {}
THRESHOLDS: dict[str, Any] = {}
