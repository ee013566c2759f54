"""Numbers, figures, statistics, thresholds and laws of extensions, by their names.

Filled by `register` of `dusttaichi.analysis.numbers`, `analysis.thresholds`, `analysis.isotropic`
and `plots`.
"""

from typing import Any

NUMBERS: dict[str, Any] = {}
FIGURES: dict[str, Any] = {}
STATISTICS: dict[str, Any] = {}
THRESHOLDS: dict[str, Any] = {}
PRESSURES: dict[str, Any] = {}
