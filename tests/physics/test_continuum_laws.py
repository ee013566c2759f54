"""The laws of the continuum: strengths, the path with its limits, deviator, glass; twice the same
numbers, on the host and in a kernel."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.physics import deviator, elasticity, path, strength
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers, largest_share
from dusttaichi.continuum.physics.point import MaterialPoint, restitution
from dusttaichi.continuum.scene import ContinuumMaterial
from dusttaichi.physics import laws

G09 = MaterialNumbers(
    rho_s=2000.0, rho_i=300.0, K_0=300e3, gamma=4.0, mu_over_K=0.5,
    phi_1=0.12, phi_2=0.58, phi_floor=0.125, phi_cap=0.579, p_m=1300.0,
    power=0.58 * np.log(10), T_0=10**2.8, T_rate=1.48 * np.log(10), C=1.0, a=0.5,
    q_max=0.9 * largest_share(4.0),
)  # fmt: skip
PHI = np.array([0.15, 0.20, 0.23, 0.30, 0.40])


def test_strengths_and_sound_of_guettler():
    """The digits of the calibrated material, rounded to 1 Pa."""
    assert np.round(strength.compressive(PHI, G09)).tolist() == [37, 162, 277, 721, 2345]
    assert np.round(-strength.tensile(PHI, G09)).tolist() == [1052, 1247, 1382, 1754, 2466]
    assert np.round(strength.shear(PHI, G09)).tolist() == [198, 450, 619, 1124, 2405]
    assert abs(elasticity.sound_speed(300.0, 300.0, G09) - 40.8) < 0.05
    assert abs(elasticity.sound_speed(600.0, 600.0, G09) - 115.0) < 0.5


@pytest.mark.parametrize("p_m", [1300.0, 13e3])
def test_confined_pressing_is_not_the_compressive_strength(p_m):
    """Sigma + 2 Y/3 over Sigma at 0.15, 0.23 and 0.30, to the digit given."""
    m = replace(G09, p_m=p_m)
    phi = np.array([0.15, 0.23, 0.30])
    ratio = strength.compute_confined(phi, m) / strength.compressive(phi, m)
    want = {1300.0: [4.6, 2.5, 2.0], 13e3: [2.1, 1.5, 1.3]}[p_m]
    assert np.abs(ratio - want).max() < 0.06


def test_compression_curve_its_inverse_and_its_ends():
    phi = np.linspace(0.126, 0.578, 200)
    sigma = strength.compressive(phi, G09)
    # G09 eq 10 of dusttaichi.physics.laws, where the same curve is an axial stress
    assert np.allclose(sigma, laws.pressure(phi, 0.12, 0.58, 1300.0, 0.58), rtol=1e-13)
    slope = (strength.compressive(phi + 1e-6, G09) - strength.compressive(phi - 1e-6, G09)) / 2e-6
    assert np.allclose(strength.compressive_slope(phi, G09)[1:-1], slope[1:-1], rtol=1e-6)
    assert strength.compressive(0.05, G09) == strength.compressive(0.125, G09) > 0
    assert strength.compressive(0.7, G09) == strength.compressive(0.579, G09) < np.inf


@pytest.mark.parametrize(("law", "C", "a"), [("compressive", 1, 1), ("tensile", 1, 0)])
def test_shear_strength_by_name(law, C, a):
    m = replace(G09, C=C, a=a)
    assert np.allclose(strength.shear(PHI, m), np.abs(getattr(strength, law)(PHI, m)), rtol=1e-14)


def test_path_ends_on_its_limits():
    """Past yield the new path meets Sigma or T; pressure is then 0 at the reference density."""
    density = np.linspace(280.0, 1000.0, 300)
    for m in (G09, replace(G09, K_0=4.5e3, p_m=260.0)):
        for factor, limit in ((1.5, strength.tensile), (0.6, strength.compressive)):
            p, reference = path.pressure(density, factor * density, m)
            want = limit(density / m.rho_s, m)
            K = elasticity.bulk_modulus(density, m)
            inside = np.abs(want / K) < 0.04
            assert np.array_equal(p, want)
            met = elasticity.elastic_pressure(density, reference, m)
            # density/reference - 1 is as small as p/K: what rounds is eps K
            assert np.all(np.abs(met - want)[inside] < (1e-15 * K + 1e-11 * np.abs(want))[inside])
            assert np.all(elasticity.elastic_pressure(reference, reference, m) == 0)
    p, reference = path.pressure(300.001, 300.0, G09)
    assert reference == 300.0 and p == elasticity.elastic_pressure(300.001, 300.0, G09)


def test_torn_dust_stays_a_number():
    """At a filling factor of 0.001 the modulus is 3e-4 Pa and |T| 633 Pa."""
    density = 2000.0 * np.logspace(-3, np.log10(0.99), 50)
    p, reference = path.pressure(density, 3.0 * density, G09)
    bulk = elasticity.bulk_modulus(density, G09)
    assert np.array_equal(p, -np.minimum(-strength.tensile(density / 2000.0, G09), 0.5 * bulk))
    met = elasticity.elastic_pressure(density, reference, G09)
    assert np.allclose(met, p, rtol=1e-4)  # three steps of Newton's method at |q| = 0.5
    p, reference = path.pressure(density, 0.7 * density, replace(G09, p_m=1e6))
    assert np.all(p <= np.where(density < 1158.0, G09.q_max * bulk, np.inf))
    assert np.all(reference >= 0.7 * density)


def test_largest_share_of_an_elastic_path():
    x = np.linspace(0.0, 0.9, 100_001)
    assert np.isclose((x * (1 - x) ** 3).max(), largest_share(4.0), rtol=1e-8)


def test_stored_energy_is_the_work_of_the_path():
    """rho times the integral of p drho/rho^2, by the trapezoidal rule with 1e5 steps."""
    for end in (300.03, 312.0, 290.0, 305.99, 306.01, 450.0, 200.0):
        density = np.linspace(300.0, end, 100_001)
        p = elasticity.elastic_pressure(density, 300.0, G09)
        work = end * np.trapezoid(p / density**2, density)
        assert np.isclose(elasticity.volume_energy(end, 300.0, G09), work, rtol=2e-7)


@pytest.mark.parametrize("sizes", [2, 3])
def test_rotation_carries_the_stress_along(sizes):
    """diag(100, -100) Pa turned by +45 degrees is a shear stress of +100 Pa; J2 stays."""
    S = np.zeros((sizes, sizes))
    S[0, 0], S[1, 1] = 100.0, -100.0
    J2 = deviator.second_invariant(S)
    L = np.zeros((sizes, sizes))
    L[0, 1], L[1, 0] = -1.0, 1.0
    steps = 100
    for _ in range(steps):
        S = deviator.rotate(S, L, np.pi / 4 / steps)
    assert abs(S[0, 1] - 100.0) < 0.01 and abs(S[0, 0]) < 0.02
    assert abs(deviator.second_invariant(S) / J2 - 1) < 1e-4


def test_plane_strain_is_the_solid_cut():
    L2 = np.array([[-300.0, 40.0], [10.0, 20.0]])
    L3 = np.zeros((3, 3))
    L3[:2, :2] = L2
    strains = (0.5 * (L + L.T) for L in (L2, L3))
    two, three = (1e3 * (D - D.trace() / 3.0 * np.eye(len(D))) for D in strains)
    assert np.allclose(two, three[:2, :2], rtol=1e-14)
    J2 = deviator.second_invariant(three)
    assert np.isclose(deviator.second_invariant(two), J2, rtol=1e-14)
    outside = 2.0 * np.sqrt(3 * J2)
    assert deviator.radial(J2, outside) == 1.0
    inside = 0.5 * np.sqrt(3 * J2)
    assert np.isclose(deviator.radial(J2, inside), 0.5)


def test_kernels_compute_what_the_host_computes():
    """One formula, two compilers: only pow and exp of the two libraries may differ in a bit."""
    ti.init(arch=ti.cpu, default_fp=ti.f64, fast_math=False, log_level=ti.ERROR)
    from dusttaichi.continuum.physics.kernels import LAWS, MATERIAL

    @ti.kernel
    def evaluate(rho: ti.types.ndarray(ti.f64, 1), out: ti.types.ndarray(ti.f64, 2), m: MATERIAL):
        for k in rho:
            phi = rho[k] / m.rho_s
            p, reference = LAWS.pressure(rho[k], 0.999 * rho[k], m)
            L = ti.Matrix([[0.1, -0.4 * phi], [0.7, phi]])
            S = LAWS.rotate(100.0 * (L + L.transpose()), L, 0.1)
            J2 = LAWS.second_invariant(S)
            row = ti.Vector([
                LAWS.compressive(phi, m), LAWS.tensile(phi, m), LAWS.shear(phi, m), p, reference,
                LAWS.sound_speed(rho[k], reference, m), LAWS.volume_energy(rho[k], reference, m),
                J2, LAWS.radial(J2, 70.0),
            ])  # fmt: skip
            for n in ti.static(range(9)):
                out[k, n] = row[n]

    rho = np.linspace(200.0, 1100.0, 37)
    out = np.empty((37, 9))
    evaluate(rho, out, MATERIAL(*G09.values()))
    phi = rho / G09.rho_s
    p, reference = path.pressure(rho, 0.999 * rho, G09)
    tensors = []
    for filling_factor in phi:
        L = np.array([[0.1, -0.4 * filling_factor], [0.7, filling_factor]])
        S = deviator.rotate(100.0 * (L + L.T), L, 0.1)
        J2 = deviator.second_invariant(S)
        tensors.append([J2, deviator.radial(J2, 70.0)])
    host = [
        strength.compressive(phi, G09), strength.tensile(phi, G09), strength.shear(phi, G09), p,
        reference, elasticity.sound_speed(rho, reference, G09),
        elasticity.volume_energy(rho, reference, G09), *np.transpose(tensors),
    ]  # fmt: skip
    assert np.allclose(out, np.transpose(host), rtol=1e-12)


DUST = MaterialNumbers.from_material(ContinuumMaterial.model_validate("dust_g09"))


def sigma(point):
    return strength.compressive(point.phi, point.m)


def relative(a, b):
    return abs(a / b - 1.0)


def from_all_sides(point, density, steps):
    """States of a point up to a density [kg/m^3] by equal strains along x, y and z."""
    states = [point]
    for _ in range(steps):
        strain = np.log(point.density / density) / (3 * steps)
        states.append(states[-1].apply_strain((strain, strain, strain)))
    return states[1:]


def with_free_sides(point, axial):
    """A point after a natural strain along z, without stress on x and y."""

    def strained(side):
        return point.apply_strain((side, side, axial))

    width = 4.0 * abs(axial)  # more than any sides swell
    return strained(brentq(lambda side: strained(side).stress[0], -width, width, xtol=1e-16))


def test_press_let_go_press_pull_and_press_again():
    """From all sides, 0.15 to 0.25 and on: p is Sigma or T to 1e-10 wherever the dust flows."""
    start = MaterialPoint.make_unstressed(DUST)
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
    assert max(relative(p.p, strength.tensile(p.phi, DUST)) for p in flowing) < 1e-10
    assert torn[-1].tension > 0 and torn[-1].compaction == let_go[-1].compaction

    second_press = from_all_sides(torn[-1], 600.0, 400)
    assert max(relative(p.p, sigma(p)) for p in second_press[20:]) < 1e-10


def test_dust_at_the_end_of_its_curve_is_elastic():
    """Sigma is without bound at phi_2 = 0.33: up to the end of the curve p is Sigma, from there on
    that of an elastic path, which is gone back on and costs nothing."""
    m = replace(DUST, phi_1=0.15, phi_2=0.33, phi_floor=0.155, phi_cap=0.329, p_m=560.0, power=0.76)
    start = from_all_sides(MaterialPoint.make_unstressed(m), m.phi_cap * m.rho_s, 2000)[-1]
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
    m = replace(DUST, K_0=4.5e3, p_m=260.0)
    start = from_all_sides(MaterialPoint.make_unstressed(m), 0.579 * m.rho_s, 4000)[-1]
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
    m = replace(DUST, p_m=p_m)
    end = from_all_sides(MaterialPoint.make_unstressed(m), 500.0, 4000)[-1]
    plastic, _ = quad(lambda r: strength.compressive(r / m.rho_s, m) / r**2, 300.0, 500.0)
    # the elastic start, until p meets Sigma, costs Sigma(0.15) times a strain of 1e-4 less
    missing = strength.compressive(0.15, m) ** 2 / m.K_0 / 300.0
    assert abs(end.compaction + end.volume_energy - plastic) < 2 * missing + 1e-6 * plastic
    assert end.shear == 0 or abs(end.shear) < 1e-20


def test_confined_pressing_is_sigma_and_two_thirds_of_y():
    for point in MaterialPoint.make_unstressed(DUST).to_density(800.0, 300)[5:]:
        axial, side = -point.stress[..., 2], -point.stress[..., 0]
        assert relative(axial, strength.compute_confined(point.phi, DUST)) < 1e-10
        assert relative(axial - side, strength.shear(point.phi, DUST)) < 1e-10
        spent = point.compaction + point.tension + point.shear
        stored = point.volume_energy + point.shear_energy
        assert abs(point.work - spent - stored) < 1e-9 * point.work


def test_free_sides():
    """A column pressed along z alone swells with Poisson's ratio, and yields at Y."""
    point = with_free_sides(MaterialPoint.make_unstressed(DUST, 500.0), -1e-5)
    K = elasticity.bulk_modulus(500.0, DUST)
    nu = 2.0 / 7.0
    assert relative(-point.stress[2], 3 * K * (1 - 2 * nu) * 1e-5) < 1e-4
    for _ in range(200):
        point = with_free_sides(point, -1e-3)
    assert abs(point.stress[0]) < 1e-6
    assert relative(-point.stress[2], strength.shear(point.phi, DUST)) < 1e-6


def test_many_materials_at_once():
    p_m = np.array([1300.0, 3900.0, 13e3])
    stresses = MaterialPoint.make_unstressed(replace(DUST, p_m=p_m)).to_density(500.0, 20)[-1]
    for n, p in enumerate(p_m):
        alone = MaterialPoint.make_unstressed(replace(DUST, p_m=p)).to_density(500.0, 20)[-1]
        assert np.allclose(stresses.stress[n], alone.stress, rtol=1e-13)


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
    m = replace(DUST, K_0=K_0)
    point = MaterialPoint.make_unstressed(m)
    for phi, digits, computed in zip([0.17, 0.19, 0.22], want, point_gives, strict=True):
        K = elasticity.bulk_modulus(phi * m.rho_s, m)
        Y = strength.shear(phi, m)
        stored = strength.compressive(phi, m) ** 2 / (2 * K) + Y**2 / (6 * m.mu_over_K * K)
        lost = phi * quad(lambda x: strength.compute_confined(x, m) / x**2, 0.15, phi)[0]
        assert relative(np.sqrt(stored / (stored + lost)), digits) < 0.03  # two digits are given
        point = point.to_density(phi * m.rho_s, 200)[-1]
        assert relative(restitution(point), computed) < 0.005
