"""The order of the grains in memory."""

import numpy as np
import pytest

from dusttaichi.grains.order import PART, grain_order

SIDE = 16  # grains along an edge of a cube of them, a diameter of 2 apart


def cube():
    place = np.arange(SIDE, dtype=float)
    grid = np.stack(np.meshgrid(place, place, place, indexing="ij"), axis=-1)
    return 2.0 * np.random.default_rng(1).permutation(grid.reshape(-1, 3))


@pytest.mark.parametrize("workers", [2, 4, 8])
def test_workers_have_blocks_of_the_sample(workers):
    """Each has a box of the cube, so that no more than its faces are another's neighbours: of a
    cube of n^3 grains one, two and three planes of n^2 pairs part 2, 4 and 8 workers."""
    x = cube()
    order = grain_order(x, 4.0)
    assert np.array_equal(np.sort(order), np.arange(len(x)))
    owner = np.empty(len(x), int)
    owner[order] = np.arange(len(x)) * workers // len(x)
    at = {tuple(place): own for place, own in zip(x, owner, strict=True)}
    parted = sum(
        at[place] != at[beyond]
        for place in at
        for beyond in [(place[0] + 2.0, *place[1:]), (place[0], place[1] + 2.0, place[2]),
                       (*place[:2], place[2] + 2.0)]
        if beyond in at
    )  # fmt: skip
    assert parted == {2: 1, 4: 2, 8: 3}[workers] * SIDE**2


def test_grains_at_the_first_cut_stand_together():
    """Last in each part, so that those of a half are as many runs as it has parts."""
    x = cube()
    order = grain_order(x, 4.0)
    half = x[order[: len(x) // 2]]
    axis = int(np.argmin(np.ptp(half, axis=0)))
    at_cut = half[:, axis] == half[:, axis].max()
    if half[:, axis].min() > 0.0:  # the upper half
        at_cut = half[:, axis] == half[:, axis].min()
    runs = np.count_nonzero(np.diff(at_cut.astype(int)) == 1)
    assert at_cut.sum() == SIDE**2 and runs <= len(half) // PART
