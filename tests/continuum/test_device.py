"""Loops and search of a device, run on the CPU: the motion of workers, the lists of a host."""

import numpy as np
import pytest
from continuum import dust

from dusttaichi.compute.backend import Loops
from dusttaichi.continuum.build import build
from dusttaichi.continuum.kernels.store import COLUMN
from dusttaichi.continuum.search import Search

LAUNCHES = Loops(1, 1, "launches")


def test_a_kernel_a_phase_gives_the_same_motion():
    """The layout of a GPU, run on the CPU: walls that move, images, a search on the way."""
    scene, sample = dust.pressed(8, 1.0)
    ends, speeds = [], np.zeros((6, 3))
    speeds[5, 2] = -1.0
    for loops in (Loops(1, 1, "workers"), LAUNCHES):
        sim = build(scene, sample, loops=loops)
        sim.move_faces(speeds)
        sim.advance(5)
        assert sim.search.count > 1
        # in the order of the sample: blocks of particles are sorted in another one
        arrays, order = sim.arrays(), np.argsort(sim.of_particles("number"))
        arrays |= {name: arrays[name][order] for name in sim.names}
        ends.append((arrays, sim.tables["rigid"].to_numpy()[:, : COLUMN.drags]))
    for name, values in ends[0][0].items():
        # compilers may fuse a multiply and an add here and not there: rounding, grown over steps
        scale = np.abs(values).max(initial=0.0)
        np.testing.assert_allclose(ends[1][0][name], values, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(ends[1][1], ends[0][1], rtol=1e-9, atol=1e-12)


def lists(sim):
    """All that a search leaves: particles in order, their lists, images and surfaces."""
    n, found = sim.n, {name: sim.of_particles(name) for name in sim.names}
    for name, columns in (("first", ["entry"]), ("touch_first", ["touch_row"]),
                          ("ghost_first", ["ghost_sign", "ghost_shift"])):  # fmt: skip
        found[name] = sim.lists[name].part(0, n + 1)
        for column in columns:
            found[column] = sim.lists[column].part(0, found[name][n])
    ghosts = n + found["ghost_first"][n]
    seen = ("x", "v", "volume", "side", "gap")
    return found | {
        f"of ghosts {name}": sim.tables[name].part(n, ghosts) for name in seen if name in sim.tables
    }


@pytest.mark.parametrize("make", [dust.pressed, dust.mirrored])
def test_a_device_finds_the_lists_of_the_host(make):
    """The very same, in the same order: after a search, and again from a checkpoint."""
    sim = build(*make(8, 1.0), loops=LAUNCHES)
    on_device = sim.search
    on_host = Search(sim, on_device.h, on_device.mirrors, on_device.edges, on_device.rigid)
    dust.stirred(sim)
    before = {name: sim.tables[name].to_numpy() for name in (*sim.names, "rigid")}
    found = []
    for search in (on_device, on_host):
        for name, values in before.items():
            sim.tables[name].from_numpy(values)
        search.now()
        found.append(lists(sim))
        sim.put("x", sim.of_particles("x") + 0.01 * dust.SPACING)
        search.again()
        found.append(lists(sim))
    assert found[0]["first"][-1] > 10 * sim.n and len(found[0]["ghost_sign"]) > 20
    assert len(found[0]["touch_row"]) > 6
    for ours, theirs in zip(found[:2], found[2:], strict=True):
        for name, values in theirs.items():
            assert np.array_equal(ours[name], values), name
