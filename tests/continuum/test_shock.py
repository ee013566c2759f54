"""Dust pressed faster than its plastic waves run, against the jump conditions. Minutes: long."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from dusttaichi import method
from dusttaichi.physics.continuum import elasticity, strength
from dusttaichi.scene import load

CONFIG = Path(__file__).parents[2] / "configs/continuum/shock.yaml"
SPEED, WIDTH, HIGH = 2.0, 0.8e-3, 8e-3  # what stands there


def jump(speed, m):
    """(speed of the front [m/s], axial stress behind it [Pa]) of a piston at a speed.

    Ahead of the front an elastic wave has brought the dust to its strength: from there on mass and
    momentum are kept over the front, whose axial stress is Sigma + 2 Y/3.
    """
    rho_0 = m.rho_i
    limit = strength.confined(rho_0 / m.rho_s, m)
    ahead = limit / (rho_0 * elasticity.sound_speed(rho_0, rho_0, m))

    def front(rho):
        return (rho * speed - rho_0 * ahead) / (rho - rho_0)

    def off(rho):
        gained = rho_0 * (front(rho) - ahead) * (speed - ahead)
        return strength.confined(rho / m.rho_s, m) - limit - gained

    rho = brentq(off, 1.05 * rho_0, 0.999 * m.phi_cap * m.rho_s)
    return front(rho), strength.confined(rho / m.rho_s, m), rho


@pytest.mark.long
def test_a_front_obeys_the_jump_conditions():
    """Its speed and the pressure on the piston within 5 %."""
    scene = load(CONFIG).with_value("numerics.threads", 1)
    motion = method.of(scene).build(scene, method.make_sample(scene))
    sim = motion.sim
    speed, pressure, rho = jump(SPEED, sim.material)
    end, edges = 0.8 * HIGH / speed, np.arange(0.0, HIGH, 1e-4)
    times, places, pressures = [], [], []
    while sim.step * sim.beat < end:
        before, began = sim.impulses()[5, 2], sim.step * sim.beat
        motion.advance(4)
        times.append(sim.step * sim.beat)
        pressures.append((sim.impulses()[5, 2] - before) / (times[-1] - began) / WIDTH)
        dusty = sim.of_particles("role") == 0
        z, density = sim.of_particles("x")[dusty, 1], sim.of_particles("density")[dusty]
        layer = np.digitize(z - z.min(), edges) - 1
        mean = np.bincount(layer, density) / np.maximum(np.bincount(layer), 1)
        above = np.flatnonzero(mean > 0.5 * (sim.material.rho_i + rho))
        places.append(z.min() + edges[above[0]] if len(above) else np.nan)
    late = np.array(times) > 0.4 * end
    found = -np.polyfit(np.array(times)[late], np.array(places)[late], 1)[0]
    assert found == pytest.approx(speed, rel=0.05)
    assert np.array(pressures)[late].mean() == pytest.approx(pressure, rel=0.05)
