"""A material point: on its strengths when it flows, nothing lost when it does not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from dusttaichi.physics.continuum import elasticity, strength
from dusttaichi.physics.continuum.numbers import MaterialNumbers
from dusttaichi.physics.continuum.point import MaterialPoint, restitution
from dusttaichi.scene import ContinuumMaterial

G09 = MaterialNumbers.of(ContinuumMaterial.model_validate("dust_g09"))


def sigma(point):
    return strength.compressive(point.phi, point.m)


def relative(a, b):
    return abs(a / b - 1.0)


def from_all_sides(point, density, steps):
    """States of a point up to a density [kg/m^3] by equal strains along x, y and z."""
    states = [point]
    for _ in range(steps):
        strain = np.log(point.density / density) / (3 * steps)
        states.append(states[-1].strained((strain, strain, strain)))
    return states[1:]


def with_free_sides(point, axial):
    """A point after a natural strain along z, without stress on x and y."""

    def strained(side):
        return point.strained((side, side, axial))

    width = 4.0 * abs(axial)  # more than any sides swell
    return strained(brentq(lambda side: strained(side).stress[0], -width, width, xtol=1e-16))


def test_press_let_go_press_pull_and_press_again():
    """From all sides, 0.15 to 0.25 and on: p is Sigma or T to 1e-10 wherever the dust flows."""
    start = MaterialPoint.at(G09)
    pressed = from_all_sides(start, 500.0, 400)
    # the first step of 400, a strain of 1e-3, is past the elastic limit of 1e-4 already
    assert max(relative(point.p, sigma(point)) for point in pressed) < 1e-10
    top = pressed[-1]

    let_go = from_all_sides(top, top.reference, 50)
    assert abs(let_go[-1].p) < 1e-10 * top.p and let_go[-1].reference == top.reference
    back = from_all_sides(let_go[-1], top.density, 50)[-1]
    assert relative(back.p, top.p) < 1e-10
    assert abs(back.work - top.work) < 1e-12 * top.work
    assert abs(back.compaction - top.compaction) < 1e-12 * top.compaction

    torn = from_all_sides(let_go[-1], 400.0, 400)
    flowing = [point for point in torn if point.reference != top.reference]
    assert len(flowing) > 390
    assert max(relative(p.p, strength.tensile(p.phi, G09)) for p in flowing) < 1e-10
    assert torn[-1].tension > 0 and torn[-1].compaction == let_go[-1].compaction

    again = from_all_sides(torn[-1], 600.0, 400)
    assert max(relative(p.p, sigma(p)) for p in again[20:]) < 1e-10


def test_dust_at_the_end_of_its_curve_is_elastic():
    """Sigma is without bound at phi_2 = 0.33: up to the end of the curve p is Sigma, from there on
    that of an elastic path, which is gone back on and costs nothing."""
    m = replace(G09, phi_1=0.15, phi_2=0.33, phi_floor=0.155, phi_cap=0.329, p_m=560.0, power=0.76)
    start = from_all_sides(MaterialPoint.at(m), m.phi_cap * m.rho_s, 2000)[-1]
    assert relative(start.p, sigma(start)) < 1e-6
    on = from_all_sides(start, 0.3315 * m.rho_s, 50)
    slope = elasticity.bulk_modulus(start.reference, m) / start.reference
    for point in on:
        assert relative(point.p, start.p + slope * (point.density - start.density)) < 1e-6
    assert on[-1].p > 50e3 and on[-1].reference < m.phi_2 * m.rho_s
    back = from_all_sides(on[-1], start.density, 50)[-1]
    assert relative(back.p, start.p) < 1e-6
    assert abs(back.work - start.work) < 1e-9 * start.work


def test_soft_dust_is_elastic_beyond_the_end_of_its_curve():
    """K_0 = 4.5 kPa: the elastic path stays below Sigma from 0.56 on, and is the straight line of
    its modulus up to 0.9, far beyond phi_2; the way back costs nothing, and stores no more than
    has been done."""
    m = replace(G09, K_0=4.5e3, p_m=260.0)
    start = from_all_sides(MaterialPoint.at(m), 0.579 * m.rho_s, 4000)[-1]
    assert start.reference < 0.56 * m.rho_s and start.p < 0.1 * sigma(start)
    on = from_all_sides(start, 0.9 * m.rho_s, 1000)
    K = elasticity.bulk_modulus(start.reference, m)
    for point in on:
        assert point.reference == start.reference
        assert relative(point.p, K * (point.density / start.reference - 1.0)) < 1e-12
    assert on[-1].p > 0.5 * K
    assert relative(on[-1].work - start.work, on[-1].volume_energy - start.volume_energy) < 1e-6
    back = from_all_sides(on[-1], start.density, 1000)[-1]
    assert relative(back.p, start.p) < 1e-9
    assert abs(back.work - start.work) < 1e-9 * on[-1].work


@pytest.mark.parametrize("p_m", [1300.0, 13e3])
def test_loss_of_compaction_is_the_integral_of_the_strength(p_m):
    """Work on the way = integral of Sigma drho/rho^2; what is stored is booked apart."""
    m = replace(G09, p_m=p_m)
    end = from_all_sides(MaterialPoint.at(m), 500.0, 4000)[-1]
    plastic, _ = quad(lambda r: strength.compressive(r / m.rho_s, m) / r**2, 300.0, 500.0)
    # the elastic start, until p meets Sigma, costs Sigma(0.15) times a strain of 1e-4 less
    missing = strength.compressive(0.15, m) ** 2 / m.K_0 / 300.0
    assert abs(end.compaction + end.volume_energy - plastic) < 2 * missing + 1e-6 * plastic
    assert end.shear == 0 or abs(end.shear) < 1e-20


def test_confined_pressing_is_sigma_and_two_thirds_of_y():
    for point in MaterialPoint.at(G09).to_density(800.0, 300)[5:]:
        axial, side = -point.stress[..., 2], -point.stress[..., 0]
        assert relative(axial, strength.confined(point.phi, G09)) < 1e-10
        assert relative(axial - side, strength.shear(point.phi, G09)) < 1e-10
        spent = point.compaction + point.tension + point.shear
        stored = point.volume_energy + point.shear_energy
        assert abs(point.work - spent - stored) < 1e-9 * point.work


def test_free_sides():
    """A column pressed along z alone swells with Poisson's ratio, and yields at Y."""
    point = with_free_sides(MaterialPoint.at(G09, 500.0), -1e-5)
    K = elasticity.bulk_modulus(500.0, G09)
    nu = 2.0 / 7.0
    assert relative(-point.stress[2], 3 * K * (1 - 2 * nu) * 1e-5) < 1e-4
    for _ in range(200):
        point = with_free_sides(point, -1e-3)
    assert abs(point.stress[0]) < 1e-6
    assert relative(-point.stress[2], strength.shear(point.phi, G09)) < 1e-6


