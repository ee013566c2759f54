"""Grains that collide, seen by another observer, and in other units of length, time and mass.

All laws of the contact act. Rounding of 1e-16 grows in collisions to some 1e-14 of the positions
and 1e-11 of the spins; an error in a vector, a sign or a constant with a dimension is far larger.
"""

from itertools import product

import numpy as np
import pytest
from scenes import FAR, RADIUS, two_materials

import dusttaichi as dt
from dusttaichi.samples import Sample

STEPS = 1500
EFFECTS = {"rolling": {"modifier": 8}, "sliding": {"modifier": 2.5}, "twisting": "on"}
# as far apart as at rest, where springs begin
APART = 1.99934 * RADIUS


def clusters(speed=4.0):
    """Two blocks of 3 x 3 x 2 grains without some, about to meet off-centre, turning and rough."""
    rng = np.random.default_rng(5)
    block = APART * np.array(list(product(range(2), range(3), range(3))), float)
    x, v, w = [], [], []
    for side in (-1, 1):
        members = block[rng.random(len(block)) < 0.8] + 1e-10 * rng.normal(size=3)
        members = members - members.mean(axis=0)
        spin = rng.normal(size=3) * 3e5
        offset = np.array([side * 1.55 * APART, side * 0.3 * APART, 0.0])
        x.append(members + offset)
        v.append(np.cross(spin, members) - side * np.array([0.5 * speed, 0.0, 0.0]))
        w.append(spin + 1e5 * rng.normal(size=members.shape))
    return [np.concatenate(arrays) for arrays in (x, v, w)]


def scene(scale=(1.0, 1.0, 1.0), **keys):
    """A scene with all laws, of two materials; scale: of lengths, times and masses."""
    a, b, c = scale
    pressure = c / (a * b**2)

    def material(radius, density, gamma, modulus, poisson, rolling):
        return {
            "radius": f"{radius * a:.17g} m",
            "density": f"{density * c / a**3:.17g} kg/m^3",
            "surface_energy": f"{gamma * c / b**2:.17g} J/m^2",
            "young_modulus": f"{modulus * pressure:.17g} Pa",
            "poisson_ratio": poisson,
            "critical_rolling": f"{rolling * a:.17g} m",
        }

    rough = {"yield_strength": f"{11e9 * pressure:.17g} Pa", "volume": f"{1e-11 * a:.17g} m"}
    damping = {"model": "viscoelastic", "time": f"{12.5e-12 * b:.17g} s"}
    built = two_materials(dt=0.1e-9 * b, **keys)
    return built.with_values({
        "material": material(RADIUS, 2650.0, 0.02, 54e9, 0.17, 2e-9),
        "materials": {"ice": material(0.5 * RADIUS, 1000.0, 0.1, 7e9, 0.25, 0.8e-9)},
        "interaction": {**EFFECTS, "damping": damping, "asperities": rough},
    })  # fmt: skip


def run(scene, x, v, w, **properties):
    """Positions, velocities and spins after the steps; properties: radii and materials."""
    with dt.simulate(scene, Sample(x, v, w, **properties), log=list) as simulation:
        m = simulation.advance(STEPS).measure()
        assert m.loss.sum() > 0.0 and m.contact_count > 8
        return simulation.positions, simulation.velocities, simulation.spins


def assert_equal(values, expected):
    for a, b, tolerance in zip(values, expected, (1e-11, 1e-9, 1e-8), strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance * np.abs(b).max())


def rotation(axis, angle):
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * turn + (1.0 - np.cos(angle)) * turn @ turn


def unlike(count):
    """Radii and materials of grains that are not alike."""
    materials = np.arange(count) % 2
    return {"radii": RADIUS * (1.0 - 1e-4 * (np.arange(count) % 3)), "materials": materials}


@pytest.mark.parametrize("unequal", [pytest.param(False, marks=pytest.mark.long), True])
def test_another_observer_sees_the_same(unequal):
    """Turned, mirrored, displaced, in motion, with other numbers for the grains."""
    x, v, w = clusters()
    properties = unlike(len(x)) if unequal else {}
    far = scene(boundary=FAR)
    expected = run(far, x, v, w, **properties)
    Q = rotation([1.0, 2.0, 3.0], 1.1) @ np.diag([-1.0, 1.0, 1.0])
    shift, boost = np.array([3e-6, -5e-6, 7e-6]), np.array([1.0, -2.0, 0.5])
    order = np.random.default_rng(2).permutation(len(x))
    # spins are axial vectors
    seen = [a[order] for a in (x @ Q.T + shift, v @ Q.T + boost, -w @ Q.T)]
    observed = run(far, *seen, **{name: values[order] for name, values in properties.items()})
    x, v, w = (a[np.argsort(order)] for a in observed)
    way = boost * STEPS * 1e-10
    assert_equal([(x - shift - way) @ Q, (v - boost) @ Q, -w @ Q], expected)


@pytest.mark.long  # another observer, above, needs the same kernels
@pytest.mark.parametrize("unequal", [False, True])
def test_units_do_not_matter(unequal):
    """Lengths doubled, times tripled, masses five times as large; between walls, one of which
    moves."""
    x, v, w = clusters(speed=2.0)
    properties = unlike(len(x)) if unequal else {}

    def pressed(a, b, c):
        box = {"kind": "box", "wall_speed": f"{0.5 * a / b:.17g} m/s", "side_walls": 0.5}
        lengths = (
            {"radii": properties["radii"] * a, "materials": properties["materials"]}
            if properties
            else {}
        )
        return run(scene((a, b, c), boundary=box), x * a, v * a / b, w / b, **lengths)

    expected = pressed(1.0, 1.0, 1.0)
    x1, v1, w1 = pressed(2.0, 3.0, 5.0)
    assert_equal([x1 / 2.0, v1 * 1.5, w1 * 3.0], expected)
