"""What extensions add to what results show: families of numbers, and figures, by their names.

Filled by `dusttaichi.analysis.numbers.register` and `dusttaichi.plots.register`.
"""

from typing import Any

NUMBERS: dict[str, Any] = {}
FIGURES: dict[str, Any] = {}
