"""Image flags of a file whose grains have left its cell: positions inside, or as flagged."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.samples.images import OPEN
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.touching import AT_REST


def apply_image_flags(
    sample: Sample,
    state: dict[str, Any],
    spec: Any,
    radius: float | NDArray[np.float64],
    check: Any,
) -> Sample:
    """Move grains to the images that the flags of their file name, unless fewer grains touch there.

    With the cell of the file in `keep`, and of a fragment, which contacts put together, the
    images make no difference, and the sample is returned as it is.

    Parameters
    ----------
    sample
    state
        That of the file; `unwrapped` are the other positions (N, 3) [m]. A remark is added.
    spec : ExplicitSample
    radius : float or array
        Radii of the grains [m].
    check : callable
        Function of positions and radii, which raises DustError where grains overlap too much.
    """
    x = state.pop("unwrapped", None)
    if x is None or spec.fragment is not None or {"box", "walls"} & set(spec.keep):
        return sample
    radii = np.broadcast_to(radius, len(sample)).astype(float)
    pairs_inside, pairs_outside = (
        len(OPEN.pairs(a, radii, 1.0 + AT_REST)) for a in (sample.positions, x)
    )
    remarks, flags = state.setdefault("remarks", []), state.pop("unwrapped_by")
    try:
        check(x, radius)
    except DustError:
        remarks.append(f"{flags} are not used: grains would overlap at the images that they name")
        return sample
    if pairs_outside < pairs_inside:
        remarks.append(
            f"{flags} are not used: {pairs_inside:,} pairs of grains touch inside of its cell, and "
            f"{pairs_outside:,} at the images that they name"
        )
        return sample
    moved = np.count_nonzero((x != sample.positions).any(axis=1))
    gain = (
        f", where {pairs_outside:,} pairs of grains touch and not {pairs_inside:,}"
        if pairs_outside > pairs_inside
        else ""
    )
    remarks.append(
        f"{flags} put {moved:,} of its {len(sample):,} grains outside of its cell{gain} "
        "(sample.columns with _ in their place leaves them inside)"
    )
    return replace(sample, positions=x)
