"""Edges that grow or shrink at a rate: where they are, and when a stage ends."""

import numpy as np
import pytest
from scenes import RADIUS, Probe, make_scene, residual, sample_of

from dusttaichi.domain.clock import NEVER, Clock
from dusttaichi.grains.measure import energies
from dusttaichi.scene.stop import Stop


@pytest.mark.parametrize("rate", ["1e5 s^-1", ["2e5 s^-1", "-1e5 s^-1", "0 s^-1"]])
def test_edges_go_as_the_rate_says(rate):
    """L = L_0 exp(rate t) along each axis; a growing edge ends nothing (it ended the program)."""
    d = 2 * RADIUS * 0.9999
    edges = [f"{4 * d:.17g} m"] * 3
    boundary = {"kind": "periodic", "size": edges, "strain_rate": rate}
    scene = make_scene(boundary=boundary, damping="viscoelastic", stop={"strain": 0.001})
    lattice = d * np.array(np.meshgrid(*[np.arange(4)] * 3)).reshape(3, -1).T
    sim = Probe(scene, sample_of(lattice)).sim
    end, why = sim.domain.clock().last_step(scene.stop)
    rates = np.array(scene.boundary.strain_rate)
    assert why == "strain 0.001"
    assert end == np.ceil(np.log1p(0.001) / (max(rates) * 1e-6 * sim.dt))
    before, start = energies(sim), sim.lengths()
    sim.advance(end)
    np.testing.assert_allclose(sim.lengths(), start * np.exp(rates * 1e-6 * sim.time), rtol=1e-12)
    m = energies(sim)
    # the leapfrog's own error of the faces' work, second order in the step
    assert abs(residual(before, m)) < 5e-3 * abs(m["face_work"])


def test_a_room_that_only_grows_never_gets_narrow():
    clock = Clock(1e-4, 1.0, (5.0, 5.0, 5.0), growth=(1.0, 0.0, 0.0), least=(2.0, 2.0, 2.0))
    assert clock.step_of_length(2.0, 0) == clock.step_of_length(2.0, 1) == NEVER
    # nor does a room end a stage that is as narrow already, and stays so or grows
    assert clock.step_of_length(5.0, 0) == clock.step_of_length(5.0, 1) == NEVER
    assert clock.last_step(Stop(filling_factor=0.004))[0] == np.ceil(np.log(2.0) / 1e-4)
