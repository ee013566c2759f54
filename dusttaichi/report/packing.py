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
    """Numbers as whole ones of `bits` bits between their ends; what is not a number as the low end.

    The error is half of 1/65535 of the range for 16 bits.
    """
    values = np.asarray(values, dtype=float)
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    span, most = (high - low) or 1.0, 2**bits - 1
    whole = np.round((np.nan_to_num(values, nan=low) - low) / span * most)
    kept = packed(np.clip(whole, 0, most).astype(f"u{bits // 8}"), rows)
    return kept | {"low": low, "high": low + span}


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
