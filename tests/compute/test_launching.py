"""Kernels alone: arguments reach them with little work of Python; prefix sums in both ways."""

import numpy as np
import pytest
from scenes import make_scene

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, Scan, scan_capacity
from dusttaichi.compute.taichi_internals.launching import Launch


def test_arguments_reach_a_kernel_whatever_their_place_and_however_often():
    start_taichi(make_scene(), 1)
    Numbers = ti.types.struct(a=ti.f64, n=ti.i32, m=ti.types.matrix(2, 2, ti.f64))

    @ti.kernel
    def read(first: Numbers, integer: ti.i64, second: Numbers, number: ti.f64) -> ti.i32:
        first_sum = first.a + 10.0 * first.n + 100.0 * first.m[1, 0]
        second_sum = second.a + 10.0 * second.n + 100.0 * second.m[1, 0]
        return int(first_sum + 1000.0 * second_sum + 1e6 * integer + 1e7 * number)

    launch = Launch(read)
    numbers_a = Numbers(a=1.0, n=2, m=[[0.0, 0.0], [3.0, 0.0]])
    numbers_b = Numbers(a=4.0, n=5, m=[[0.0, 0.0], [6.0, 0.0]])
    # whole numbers in double precision: exact
    for k in range(3):
        assert launch(numbers_a, k, numbers_b, 2.0) == 20_654_321 + k * 1_000_000
        assert launch(numbers_b, 7, numbers_a, k) == 7_321_654 + k * 10_000_000
        assert launch(numbers_a, 7, numbers_a, k) == 7_321_321 + k * 10_000_000


def test_an_interrupted_call_leaves_none_of_its_arguments():
    class Interrupted(int):
        def __int__(self):
            raise KeyboardInterrupt

    start_taichi(make_scene(), 1)
    out = ti.field(ti.i32, shape=())

    @ti.kernel
    def add(n: ti.i32, m: ti.i32):
        out[None] = n + m

    launch = Launch(add)
    for _ in range(2):
        launch(1, 10)
        with pytest.raises(KeyboardInterrupt):
            launch(2, Interrupted())
        launch(1, 10)
        assert out[None] == 11


def test_a_kernel_is_found_again_after_a_start():
    @ti.kernel
    def add(n: ti.i32, m: ti.i32) -> ti.i32:
        return n + m

    launch = Launch(add)
    for k in range(2):
        start_taichi(make_scene(), 1)
        assert [launch(k, 10), launch(k, 10), launch(k, 20)] == [10 + k, 10 + k, 20 + k]


def test_both_ways_are_the_exclusive_sum():
    start_taichi(make_scene(), 1)
    room = 300 * CHUNK  # so that the sums of chunks make more than one chunk themselves
    values, first, second = (ti.field(ti.i32, shape=room) for _ in range(3))
    scan = Scan(ti.field(ti.i32, shape=scan_capacity(room)))
    assert scan.serial

    @ti.kernel
    def sums(n: ti.i32):
        scan.exclusive(values, first, n)
        scan.by_chunks(values, second, n)

    drawn = np.random.default_rng(1).integers(0, 9, room).astype(np.int32)
    values.from_numpy(drawn)
    for n in (room - 17, 3 * CHUNK + 17, CHUNK, 1):
        sums(n)
        expected = np.cumsum(drawn[:n]) - drawn[:n]
        for found in (first, second):
            assert np.array_equal(found.to_numpy()[:n], expected)
