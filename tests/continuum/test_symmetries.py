"""A collision seen by another observer, and in other units of length, time and mass.

Rounding of 1e-16 has grown to some 1e-14; an error in a vector, a sign or a constant with a
dimension is far larger.
"""

from dataclasses import replace

import numpy as np
import pytest

import dusttaichi as dt
from dusttaichi.scene import Scene

SPEED, STEP, STEPS = 4.0, 1e-4, 60
DIMENSIONS = pytest.mark.parametrize("dimension", [2, pytest.param(3, marks=pytest.mark.long)])


def scene(dimension, scale=(1.0, 1.0, 1.0)):
    """Two bodies of dust that meet off-centre; scale: of lengths, times and masses."""
    a, b, c = scale
    pressure, density = c / (a * b**2), c / a**3

    def vector(*values, unit, scale):
        components = values if dimension == 3 else (values[0], values[2])
        return [f"{value * scale:.17g} {unit}" for value in components]

    still = {"kind": "sphere", "diameter": f"{0.12 * a:.17g} m", "filling_factor": 0.35}
    moving = {
        **still,
        "filling_factor": 0.25,
        "position": vector(0.05, 0.02, 0.125, unit="m", scale=a),
        "velocity": vector(1.0, 0.5, -SPEED, unit="m/s", scale=a / b),
    }
    material = {
        "base": "dust_g09",
        "bulk_modulus": f"{4.5e3 * pressure:.17g} Pa",
        "compressive": {"p_m": f"{260.0 * pressure:.17g} Pa"},
        "tensile": {"a": 2.8 + np.log10(pressure), "b": 1.48},  # Y = 10^(a + b phi) Pa
        "solid_density": f"{2000.0 * density:.17g} kg/m^3",
        "density": f"{300.0 * density:.17g} kg/m^3",  # of the bulk modulus
    }
    numerics = {"spacing": f"{0.02 * a:.17g} m", "viscosity": "impact", "threads": 1}
    return Scene.from_dict({
        "name": "two",
        "method": "continuum",
        "dimension": dimension,
        "material": material,
        "sample": {"kind": "several", "bodies": [still, moving]},
        "numerics": {**numerics, "time_step": f"{STEP * b:.17g} s"},
        "stop": {"steps": STEPS},
    })  # fmt: skip


def run(scene, change=lambda sample: sample):
    """Positions, velocities and densities at the end, and the losses."""
    with dt.simulate(scene, change(dt.make_sample(scene)), log=list) as simulation:
        loss = simulation.run().measure().loss
        end = simulation.snapshot()["snapshots"]
        assert loss.sum() > 0.0 and end["density"].max() > 1.02 * end["reference_density"].min()
        return end["position"], end["velocity"], end["density"], loss


def assert_equal(values, expected):
    for a, b in zip(values, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-10 * np.abs(b).max())


@DIMENSIONS
def test_another_observer_sees_the_same(dimension):
    """Turned, mirrored, displaced and in motion."""
    Q = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # x and z exchanged
    if dimension == 3:
        Q = -np.roll(np.eye(3), 1, axis=0)  # the axes in turn, all of them reversed
    within = np.array([1.0, float(dimension == 3), 1.0])
    shift, boost = np.array([0.3, -0.1, -0.7]) * within, np.array([1.0, 0.3, -2.0]) * within

    def seen(sample):
        return replace(
            sample,
            position=sample.position @ Q.T + shift,
            velocity=sample.velocity @ Q.T + boost,
            bodies=tuple(
                replace(body, centre=Q @ body.centre + shift, velocity=Q @ body.velocity + boost)
                for body in sample.bodies
            ),
        )

    expected = run(scene(dimension))
    x, v, density, loss = run(scene(dimension), seen)
    way = boost * STEPS * STEP
    assert_equal([(x - shift - way) @ Q, (v - boost) @ Q, density, loss], expected)


@DIMENSIONS
def test_units_do_not_matter(dimension):
    """Lengths doubled, times tripled, masses five times as large."""
    a, b, c = 2.0, 3.0, 5.0
    expected = run(scene(dimension))
    x, v, density, loss = run(scene(dimension, (a, b, c)))
    energy = c * a**2 / b**2 / (a if dimension == 2 else 1.0)  # in two dimensions per depth
    assert_equal([x / a, v * b / a, density * a**3 / c, loss / energy], expected)
