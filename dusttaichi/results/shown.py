"""Numbers, figures, statistics, thresholds and laws of extensions, by their names.

Filled by `register` of `dusttaichi.analysis.numbers`, `plots` and `analysis.thresholds`; PRESSURES,
label -> law as in `analysis.isotropic`, by the extensions themselves.
"""

from typing import Any

NUMBERS: dict[str, Any] = {}
FIGURES: dict[str, Any] = {}
STATISTICS: dict[str, Any] = {}
THRESHOLDS: dict[str, Any] = {}
PRESSURES: dict[str, Any] = {}
