"""Numbers, figures, statistics, thresholds and laws of extensions, by their names.

Filled by `register` of `dusttaichi.analysis.numbers`, `analysis.thresholds`, `analysis.isotropic`
and `plots`.
"""

from __future__ import annotations

from typing import Any

from dusttaichi.physics.registry import Registry

NUMBERS: Registry[str, Any] = Registry("family of numbers")
FIGURES: Registry[str, Any] = Registry("figure")
STATISTICS: Registry[str, Any] = Registry("statistics")
THRESHOLDS: Registry[str, Any] = Registry("threshold")
PRESSURES: Registry[str, Any] = Registry("law of the pressure")
