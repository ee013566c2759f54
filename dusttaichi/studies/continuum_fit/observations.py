"""Observations of a material in grain runs: flow pressures, unloading slopes, largest tensions."""

from dataclasses import dataclass

import numpy as np

BIN = 0.01  #: Width in filling factor of the averages during a compression.

LEAST_GROWTH = 1.06
"""Smallest filling factor over that of the start: below it a cut cake is not connected."""

LEAST_RECORDS = 8  #: Fewest records of an unloading for its slope.

SETTLING = 0.2
"""Share of an unloading at its start that is left out, because of waves from the reversal."""

UNCERTAIN = 0.5  #: Largest relative error of a slope.

QUANTITIES = {
    "p": "mean pressure during compression",
    "q": "axial stress minus that at the sides during compression",
    "M": "slope of the axial stress during unloading",
    "lambda": "slope of the stress at the sides during unloading",
    "tension": "largest mean tension (minus the pressure)",
}


@dataclass(frozen=True)
class Observation:
    """One number [Pa] from a test, with the records it is from.

    quantity: of QUANTITIES. error: relative, of value. rows: records of the segment. scale [Pa]:
    unit of differences.
    """

    quantity: str
    segment: int
    phi: float
    value: float
    error: float
    rows: slice
    rate: float
    scale: float


def observations(test):
    """All Observations of a GrainTest."""
    found = []
    for number, segment in enumerate(test.segments):
        if segment.kind == "press":
            found += _pressed(number, segment, test.phi)
        elif segment.kind == "release":
            found += _unloaded(number, segment, _rate_before(test, number))
        elif segment.kind == "pull":
            found += _pulled(number, segment, _rate_before(test, number))
    return found


def _rate_before(test, number):
    """Rate of the last compression before a segment [1/s], 0 without one."""
    return next((s.rate for s in test.segments[number::-1] if s.kind == "press"), 0.0)


def seen(quantity, strain, stress):
    """Value [Pa] of a quantity in records: strain (n, 3), stress (n, ..., 3), rows along axis 0."""
    if quantity == "p":
        return stress.mean(axis=-1).mean(axis=0)
    if quantity == "q":
        side = 0.5 * (stress[..., 0] + stress[..., 1])
        return (stress[..., 2] - side).mean(axis=0)
    if quantity == "tension":
        return smooth(-stress.mean(axis=-1)).max(axis=0)
    along = stress[..., 2] if quantity == "M" else 0.5 * (stress[..., 0] + stress[..., 1])
    return -slope(strain[:, 2], along)


def slope(x, y):
    """Slope of a straight line through y (n, ...) against x (n,)."""
    x = x - x.mean()
    return np.tensordot(x, y - y.mean(axis=0), axes=(0, 0)) / (x @ x)


def smooth(values):
    """Running mean of values (n, ...) over a twelfth of them along axis 0, at least three."""
    width = min(max(len(values) // 12, 3), len(values))
    total = np.cumsum(np.concatenate([np.zeros_like(values[:1]), values]), axis=0)
    return (total[width:] - total[:-width]) / width


def middle(strain):
    """Strain in the middle of each interval, (n, 3) of (n + 1, 3)."""
    return 0.5 * (strain[1:] + strain[:-1])


def _pressed(number, segment, start):
    bins = np.floor(segment.phi / BIN).astype(int)
    for one in np.unique(bins):
        rows = np.flatnonzero(bins == one)
        phi = float(segment.phi[rows].mean())
        if phi < LEAST_GROWTH * start or len(rows) < 2:
            continue
        part = slice(int(rows[0]), int(rows[-1]) + 1)
        for quantity in ("p", "q"):
            value = float(seen(quantity, None, segment.stress[part]))
            if value > 0:
                yield Observation(quantity, number, phi, value, 0.05, part, segment.rate, value)


def _unloaded(number, segment, rate):
    first = int(np.ceil(SETTLING * len(segment.stress)))
    part = slice(first, len(segment.stress))
    if len(segment.stress) - first < LEAST_RECORDS:
        return
    strain, stress = middle(segment.strain)[part], segment.stress[part]
    M = float(seen("M", strain, stress))
    x = strain[:, 2] - strain[:, 2].mean()
    left = stress[:, 2] - stress[:, 2].mean() + M * x
    error = float(np.sqrt((left @ left) / (len(x) - 2) / (x @ x)))
    if M <= 0 or error > UNCERTAIN * M:
        return
    phi = float(segment.phi[part].mean())
    for quantity in ("M", "lambda"):
        value = float(seen(quantity, strain, stress))
        yield Observation(quantity, number, phi, value, max(error / M, 0.05), part, rate, M)


def _pulled(number, segment, rate):
    pull = smooth(-segment.pressure)
    top = int(np.argmax(pull))
    if pull[top] > 0 and top < len(pull) - 1:
        phi, value = float(smooth(segment.phi)[top]), float(pull[top])
        rows = slice(0, len(segment.stress))
        yield Observation("tension", number, phi, value, 0.05, rows, rate, value)
