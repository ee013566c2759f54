"""Gravity towards a centre; that of a constant direction is tested with the sphere."""

import numpy as np
from scenes import make_scene, sample_of
from test_sphere import opened

from dusttaichi.grains.build import build
from dusttaichi.grains.measure import grain_state, measurement
from dusttaichi.method import Start


def test_central_gravity():
    """A circle at the speed that Newton's law asks for; a spring of the same strength has that
    speed too. The leapfrog's error of the radius is (angle a step)^2, 4e-6 here."""
    d, g = 10e-6, 1e5
    speed, period = np.sqrt(g * d), 2 * np.pi * np.sqrt(d / g)
    for exponent in (-2.0, 1.0, -1.0):
        central = {"acceleration": f"{g} m/s^2", "distance": "10 um", "exponent": exponent}
        scene = make_scene(gravity={"central": central}, dt=period / 4000)
        sim = build(scene, sample_of([[d, 0, 0]], [[0, speed, 0]]))
        start = Start.of(measurement(sim))
        sim.advance(4000)
        x, v, _ = grain_state(sim)
        np.testing.assert_allclose(x[0], [10.0, 0, 0], atol=1e-4)
        np.testing.assert_allclose(v[0], [0, speed, 0], atol=1e-5)
        assert abs(opened(sim, start)) < 1e-5
