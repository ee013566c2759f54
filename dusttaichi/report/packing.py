"""Arrays and quantities as text: differences, byte planes, deflate, base64 (data.js)."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Content = dict[str, Any]  # plain data of a page, for its JSON

LEVEL = 6
OUTLIERS = 99.0  # percentile of a skewed quantity at which its colours end


def pack_array(values: ArrayLike, rows: int = 1) -> Content:
    """Pack an array for JSON: a dict, of unsigned integers or of 32-bit floats, as it is.

    rows: number of rows of one length; of integers, rows after the first are stored as
    differences from the previous row, which are small where values change little.
    """
    values = np.ascontiguousarray(values)
    data_type = f"{values.dtype.kind}{values.dtype.itemsize}"
    flat = values.reshape(rows, -1)
    if values.dtype.kind == "u" and rows > 1:
        flat = np.concatenate([flat[:1], np.diff(flat, axis=0)])  # wraps around, as JavaScript's
    planes = np.ascontiguousarray(flat.astype(values.dtype.newbyteorder("<"))).view(np.uint8)
    planes = planes.reshape(-1, values.dtype.itemsize).T
    text = base64.b64encode(zlib.compress(planes.tobytes(), LEVEL)).decode()
    return {"type": data_type, "rows": rows, "data": text}


def quantise(values: ArrayLike, rows: int = 1) -> Content:
    """Quantise numbers: integers of 16 bits between the smallest and the largest.

    The error is half of 1/65535 of the range. Values that are not a number are 0, and
    then `gap` is the value below which there are none.
    """
    values = np.asarray(values, dtype=float)
    finite = np.isfinite(values)
    low, high = (values[finite].min(), values[finite].max()) if finite.any() else (0.0, 0.0)
    span, largest_integer = float(high - low) or 1.0, 2**16 - 1
    first = 0 if finite.all() else 1
    step = span / (largest_integer - first)
    integers = np.where(finite, np.round((np.where(finite, values, low) - low) / step) + first, 0)
    result = pack_array(np.clip(integers, 0, largest_integer).astype("u2"), rows)
    bottom = float(low) - first * step
    result |= {"low": bottom, "high": bottom + largest_integer * step}
    return result if first == 0 else result | {"gap": bottom + 0.5 * step}


def make_number_quantity(label: str, unit: str, values: ArrayLike, rows: int) -> Content | None:
    """Make a numerical quantity; its colours end at a percentile if it has outliers."""
    values = np.atleast_2d(values)
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    edge = float(np.percentile(finite, OUTLIERS))
    high = edge if edge > low and high > 3.0 * abs(edge) else high
    data = quantise(values, len(values) if len(values) == rows else 1)
    return {"label": label, "unit": unit, "kind": "number", "range": [low, high], "data": data}


def make_class_quantity(
    label: str, values: ArrayLike, names: Mapping[int, object], rows: int
) -> Content:
    """Make a quantity of classes. values: class numbers of the particles, names: of the classes."""
    values = np.atleast_2d(values)
    data = pack_array(values.astype("u2"), len(values) if len(values) == rows else 1)
    names = {int(k): str(name) for k, name in names.items()}
    return {"label": label, "unit": "", "kind": "class", "names": names, "data": data}
