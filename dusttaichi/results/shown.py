"""Numbers, figures, statistics, thresholds and laws of extensions, by their names.

Filled by `register` of `dusttaichi.analysis.numbers`, `analysis.thresholds`, `analysis.isotropic`
and `plots`.
"""

from dusttaichi.physics.registry import Registry

NUMBERS = Registry("family of numbers")
FIGURES = Registry("figure")
STATISTICS = Registry("statistics")
THRESHOLDS = Registry("threshold")
PRESSURES = Registry("law of the pressure")
