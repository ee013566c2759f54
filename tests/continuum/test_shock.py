"""Dust pressed faster than its plastic waves run, against the jump conditions. Minutes: very long.

pytest -n0 -s -m very_long tests/continuum/test_shock.py prints what the docs have.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from dusttaichi import method
from dusttaichi.continuum.physics import elasticity, strength
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.scene import load

CONFIG = Path(__file__).parents[2] / "configs/continuum/shock.yaml"


def jump(speed, m):
    """(speed of the front [m/s], axial stress [Pa], density behind it [kg/m^3]) of a piston at a
    speed.

    Ahead of the front an elastic wave has brought the dust to its strength: from there on mass and
    momentum are kept over the front, whose axial stress is Sigma + 2 Y/3.
    """
    rho_0 = m.rho_i
    limit = strength.compute_confined(rho_0 / m.rho_s, m)
    ahead = limit / (rho_0 * elasticity.sound_speed(rho_0, rho_0, m))

    def front(rho):
        return (rho * speed - rho_0 * ahead) / (rho - rho_0)

    def off(rho):
        gained = rho_0 * (front(rho) - ahead) * (speed - ahead)
        return strength.compute_confined(rho / m.rho_s, m) - limit - gained

    rho = brentq(off, 1.05 * rho_0, 0.999 * m.phi_cap * m.rho_s)
    return front(rho), strength.compute_confined(rho / m.rho_s, m), rho


def front(scene, speed, rho):
    """(speed of the front [m/s], pressure on the piston [Pa], density behind it [kg/m^3]) of dust
    that is pressed from above at a speed; rho: density to expect there."""
    engine = method.find_method(scene).build(scene, method.make_sample(scene))
    high = np.ptp(engine.sample.room[2])
    width, spacing = np.ptp(engine.sample.room[0]), scene.numerics.spacing
    end, edges = 0.7 * high / speed, np.arange(0.0, high, 2.0 * spacing)
    middle = 0.5 * (engine.dust_state.material.rho_i + rho)
    times, positions, impulses = [], [], []
    while engine.step * engine.dt < end:
        engine.advance(max(1, int(end / 60 / engine.dt)))
        times.append(engine.step * engine.dt)
        impulses.append(engine.motion.impulses()[5, 2])
        z = engine.dust_state.of_particles("x")[:, 1] - engine.sample.room[2, 0]
        density = engine.dust_state.of_particles("density")
        layer = np.digitize(z, edges) - 1
        mean = np.bincount(layer, density) / np.maximum(np.bincount(layer), 1)
        k = int(np.argmax(mean > middle))
        inside = (middle - mean[k - 1]) / (mean[k] - mean[k - 1]) if k else np.nan
        positions.append(edges[k - 1] + spacing * (1.0 + 2.0 * inside) if k else np.nan)
    late = np.array(times) > 0.4 * end
    moved = -np.polyfit(np.array(times)[late], np.array(positions)[late], 1)[0]
    force = np.polyfit(np.array(times)[late], np.array(impulses)[late], 1)[0]
    piston = engine.domain.lengths(engine.step)[2]
    behind = (z > positions[-1] + 10 * spacing) & (z < piston - 4 * spacing)
    return moved, force / width, 1.0 / np.mean(1.0 / density[behind])


def compare_front(piston, viscosity, spacing):
    """What `front` finds over what the jump conditions say, three numbers."""
    scene = load(CONFIG)
    values = {
        "numerics.threads": 1,
        "numerics.spacing": spacing,
        "numerics.viscosity": viscosity,
        "boundary.wall_speed": f"{piston} m/s",
        "sample.size": ["0.3 mm", "6 mm"],
    }
    for key, value in values.items():
        scene = scene.with_value(key, value)
    expected = jump(piston, MaterialNumbers.from_material(scene.material))
    return np.array(front(scene, expected[0], expected[2])) / expected


@pytest.mark.very_long
@pytest.mark.parametrize("piston", [0.5, 1.0, 2.0, 5.0, 10.0])
def test_a_front_obeys_the_jump_conditions(piston):
    """Its speed, the pressure on the piston and the density behind it within 2 % at 50 um."""
    viscosity = "front" if piston <= 2.0 else "impact"
    ratios = compare_front(piston, viscosity, "50 um")
    print(f"{piston} m/s, {viscosity}: " + ", ".join(f"{100 * (f - 1):+.2f} %" for f in ratios))
    np.testing.assert_allclose(ratios, 1.0, atol=0.02)
