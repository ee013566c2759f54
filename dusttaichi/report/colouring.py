"""Colourings of the particles in the viewer: numbers and classes."""

import numpy as np

from dusttaichi.report.packing import packed, quantised

OUTLIERS = 99.0  # percentile of a skew quantity at which its colours end


def number_quantity(label, unit, values, rows):
    """A quantity that is a number; its colours end at a percentile where few are far out."""
    values = np.atleast_2d(values)
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    edge = float(np.percentile(finite, OUTLIERS))
    high = edge if edge > low and high > 3.0 * abs(edge) else high
    data = quantised(values, len(values) if len(values) == rows else 1)
    return {"label": label, "unit": unit, "kind": "number", "range": [low, high], "data": data}


def class_quantity(label, values, names, rows):
    """A quantity that is a class. values: of particles, names: of those numbers."""
    values = np.atleast_2d(values)
    data = packed(values.astype("u2"), len(values) if len(values) == rows else 1)
    names = {int(k): str(name) for k, name in names.items()}
    return {"label": label, "unit": "", "kind": "class", "names": names, "data": data}
