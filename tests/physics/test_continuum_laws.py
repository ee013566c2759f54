"""The laws of the continuum: strengths, the path with its limits, deviator, glass; twice the same
numbers, on the host and in a kernel."""

from dataclasses import replace

import numpy as np
import pytest

from dusttaichi.compute.engine import ti
from dusttaichi.physics import laws
from dusttaichi.physics.continuum import deviator, elasticity, path, strength
from dusttaichi.physics.continuum.numbers import MaterialNumbers, largest_share

G09 = MaterialNumbers(
    rho_s=2000.0, rho_i=300.0, K_0=300e3, gamma=4.0, mu_over_K=0.5,
    phi_1=0.12, phi_2=0.58, phi_floor=0.125, phi_cap=0.579, p_m=1300.0,
    power=0.58 * np.log(10), T_0=10**2.8, T_rate=1.48 * np.log(10), C=1.0, a=0.5,
    q_max=0.9 * largest_share(4.0),
)  # fmt: skip
PHI = np.array([0.15, 0.20, 0.23, 0.30, 0.40])


def test_strengths_of_guettler():
    """The digits of the calibrated material, rounded to 1 Pa."""
    assert np.round(strength.compressive(PHI, G09)).tolist() == [37, 162, 277, 721, 2345]
    assert np.round(-strength.tensile(PHI, G09)).tolist() == [1052, 1247, 1382, 1754, 2466]
    assert np.round(strength.shear(PHI, G09)).tolist() == [198, 450, 619, 1124, 2405]


@pytest.mark.parametrize("p_m", [1300.0, 13e3])
def test_confined_pressing_is_not_the_compressive_strength(p_m):
    """Sigma + 2 Y/3 over Sigma at 0.15, 0.23 and 0.30, to the digit given."""
    m = replace(G09, p_m=p_m)
    phi = np.array([0.15, 0.23, 0.30])
    ratio = strength.confined(phi, m) / strength.compressive(phi, m)
    want = {1300.0: [4.6, 2.5, 2.0], 13e3: [2.1, 1.5, 1.3]}[p_m]
    assert np.abs(ratio - want).max() < 0.06


def test_compression_curve_and_its_inverse():
    phi = np.linspace(0.126, 0.578, 200)
    sigma = strength.compressive(phi, G09)
    # G09 eq 10 of dusttaichi.physics.laws, where the same curve is an axial stress
    assert np.allclose(sigma, laws.pressure(phi, 0.12, 0.58, 1300.0, 0.58), rtol=1e-13)
    assert np.abs(strength.filling_factor(sigma, G09) - phi).max() < 1e-12
    slope = (strength.compressive(phi + 1e-6, G09) - strength.compressive(phi - 1e-6, G09)) / 2e-6
    assert np.allclose(strength.compressive_slope(phi, G09)[1:-1], slope[1:-1], rtol=1e-6)


def test_strength_stays_beyond_its_ends():
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


def test_sound():
    assert abs(elasticity.sound_speed(300.0, 300.0, G09) - 40.8) < 0.05
    assert abs(elasticity.sound_speed(600.0, 600.0, G09) - 115.0) < 0.5


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
        S = deviator.rotated(S, L, np.pi / 4 / steps)
    assert abs(S[0, 1] - 100.0) < 0.01 and abs(S[0, 0]) < 0.02
    assert abs(deviator.second_invariant(S) / J2 - 1) < 1e-4


def test_plane_strain_is_the_solid_cut():
    L2 = np.array([[-300.0, 40.0], [10.0, 20.0]])
    L3 = np.zeros((3, 3))
    L3[:2, :2] = L2
    two, three = (deviator.stretched(L, 1e-6, 1.5e5) for L in (L2, L3))
    assert np.allclose(two, three[:2, :2], rtol=1e-14)
    J2 = deviator.second_invariant(three)
    assert np.isclose(deviator.second_invariant(two), J2, rtol=1e-14)
    outside = 2.0 * np.sqrt(3 * J2)
    assert deviator.radial(J2, outside) == deviator.benz(J2, outside) == 1.0
    inside = 0.5 * np.sqrt(3 * J2)
    assert np.allclose([deviator.radial(J2, inside), deviator.benz(J2, inside)], [0.5, 0.25])


def test_kernels_compute_what_the_host_computes():
    """One formula, two compilers: only pow and exp of the two libraries may differ in a bit."""
    ti.init(arch=ti.cpu, default_fp=ti.f64, fast_math=False, log_level=ti.ERROR)
    from dusttaichi.physics.continuum.kernels import LAWS, MATERIAL

    @ti.kernel
    def evaluate(rho: ti.types.ndarray(ti.f64, 1), out: ti.types.ndarray(ti.f64, 2), m: MATERIAL):
        for k in rho:
            phi = rho[k] / m.rho_s
            p, reference = LAWS.pressure(rho[k], 0.999 * rho[k], m)
            L = ti.Matrix([[0.1, -0.4 * phi], [0.7, phi]])
            S = LAWS.stretched(L, 1.0, 100.0)
            S = LAWS.rotated(S, L, 0.1)
            J2 = LAWS.second_invariant(S)
            row = ti.Vector([
                LAWS.compressive(phi, m), LAWS.tensile(phi, m), LAWS.shear(phi, m), p, reference,
                LAWS.sound_speed(rho[k], reference, m), LAWS.volume_energy(rho[k], reference, m),
                J2, LAWS.radial(J2, 70.0), LAWS.benz(J2, 70.0),
            ])  # fmt: skip
            for n in ti.static(range(10)):
                out[k, n] = row[n]

    rho = np.linspace(200.0, 1100.0, 37)
    out = np.empty((37, 10))
    evaluate(rho, out, MATERIAL(*G09.values()))
    phi = rho / G09.rho_s
    p, reference = path.pressure(rho, 0.999 * rho, G09)
    tensors = []
    for one in phi:
        L = np.array([[0.1, -0.4 * one], [0.7, one]])
        S = deviator.rotated(deviator.stretched(L, 1.0, 100.0), L, 0.1)
        J2 = deviator.second_invariant(S)
        tensors.append([J2, deviator.radial(J2, 70.0), deviator.benz(J2, 70.0)])
    host = [
        strength.compressive(phi, G09), strength.tensile(phi, G09), strength.shear(phi, G09), p,
        reference, elasticity.sound_speed(rho, reference, G09),
        elasticity.volume_energy(rho, reference, G09), *np.transpose(tensors),
    ]  # fmt: skip
    assert np.allclose(out, np.transpose(host), rtol=1e-12)