def test_many_materials_at_once():
    p_m = np.array([1300.0, 3900.0, 13e3])
    many = MaterialPoint.at(replace(G09, p_m=p_m)).to_density(500.0, 20)[-1]
    for n, one in enumerate(p_m):
        alone = MaterialPoint.at(replace(G09, p_m=one)).to_density(500.0, 20)[-1]
        assert np.allclose(many.stress[n], alone.stress, rtol=1e-13)


@pytest.mark.parametrize(
    ("K_0", "want", "point_gives"),
    [
        (300e3, [0.047, 0.033, 0.024], [0.0474, 0.0333, 0.0243]),
        (4.5e3, [0.36, 0.26, 0.20], [0.424, 0.287, 0.206]),
    ],
)
def test_restitution_of_a_point_falls_with_its_modulus(K_0, want, point_gives):
    """sqrt of Sigma^2/2K + Y^2/6mu over that and the integral of (Sigma + 2Y/3) dV, and the point,
    whose yield is late by its elastic strain: much at 4.5 kPa, where that is a hundredth."""
    m = replace(G09, K_0=K_0)
    point = MaterialPoint.at(m)
    for phi, digits, own in zip([0.17, 0.19, 0.22], want, point_gives, strict=True):
        K = elasticity.bulk_modulus(phi * m.rho_s, m)
        Y = strength.shear(phi, m)
        stored = strength.compressive(phi, m) ** 2 / (2 * K) + Y**2 / (6 * m.mu_over_K * K)
        lost = phi * quad(lambda x: strength.confined(x, m) / x**2, 0.15, phi)[0]
        assert relative(np.sqrt(stored / (stored + lost)), digits) < 0.03  # two digits are given
        point = point.to_density(phi * m.rho_s, 200)[-1]
        assert relative(restitution(point), own) < 0.005
