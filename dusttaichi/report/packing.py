"""Arrays and quantities as text: differences, byte planes, deflate, base64 (data.js)."""

import base64
import zlib

import numpy as np

LEVEL = 6
OUTLIERS = 99.0  # percentile of a skewed quantity at which its colours end


def packed(values, rows=1):
    """A dict for JSON of an array of unsigned integers or of 32-bit floats, as it is.

    rows: number of rows of one length; of integers each but the first is stored as the difference
    from the previous one, which is small where the values change little from row to row.
    """
    values = np.ascontiguousarray(values)
    kind = f"{values.dtype.kind}{values.dtype.itemsize}"
    flat = values.reshape(rows, -1)
    if values.dtype.kind == "u" and rows > 1:
        flat = np.concatenate([flat[:1], np.diff(flat, axis=0)])  # wraps around, as JavaScript's
    planes = np.ascontiguousarray(flat.astype(values.dtype.newbyteorder("<"))).view(np.uint8)
    planes = planes.reshape(-1, values.dtype.itemsize).T
    text = base64.b64encode(zlib.compress(planes.tobytes(), LEVEL)).decode()
    return {"type": kind, "rows": rows, "data": text}


def quantised(values, rows=1):
    """Numbers as integers of 16 bits between their ends.

    The error is half of 1/65535 of the range. Values that are not a number are 0, and
    then `gap` is the value below which there are none.
    """
    values = np.asarray(values, dtype=float)
    finite = np.isfinite(values)
    low, high = (values[finite].min(), values[finite].max()) if finite.any() else (0.0, 0.0)
    span, most = float(high - low) or 1.0, 2**16 - 1
    first = 0 if finite.all() else 1
    step = span / (most - first)
    whole = np.where(finite, np.round((np.where(finite, values, low) - low) / step) + first, 0)
    result = packed(np.clip(whole, 0, most).astype("u2"), rows)
    bottom = float(low) - first * step
    result |= {"low": bottom, "high": bottom + most * step}
    return result if first == 0 else result | {"gap": bottom + 0.5 * step}


def number_quantity(label, unit, values, rows):
    """A numerical quantity; its colours end at a percentile if it has outliers."""
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
    """A quantity of classes. values: class numbers of the particles, names: of the classes."""
    values = np.atleast_2d(values)
    data = packed(values.astype("u2"), len(values) if len(values) == rows else 1)
    names = {int(k): str(name) for k, name in names.items()}
    return {"label": label, "unit": "", "kind": "class", "names": names, "data": data}
