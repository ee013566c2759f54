"""Memory of a continuum: capacities of its lists, and pages that lists do not use."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from continuum import dust

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import is_tested, ti
from dusttaichi.compute.large_fields import place_apart
from dusttaichi.compute.pages import PAGE
from dusttaichi.compute.taichi_internals.addresses import arrays_of
from dusttaichi.continuum import dust_build
from dusttaichi.continuum.kernels import store

ROWS = 8


def collect_state():
    """Arrays of the state of a pressed column after some steps."""
    engine = dust.moving(*dust.press_column(ROWS, 5.0))
    engine.advance(10)
    assert engine.search.count > 1
    return engine.state().arrays, engine.scratch


def test_lists_in_memory_of_their_own_have_the_same_bits(monkeypatch):
    arrays, together = collect_state()
    monkeypatch.setattr(dust_build, "capacity_for", lambda particles: particles)
    monkeypatch.setattr(store, "LONG", 0)
    arrays_apart, apart = collect_state()
    for name, values in arrays.items():
        np.testing.assert_array_equal(arrays_apart[name], values, err_msg=name)
    pieces = [
        len({table.field.snode._snode_tree_id for table in lists.values()})
        for lists in (together, apart)
    ]
    assert pieces == [1, 4]  # three lists, and all others


@pytest.mark.skipif(
    sys.platform != "linux" or not is_tested(), reason="memory of fields is not given back"
)
def test_unused_pages_of_a_long_list_take_no_memory():
    scene, _ = dust.press_column(ROWS, 1.0)
    start_taichi(scene, 1)
    length = 32 * 2**20
    before = resident()
    fields = place_apart({"long": (ti.i32, (length,)), "wide": (ti.f64, (length // 64, 8))})
    further = ti.field(ti.i32, shape=length // 4)
    memory = arrays_of(fields | {"further": further})
    grown = resident() - before
    expected = memory["further"].nbytes
    assert expected <= grown < expected + 2**24 < memory["long"].nbytes
    memory["long"][:] = 1
    assert memory["wide"].shape == (length // 64, 8) and not memory["wide"].any()
    assert fields["long"][length - 1] == 1 and fields["wide"][0, 0] == 0 and further[0] == 0


def resident():
    """Bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * PAGE


@pytest.mark.parametrize("density, factor", [(1.0, 1.0), (0.5, 2.0), (0.3, 4.0)])
def test_lists_have_room_for_all_that_dust_can_be_compacted(density, factor):
    """Of dust at its own density to the end of its compressive strength, 3.9 times as dense."""
    scene, sample = dust.press_column(ROWS, 1.0)
    sample = replace(sample, density=density * sample.density)
    capacity = dust_build.longest_list(dust_build.prepare(scene, sample))
    assert capacity == pytest.approx(factor * 150 * 1.6 / 4)
