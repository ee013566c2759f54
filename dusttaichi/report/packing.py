"""Arrays as text of a page: differences, byte planes, deflate, base64; unpacked by data.js."""

import base64
import zlib

import numpy as np

LEVEL = 6


def packed(values, rows=1):
    """A dict for JSON of an array of unsigned integers or of 32-bit floats, as it is.

    rows: into how many rows of one length it falls; of integers each but the first is kept as the
    difference to the one before, which is small where things move little from row to row.
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


def quantised(values, rows=1, bits=16):
    """Numbers as whole ones of `bits` bits between their ends.

    The error is half of 1/65535 of the range for 16 bits. What is not a number is 0, and then
    `gap` says below which value there is none.
    """
    values = np.asarray(values, dtype=float)
    finite = np.isfinite(values)
    low, high = (values[finite].min(), values[finite].max()) if finite.any() else (0.0, 0.0)
    span, most = float(high - low) or 1.0, 2**bits - 1
    first = 0 if finite.all() else 1
    step = span / (most - first)
    whole = np.where(finite, np.round((np.where(finite, values, low) - low) / step) + first, 0)
    kept = packed(np.clip(whole, 0, most).astype(f"u{bits // 8}"), rows)
    bottom = float(low) - first * step
    kept |= {"low": bottom, "high": bottom + most * step}
    return kept if first == 0 else kept | {"gap": bottom + 0.5 * step}


def unpacked(kept):
    """The numbers of `packed` or `quantised` again, flat: what data.js does."""
    size = int(kept["type"][1])
    planes = np.frombuffer(zlib.decompress(base64.b64decode(kept["data"])), np.uint8)
    values = np.ascontiguousarray(planes.reshape(size, -1).T).view(f"<{kept['type']}").ravel()
    if kept["type"][0] == "u" and kept["rows"] > 1:
        rows = values.reshape(kept["rows"], -1)
        values = np.cumsum(rows, axis=0, dtype=values.dtype).ravel()
    if "low" not in kept:
        return values
    return kept["low"] + values * (kept["high"] - kept["low"]) / (2 ** (8 * size) - 1)
