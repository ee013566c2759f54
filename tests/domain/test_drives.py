"""The loops may be laid out for a CPU or a GPU, in blocks of any width: the physics is the same."""

import numpy as np
import pytest

from dusttaichi import samples
from dusttaichi.compute.backend import Loops
from dusttaichi.grains.build import build
from dusttaichi.scene import from_yaml

SCENE = """
name: drives
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 3}
boundary: {kind: box, wall_speed: 2 m/s}
stop: {steps: 600}
numerics: {time_step: 0.3 ns, threads: 1, skin: 0.05, precision: f64, newton_steps: 2}
"""


def move_plates(loops):
    scene = from_yaml(SCENE)
    sim = build(scene, samples.make(scene), loops=loops)
    sim.advance(600)
    assert sim.search.count > 5  # lists were remade on the way
    return np.array(sim.motion.measure()), sim.ledger.measure_energies()


@pytest.fixture(scope="module")
def usual():
    return move_plates(None)


@pytest.mark.parametrize(
    "loops", [Loops(1, 1, "launches"), pytest.param(Loops(4, 2, "workers"), marks=pytest.mark.long)]
)
def test_another_layout_gives_the_same_motion(loops, usual, launches):
    state, m = move_plates(loops)
    # compilers may fuse a multiply and an add here and not there: rounding, grown over 600 steps
    np.testing.assert_allclose(state[0], usual[0][0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(state[1:], usual[0][1:], rtol=0, atol=1e-9)
    assert m["contacts"] == usual[1]["contacts"]
    np.testing.assert_allclose(m["loss"], usual[1]["loss"], rtol=1e-9, atol=1e-12)
    assert m["wall_work"] == pytest.approx(usual[1]["wall_work"], rel=1e-9)
