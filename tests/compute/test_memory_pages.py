"""Pages of memory that go back to the system: zeros remain, and nothing else is touched."""

import mmap
import sys

import numpy as np
import pytest

from dusttaichi.compute.pages import LEAST, release

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="other systems fill with zeros")


@on_linux
@pytest.mark.parametrize("first", [0, 3, 1021])
def test_a_released_array_is_zero_and_its_neighbours_stay(first):
    memory = np.ones(LEAST, np.float64)
    array = memory[first : len(memory) - 5]
    assert release(array)
    assert not array.any() and memory[:first].all() and memory[-5:].all()


def test_small_and_scattered_arrays_are_left_alone():
    for array in np.ones(LEAST // 16), np.ones((LEAST, 2))[:, 0]:
        assert not release(array) and array.all()


@on_linux
def test_shared_memory_is_left_to_be_filled():
    """Its pages keep their content, which a mark shows."""
    array = np.frombuffer(mmap.mmap(-1, 2 * LEAST), np.uint8)
    array[:] = 1
    assert not release(array)
