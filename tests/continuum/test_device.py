"""Loops of a device, run on the CPU: the motion of workers."""

import numpy as np
import pytest
from continuum import dust

from dusttaichi.compute.backend import Loops
from dusttaichi.continuum.dust_build import build
from dusttaichi.continuum.kernels.store import COLUMN

LAUNCHES = Loops(1, 1, "launches")


@pytest.mark.long  # loops of a device: of grains, test_drives
def test_a_kernel_a_phase_gives_the_same_motion(launches):
    """The layout of a GPU, run on the CPU: walls that move, images, a search on the way."""
    scene, sample = dust.press_column(8, 1.0)
    ends, speeds = [], np.zeros((6, 3))
    speeds[5, 2] = -1.0
    for loops in (Loops(1, 1, "workers"), LAUNCHES):
        engine = build(scene, sample, loops=loops)
        engine.stepper.move_faces(speeds)
        engine.advance(5)
        assert engine.search.count > 1
        # in the order of the sample: blocks of particles are sorted in another one
        state = engine.dust_state
        arrays, order = dict(state.arrays()), np.argsort(state.of_particles("number"))
        arrays |= {name: arrays[name][order] for name in state.names}
        ends.append((arrays, state["rigid"][:, : COLUMN.drags]))
    for name, values in ends[0][0].items():
        # compilers may fuse a multiply and an add here and not there: rounding, grown over steps
        scale = np.abs(values).max(initial=0.0)
        np.testing.assert_allclose(ends[1][0][name], values, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(ends[1][1], ends[0][1], rtol=1e-9, atol=1e-12)
