"""Observations of a material in grain runs: flow pressures, unloading slopes, largest tensions."""

from dataclasses import dataclass

import numpy as np

BIN = 0.01
"""Width in filling factor of what is averaged while a sample is pressed."""

LEAST_GROWTH = 1.06
"""Filling factor over that of the start from which pressing counts: until then a cake that was cut
hangs together only in parts."""

LEAST_RECORDS = 8
"""Records of a release from which its slope is taken."""

SETTLING = 0.2
"""Share of a release at its start that is left out: the push of turning round runs through."""

UNCERTAIN = 0.5
"""Error of a slope over itself from which it tells nothing."""

QUANTITIES = {
    "p": "mean pressure while pressed",
    "q": "axial stress less that at the sides while pressed",
    "M": "slope of the axial stress while let go",
    "lambda": "slope of the stress at the sides while let go",
    "tension": "largest mean tension (minus the pressure) while pulled",
}


@dataclass(frozen=True)
class Observation:
    """One number that a test shows [Pa], and how to see the same in another stress history.

    quantity: of QUANTITIES. error: of value, over itself. rows: records of the segment that it is
    made of. scale [Pa]: what a difference is measured by.
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
            found += _let_go(number, segment, _rate_before(test, number))
        elif segment.kind == "pull":
            found += _pulled(number, segment, _rate_before(test, number))
    return found


def _rate_before(test, number):
    """Rate of the last pressing before a segment [1/s]: what the sample came from."""
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
    """Strain half way through each interval, (n, 3) of (n + 1, 3)."""
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
                yield Observation(
                    quantity, number, phi, value, 0.05, part, segment.rate, value
                )  # fmt: skip


def _let_go(number, segment, rate):
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
        phi = float(smooth(segment.phi)[top])
        rows = slice(0, len(segment.stress))
        value = float(pull[top])
        yield Observation("tension", number, phi, value, 0.05, rows, rate, value)
