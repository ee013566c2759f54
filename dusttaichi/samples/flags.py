"""Positions of a file whose grains have left its cell: inside of it, or where image flags say."""

from dataclasses import replace

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.samples.images import OPEN
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.touching import AT_REST


def with_flags(sample: Sample, state: dict, spec, radius, check) -> Sample:
    """The sample at the images that the flags of its file name, unless fewer grains touch there.

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
    before, after = (len(OPEN.pairs(a, radii, 1.0 + AT_REST)) for a in (sample.positions, x))
    remarks, flags = state.setdefault("remarks", []), state.pop("unwrapped_by")
    try:
        check(x, radius)
    except DustError:
        remarks.append(f"{flags} are not used: grains would overlap at the images that they name")
        return sample
    if after < before:
        remarks.append(
            f"{flags} are not used: {before:,} pairs of grains touch inside of its cell, and "
            f"{after:,} at the images that they name"
        )
        return sample
    moved = np.count_nonzero((x != sample.positions).any(axis=1))
    gain = f", where {after:,} pairs of grains touch and not {before:,}" if after > before else ""
    remarks.append(
        f"{flags} put {moved:,} of its {len(sample):,} grains outside of its cell{gain} "
        "(sample.columns with _ in their place leaves them inside)"
    )
    return replace(sample, positions=x)
