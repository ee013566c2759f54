"""Prefix sums: on a core in one loop, on a device by chunks, the same numbers."""

import numpy as np
from scenes import make_scene

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Scan, scan_capacity


def test_both_ways_are_the_exclusive_sum():
    start_taichi(make_scene(), 1)
    room = 300 * CHUNK  # so that the sums of chunks make more than one chunk themselves
    values, one, other = (ti.field(ti.i32, shape=room) for _ in range(3))
    scan = Scan(ti.field(ti.i32, shape=scan_capacity(room)))
    assert scan.serial

    @ti.kernel
    def sums(n: ti.i32):
        scan.exclusive(values, one, n)
        scan.by_chunks(values, other, n)

    drawn = np.random.default_rng(1).integers(0, 9, room).astype(np.int32)
    values.from_numpy(drawn)
    for n in (room - 17, 3 * CHUNK + 17, CHUNK, 1):
        sums(n)
        expected = np.cumsum(drawn[:n]) - drawn[:n]
        for found in (one, other):
            assert np.array_equal(found.to_numpy()[:n], expected)
