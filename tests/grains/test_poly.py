"""Grains of different radius and material: constants, motion, conservation, search, files."""

import numpy as np
import pytest
import reference as ref
from conftest import Probe, box, make_scene
from test_pair import compare

from dusttaichi import analysis, geometry, samples, units
from dusttaichi.errors import DustError
from dusttaichi.grains import record
from dusttaichi.grains.build import bodies_of, time_step
from dusttaichi.grains.kernels.params import contact_params
from dusttaichi.grains.kernels.store import STORED
from dusttaichi.grains.measured import measurement
from dusttaichi.physics.contact import constants
from dusttaichi.run import execute
from dusttaichi.run.ledger import ledger
from dusttaichi.samples import Sample
from dusttaichi.scene import Scene

ICE = dict(r=0.1e-6, rho=1000.0, gamma=0.1, E=7e9, nu=0.25, xi_crit=0.8e-9)  # T19 Table 1
KINDS = (ref.SILICATE, ICE)
ALL = ("rolling", "sliding", "twisting")


def scene_of(**keys):
    return make_scene(materials={"ice": "ice_t19"}, **keys)


def grain(radius, kind):
    return {**KINDS[kind], "r": radius}


def masses_of(radii, kinds):
    return 4 / 3 * np.pi * np.array(radii) ** 3 * np.array([KINDS[k]["rho"] for k in kinds])


def unlike(x, radii, kinds=None, v=0.0, w=0.0):
    x = np.array(x, float)
    kinds = np.zeros(len(x), np.int32) if kinds is None else np.array(kinds, np.int32)
    v, w = (np.array(a, float) + np.zeros_like(x) for a in (v, w))
    return Sample(x, v, w, radii=np.array(radii, float), materials=kinds)


class Grains(Probe):
    """A Probe of grains that are not alike."""

    def __init__(self, scene, sample):
        super().__init__(scene, sample)
        self.radii, self.kinds = sample.radii, sample.materials
        self.masses = masses_of(self.radii, self.kinds)
        self.inertias = 0.4 * self.masses * self.radii**2

    @property
    def v(self):
        return self._grains("v") + 0.5 * self.dt * self.loads()[0] / self.masses[:, None]

    @property
    def w(self):
        spins = self._grains("w") * units.SPIN
        return spins + 0.5 * self.dt * self.loads()[1] / self.inertias[:, None]

    def momenta(self):
        """Momentum, angular momentum about the origin, and the scale of each."""
        x, m = self.x, self.masses[:, None]
        linear, turning = m * self.v, np.cross(x, m * self.v) + self.inertias[:, None] * self.w
        return linear.sum(0), turning.sum(0), np.abs(linear).sum(), np.abs(turning).sum()

    def pair(self, i, j, **keys):
        return ref.mixed(*(grain(self.radii[n], self.kinds[n]) for n in (i, j)), **keys)

    def wall(self, i, **keys):
        return ref.mixed(grain(self.radii[i], self.kinds[i]), KINDS[0], wall=True, **keys)


# Constants.

SAME = ("R", "delta0", "F_c", "k_r", "k_s", "k_t", "xi_crit", "zeta_crit", "phi_crit")


@pytest.mark.parametrize("mixing", ref.GAMMA)
@pytest.mark.parametrize("damping", ["none", "viscous", "scaled", "viscoelastic"])
def test_constants_of_a_mixed_contact(mixing, damping):
    """All from sums and roots of a few numbers: 1e-13 is rounding."""
    scene = scene_of(damping=damping, modifiers={"rolling": 8.0, "sliding": 2.5})
    interaction = scene.interaction.model_copy(update={"mixing": mixing})
    silicate, ice = scene.all_materials
    keys = dict(damping=damping, m_r=8.0, m_s=2.5, mixing=mixing)
    own = constants.mixed_constants(silicate, 0.6e-6, ice, 0.2e-6, interaction)
    expected = ref.mixed(grain(0.6e-6, 0), grain(0.2e-6, 1), **keys)
    other = constants.wall_constants(ice, interaction, 0.2e-6, silicate)
    on_wall = ref.mixed(grain(0.2e-6, 1), grain(0.6e-6, 0), wall=True, **keys)
    for ours, theirs in ((own, expected), (other, on_wall)):
        for name in SAME:
            assert getattr(ours, name) == pytest.approx(getattr(theirs, name), rel=1e-13), name
        assert ours.kappa == pytest.approx(theirs.kappa(1.0), rel=1e-13)
    swapped = constants.mixed_constants(ice, 0.2e-6, silicate, 0.6e-6, interaction)
    assert swapped.F_c == pytest.approx(own.F_c, rel=1e-15)


def test_mixing_rules_by_hand():
    """20 and 100 mJ/m^2; equal materials give back gamma to the bit, by every rule."""
    by_hand = {"geometric": 44.72136, "arithmetic": 60.0, "work_of_adhesion": 120 - 100 / 3}
    for rule, value in by_hand.items():
        assert constants.MIXING[rule](20.0, 100.0) == pytest.approx(value, rel=1e-7)
        scene = scene_of()
        interaction = scene.interaction.model_copy(update={"mixing": rule})
        for material in scene.all_materials:
            face = constants.interface(material, material, interaction)
            assert face.gamma == material.surface_energy
            assert face.E_star == constants.reduced_modulus(material)
            pair = constants.pair_constants(material, interaction)
            r = material.radius
            assert pair == constants.mixed_constants(material, r, material, r, interaction)


@pytest.mark.parametrize("damping", ["scaled", "viscoelastic"])
def test_lanes_hold_the_constants(damping):
    """What a search writes for each contact is what physics.constants says, to rounding."""
    radii, kinds = [0.6e-6, 0.2e-6, 0.4e-6], [0, 1, 0]
    # all stand on the floor, two lean on the first
    x = [
        [0, 0, 0.6e-6],
        [np.sqrt(0.8**2 - 0.4**2) * 1e-6, 0, 0.2e-6],
        [0, np.sqrt(1 - 0.2**2) * 1e-6, 0.4e-6],
    ]
    scene = scene_of(damping=damping, boundary=box("bottom"), dt="1 ps")
    probe = Grains(scene, unlike(x, radii, kinds))
    table = probe.sim._lanes("constants")
    i, j = probe.sim._pair_arrays()
    stored = STORED[2:]
    seen = set()
    for row, a, b in zip(table, probe.sim.order[i], probe.sim.order[j], strict=False):
        one, other = (scene.all_materials[kinds[n]] for n in (a, b))
        p = contact_params(
            constants.mixed_constants(one, radii[a], other, radii[b], scene.interaction)
        )
        np.testing.assert_allclose(row[:2] * 1e-6, [radii[a], radii[b]], rtol=1e-15)
        np.testing.assert_allclose(row[2:], [getattr(p, name) for name in stored], rtol=1e-13)
        seen.add(frozenset((a, b)))
    assert {frozenset((0, 1)), frozenset((0, 2))} <= seen
    blocks = probe.sim.fields["counts"].to_numpy()[1]
    width = probe.sim.layout.width
    first = len(probe.sim.fields["pair_i"].to_numpy()) * width
    on_floor = probe.sim.fields["wall_grain"].to_numpy().reshape(-1)[: blocks * width]
    for row, g in zip(table[first:], on_floor, strict=False):
        if g < 3:
            n = probe.sim.order[g]
            own = constants.wall_constants(
                scene.all_materials[kinds[n]], scene.interaction, radii[n], scene.material
            )
            p = contact_params(own, walls=True)
            np.testing.assert_allclose(row[2:], [getattr(p, name) for name in stored], rtol=1e-13)


# Motion.


def scattered(rng, radii, gap, n_pairs, spacing):
    """Pairs along y, partners along x with their surfaces `gap` (pairs,) apart."""
    x = np.zeros((2 * n_pairs, 3))
    x[0::2, 1] = x[1::2, 1] = np.arange(n_pairs) * spacing
    x[0::2, 0] = radii[0::2] + gap
    x[1::2, 0] = -radii[1::2]
    return x


def oblique(slipping):
    """Six collisions of unlike grains, size ratios up to 3; lengths that no step hits exactly."""
    rng = np.random.default_rng(11)
    radii = np.array([0.6, 0.2, 0.3, 0.5, 0.4, 0.4, 0.25, 0.6, 0.6, 0.3, 0.3, 0.35]) * 1e-6
    kinds = np.array([0, 1, 1, 0, 0, 1, 0, 0, 1, 1, 1, 0])
    gap = np.array([-0.1, 0.0137, 0.0231, 0.031, 0.0413, -0.03]) * 1e-9
    scale = 40.0 if slipping else 1.0
    x = scattered(rng, radii, gap, 6, 3e-6)
    v = scale * 0.004 * rng.normal(size=(12, 3)) * [0, 1, 1]
    v[0::2, 0] = -np.array([0.01, 0.02, 0.05, 0.1, 0.15, 0.03])
    v[1::2, 0] = -v[0::2, 0]
    return x, v, scale * 2.5e4 * rng.normal(size=(12, 3)), radii, kinds


@pytest.mark.parametrize("slipping", [False, True], ids=["elastic", "slipping"])
def test_against_reference(slipping):
    """Tolerances as for equal pairs (test_pair): rounding of positions without slip, and 3e-4 with
    it, where pointers of the small grains turn three times as far."""
    x, v, w, radii, kinds = oblique(slipping)
    probe = Grains(scene_of(dt="0.02 ns", damping="viscoelastic"), unlike(x, radii, kinds, v, w))
    reference = ref.Reference(
        x,
        v,
        w,
        probe.dt,
        lambda i, j: probe.pair(i, j, damping="viscoelastic"),
        masses=probe.masses,
        radii=radii,
    )
    compare(probe, reference, 3e-4 if slipping else 1e-8, 400, 100)
    slips = probe.sim.measure()["loss"][3:5]
    assert np.all(slips > 0) if slipping else slips.sum() == 0


def test_restitution_of_unlike_pairs():
    """e = sqrt(1 - (v_s/v)^2) with the reduced mass, to 1e-3, from 1.01 to 20 v_s: unequal radii,
    unlike materials, and one size ratio of 1:100. The pairs start at the first touch.

    A contact ends at the first step past pull-off, up to v dt too late: the step is 0.2 ps.
    """
    kinds = [
        (0.6e-6, 0, 0.3e-6, 0),
        (0.5e-6, 0, 0.5e-6, 1),
        (0.4e-6, 1, 0.6e-6, 0),
        (30e-6, 0, 0.3e-6, 0),
    ]
    factors = np.array([1.01, 1.1, 2.0, 20.0])
    radii = np.array([r for r1, _, r2, _ in kinds for _ in factors for r in (r1, r2)])
    materials = np.array([k for _, a, _, b in kinds for _ in factors for k in (a, b)])
    n = len(radii) // 2
    stuff = [grain(r, kind) for r, kind in zip(radii, materials, strict=True)]
    numbers = [ref.mixed(*stuff[2 * k : 2 * k + 2]) for k in range(n)]
    delta0 = np.array([p.delta0 for p in numbers])
    m = masses_of(radii, materials)
    reduced = m[0::2] * m[1::2] / (m[0::2] + m[1::2])
    energy = np.array([p.F_c for p in numbers]) * delta0
    speed = np.tile(factors, len(kinds)) * np.sqrt(2 * 0.772241 * energy / reduced)
    x = scattered(None, radii, -1e-6 * delta0, n, 70e-6)
    v = np.zeros((2 * n, 3))
    v[0::2, 0], v[1::2, 0] = -speed * reduced / m[0::2], speed * reduced / m[1::2]
    probe = Grains(scene_of(effects=(), dt="0.2 ps"), unlike(x, radii, materials, v))
    probe.advance(100_000)
    assert not probe.contacts()
    e = (probe.v[0::2, 0] - probe.v[1::2, 0]) / speed
    expected = np.sqrt(1 - 1 / np.tile(factors, len(kinds)) ** 2)
    np.testing.assert_allclose(e, expected, atol=1e-3)


def lump(rng, n=14, ratio=3.0):
    """Touching unlike grains: each new one rests against one that is there, none overlaps much."""
    radii = 0.6e-6 / rng.uniform(1, ratio, n)
    radii[:2] = 0.6e-6, 0.6e-6 / ratio
    kinds = rng.integers(0, 2, n)
    x = np.zeros((1, 3))
    while len(x) < n:
        k = len(x)
        base = rng.integers(k)
        way = ref.unit(rng.normal(size=3))
        place = x[base] + way * (radii[base] + radii[k] - 0.05e-9)
        if np.all(np.linalg.norm(x - place, axis=1) > radii[:k] + radii[k] - 0.06e-9):
            x = np.concatenate([x, [place]])
    return x, radii, kinds


def bumped(speed, spin, seed=5):
    """Two lumps that collide obliquely, every grain with its own spin."""
    rng = np.random.default_rng(seed)
    x, radii, kinds = lump(rng)
    way = np.array([1.0, 0.0, 0.0])
    reach = (x @ way + radii).max() - (x @ way - radii).min()
    v = speed * (np.array([[0.5, 0.3, 0.1]] * 14 + [[-0.5, -0.2, 0.05]] * 14))
    # the second is the first again, shifted until surfaces all but meet
    shift = np.arange(reach, 0, -2e-9)[:, None] * way
    near = [
        np.all(np.linalg.norm(x[:, None] - (x + s), axis=2) > radii[:, None] + radii + 1e-10)
        for s in shift
    ]
    second = x + shift[np.argmin(near) - 1]
    w = spin * rng.normal(size=(28, 3))
    v = v + 0.1 * speed * rng.normal(size=(28, 3))
    return unlike(np.concatenate([x, second]), np.tile(radii, 2), np.tile(kinds, 2), v, w)


@pytest.mark.parametrize("speed, spin", [(0.01, 1e3), (1.0, 1e7)], ids=["gentle", "slipping"])
def test_momenta(speed, spin):
    """To rounding, past the limits of rolling, sliding and twisting or not."""
    probe = Grains(scene_of(dt="0.02 ns"), bumped(speed, spin))
    linear, turning, linear_scale, turning_scale = probe.momenta()
    for _ in range(5):
        probe.advance(200)
        now = probe.momenta()
        assert np.abs(now[0] - linear).max() < 1e-13 * linear_scale
        assert np.abs(now[1] - turning).max() < 1e-12 * turning_scale
    loss = probe.sim.measure()["loss"]
    if speed > 0.1:
        assert np.all(loss[3:] > 0)  # past all three limits


def test_loads_are_minus_the_gradient():
    """As for equal grains (test_effects): complex steps of the reference's energies."""
    radii, kinds = [0.6e-6, 0.2e-6, 0.3e-6], [0, 1, 1]
    # all of them stand on the floor, and on each other
    z = np.array(radii) - 0.05e-9
    gaps = np.array([-0.15e-9, -0.1e-9, -0.06e-9])
    flat = [
        np.sqrt((radii[a] + radii[b] + g) ** 2 - (z[a] - z[b]) ** 2)
        for (a, b), g in zip([(0, 1), (0, 2), (1, 2)], gaps, strict=True)
    ]
    along = (flat[0] ** 2 + flat[1] ** 2 - flat[2] ** 2) / (2 * flat[0])
    x = np.array(
        [[0, 0, z[0]], [flat[0], 0, z[1]], [along, np.sqrt(flat[1] ** 2 - along**2), z[2]]]
    )
    v = np.array([[0.02, -0.01, 0.004], [-0.01, 0.015, -0.003], [0.003, -0.012, 0.005]])
    w = np.array([[2.0, -4.0, 7.0], [-5.0, 3.0, -6.0], [4.0, 6.0, -3.0]]) * 2e4
    probe = Grains(scene_of(boundary=box("bottom"), dt="0.02 ns"), unlike(x, radii, kinds, v, w))
    probe.advance(20)
    measured = probe.sim.measure()
    assert np.all(measured["loss"][1:] == 0) and np.all(measured["loss_wall"][1:] == 0)
    floor = probe.sim.box.offset[4] * 1e-6

    def energies(x, turn):
        total = np.zeros((2, 4), complex)
        for (i, j), (n1, n2, phi) in probe.contacts().items():
            n1 = n1 + np.cross(turn[i], n1)
            if j >= 0:
                n2 = n2 + np.cross(turn[j], n2)
                phi = phi + ref.dot(turn[i] - turn[j], ref.unit(x[i] - x[j]))
                total[0] += ref.pair_energies(x[i], x[j], n1, n2, phi, probe.pair(i, j))
            else:
                up = np.array([0.0, 0.0, 1.0])
                phi = phi + ref.dot(turn[i], up)
                total[1] += ref.wall_energies(x[i], n1, n2, phi, up, floor, probe.wall(i))
        return total

    still = np.zeros((3, 3))
    assert measured["contacts"] == 3 and measured["wall_contacts"] == 3
    expected = energies(probe.x, still).real / 1e-15
    assert np.all(expected > 0) or np.all(expected[:, 1:] > 0)
    for own, other in zip(("potential", "potential_wall"), expected, strict=True):
        np.testing.assert_allclose(measured[own], other, rtol=1e-10, atol=1e-14)
    force, torque = probe.loads()
    h = 1e-30
    for n in range(3):
        for axis in range(3):
            step = np.zeros((3, 3), complex)
            step[n, axis] = 1j * h
            by_place = -energies(probe.x + step, still).sum().imag / h
            by_angle = -energies(probe.x, step).sum().imag / h
            assert by_place == pytest.approx(force[n, axis], abs=1e-9 * np.abs(force).max())
            assert by_angle == pytest.approx(torque[n, axis], abs=1e-9 * np.abs(torque).max())


def test_ledger_closes():
    """Second order in dt: a step three times as short leaves a ninth of the residual, or rounding;
    collisions with the floor and each other, everything slips, everything damped."""
    sample = bumped(1.0, 1e7)
    sample.velocities[:, 2] -= 1.0
    residuals = []
    for dt, steps in (("0.03 ns", 700), ("0.01 ns", 2100)):
        scene = scene_of(dt=dt, damping="viscoelastic", boundary=box("bottom"))
        probe = Grains(scene, sample)
        start = measurement(probe.sim)
        probe.advance(steps)
        last = measurement(probe.sim)
        m = last.parts
        residuals.append(abs(ledger(last, start)[1]))
        assert np.all(m["loss"] > 0) and m["wall_contacts"] > 0
    assert residuals[1] < residuals[0] < 2e-3
    assert residuals[1] < 3e-4


def test_equal_grains_by_the_long_way():
    """The motion of a scene of equal grains, to rounding (grown as in test_effects), with walls,
    damping, slip and a periodic axis."""
    sample = bumped(0.2, 5e5)
    x = sample.positions
    d = 2 * 0.6e-6 - 0.1e-9
    octahedron = np.concatenate([np.eye(3), -np.eye(3)]) * d / np.sqrt(2)
    x = np.concatenate([octahedron, octahedron + [2.4e-6 + 0.5e-6, 0, 0]])
    rng = np.random.default_rng(6)
    v = np.array([[0.3, 0.1, 0.0]] * 6 + [[-0.3, 0.0, 0.0]] * 6) + 0.1 * rng.normal(size=(12, 3))
    w = 1e6 * rng.normal(size=(12, 3))
    boundary = {"kind": "periodic", "axes": ["x", "y"], "walls": ["bottom", "top"]}
    scene = make_scene(damping="viscoelastic", boundary=boundary)
    alike = Probe(scene, Sample(x, v, w))
    alike.advance(300)
    expected, m = (alike.x, alike.v, alike.w), alike.sim.measure()
    probe = Grains(scene, unlike(x, np.full(12, 0.6e-6), None, v, w))
    probe.advance(300)
    for own, other in zip((probe.x, probe.v, probe.w), expected, strict=True):
        assert np.abs(own - other).max() < 1e-8 * np.abs(other).max()
    ours = probe.sim.measure()
    assert ours["contacts"] == m["contacts"] and ours["wall_contacts"] == m["wall_contacts"] > 0
    for name in ("loss", "loss_wall", "potential", "potential_wall"):
        np.testing.assert_allclose(ours[name], m[name], rtol=1e-6, atol=1e-9)
    assert ours["kinetic_rotation"] == pytest.approx(m["kinetic_rotation"], rel=1e-7)
    assert ours["largest_strain"] == pytest.approx(m["largest_strain"], rel=1e-7)


# Search.


def stirred(seed=31):
    """A dense gas of sizes 1 to 5."""
    rng = np.random.default_rng(seed)
    n = 260
    radii = np.where(rng.random(n) < 0.06, 0.6e-6, 0.12e-6) * rng.uniform(0.9, 1.0, n)
    radii = np.sort(radii)[::-1]
    x = []
    while len(x) < n:
        place = rng.uniform(-1.6e-6, 1.6e-6, 3)
        near = np.array(x).reshape(-1, 3) - place
        if np.all(np.linalg.norm(near, axis=1) > radii[: len(x)] + radii[len(x)]):
            x.append(place)
    return unlike(x, radii, rng.integers(0, 2, n), 20.0 * rng.normal(size=(n, 3)), 0.0)


def test_search_against_brute_force():
    """Every pair of a mixture that overlaps is a contact, and none that is past pull-off; and no
    bit depends on the threads."""
    sample = stirred()
    upper = np.triu_indices(len(sample), 1)
    touch = sample.radii[upper[0]] + sample.radii[upper[1]]
    kept = []
    for skin, threads in ((0.3, 1), (0.3, 2)):
        scene = scene_of(dt="0.01 ns", numerics={"skin": skin, "threads": threads})
        probe = Grains(scene, sample)
        formed = 0
        for _ in range(20):
            probe.advance(40)
            gap = touch - np.linalg.norm(probe.x[upper[0]] - probe.x[upper[1]], axis=1)
            active = set(probe.contacts())
            touching = {(i, j) for i, j, g in zip(*upper, gap, strict=True) if g > 1e-17}
            # the weakest hold of all these materials lets go at 1 nm at the latest
            apart = {(i, j) for i, j, g in zip(*upper, gap, strict=True) if g < -1e-9}
            assert touching <= active and not active & apart
            assert probe.sim.measure()["contacts"] == len(active)
            formed = max(formed, len(active))
        assert formed > 20 and probe.sim.searches > 3
        kept.append([probe._grains(name) for name in ("x", "v", "w")])
    assert all(np.array_equal(a, b) for a, b in zip(*kept, strict=True))


# Geometry.


def test_shadow_and_cylinder_of_unequal_grains():
    """Two discs by the lens of two circles; many by a grid; a disc inside another adds nothing."""
    r = np.array([1.0, 0.4])
    area = geometry.union_area([[0, 0], [1.1, 0]], r)
    both = np.pi * np.sum(r**2) - geometry.lens_area(1.0, 0.4, 1.1)
    assert area == pytest.approx(float(both), rel=1e-13)
    assert geometry.union_area([[0, 0], [0.5, 0]], r) == pytest.approx(np.pi, rel=1e-13)
    assert geometry.union_area([[0, 0], [0, 0]], np.ones(2)) == pytest.approx(np.pi, rel=1e-13)
    rng = np.random.default_rng(3)
    x, r = rng.uniform(0, 6, (60, 3)), rng.uniform(0.1, 1.0, 60)
    ticks = np.arange(-1.0, 7.0, 0.01) + 0.005
    grid = np.stack(np.meshgrid(ticks, ticks), -1).reshape(-1, 2)
    inside = np.zeros(len(grid), bool)
    for centre, radius in zip(x[:, :2], r, strict=True):
        inside |= np.sum((grid - centre) ** 2, axis=1) < radius**2
    # a boundary of some 40 passes 4000 cells of 1e-4, each wrong by half at random
    assert geometry.union_area(x[:, :2], r) == pytest.approx(inside.sum() * 1e-4, abs=0.02)
    assert geometry.union_area(x[:, :2], np.full(60, 0.7)) == pytest.approx(
        geometry.union_area(x[:, :2], 0.7), rel=1e-12
    )
    one_by_one = [
        geometry.cylinder_volume(a[None], b, (3, 3), 2.0, low=1.0, high=5.0)
        for a, b in zip(x, r, strict=True)
    ]
    assert geometry.cylinder_volume(x, r, (3, 3), 2.0, low=1.0, high=5.0) == pytest.approx(
        sum(one_by_one), rel=1e-12
    )
    slabs = record.slab_volumes(x[:, 2], r, np.array([-1.0, 2.0, 7.0]))
    assert slabs.sum() == pytest.approx(np.sum(4 / 3 * np.pi * r**3), rel=1e-13)


def test_time_step_is_that_of_the_small_grains():
    """A small grain among large ones rings faster than among its like, by less than (4/3)^(1/2)
    of its period (R doubles at most: springs grow by 2^(2/3))."""
    scene = scene_of(dt="0.1 ps")
    mixture = unlike(np.arange(39).reshape(13, 3) * 1e-4, [0.1e-6] * 9 + [10e-6] * 4)
    period = time_step(scene, 13, bodies_of(scene, mixture)).period
    like = Scene.from_dict(
        {**scene._given, "material": {"base": "silicate_s12", "radius": "0.1 um"}}
    )
    alone = time_step(like, 13).period
    assert 0.75 * alone < period < alone


# Scenes and samples.

MIXED = {"materials": {"ice": "ice_t19"}}


def sample_block(**sample):
    return make_scene(sample=sample, **MIXED)


def test_pair_of_unlike_grains():
    made = samples.make(
        sample_block(
            kind="pair", radii=["0.6 um", "0.2 um"], materials=["default", "ice"], speed="1 m/s"
        )
    )
    m = masses_of([0.6e-6, 0.2e-6], [0, 1])
    assert np.abs(m @ made.positions).max() < 1e-15 * m.sum() * 1e-6
    assert np.abs(m @ made.velocities).max() < 1e-15 * m.sum()
    assert made.velocities[0, 0] - made.velocities[1, 0] == pytest.approx(1.0, rel=1e-14)
    delta0 = ref.mixed(grain(0.6e-6, 0), grain(0.2e-6, 1)).delta0
    distance = np.linalg.norm(made.positions[0] - made.positions[1])
    assert 0.8e-6 - distance == pytest.approx(delta0, rel=1e-6)
    # the radius of a material is that of its grains
    made = samples.make(sample_block(kind="pair", materials=["ice", "ice"], gap="1 nm"))
    np.testing.assert_array_equal(made.radii, 0.1e-6)


def test_equal_grains_are_told_so():
    """Radii that are all the material's make no grains of their own."""
    for own in ({"radii": ["0.6 um", "0.6 um"]}, {"materials": ["default", 0]}):
        made = samples.make(sample_block(kind="pair", **own))
        assert made.radii is None and made.materials is None


def test_explicit_and_csv(tmp_path):
    positions = [["0 m", "0 m", "0 m"], ["0.79 um", "0 m", "0 m"]]
    made = samples.make(
        sample_block(
            kind="explicit", positions=positions, radii=["0.6 um", "0.2 um"], materials=[0, "ice"]
        )
    )
    path = tmp_path / "grains.csv"
    path.write_text("x,y,z,radius,material\n0,0,0,0.6,default\n0.79,0,0,0.2,ice\n")
    read = samples.make(sample_block(kind="explicit", file=str(path), units="um"))
    for sample in (made, read):
        np.testing.assert_allclose(sample.radii, [0.6e-6, 0.2e-6], rtol=1e-15)
        np.testing.assert_array_equal(sample.materials, [0, 1])
        assert sample.info["coordination"] == 1.0
    volume = 4 / 3 * np.pi * (0.6e-6**3 + 0.2e-6**3)
    room = (0.6 + 0.79 + 0.2) * 1.2 * 1.2 * 1e-18
    assert made.info["filling_factor"] == pytest.approx(volume / room, rel=1e-12)


@pytest.mark.parametrize(
    "sample, parts",
    [
        ({"materials": ["ice", "lead"]}, ["sample.materials", "lead", "default, ice"]),
        ({"radii": ["0.6 um"]}, ["sample.radii", "2 are needed"]),
        ({"radii": ["0.6 um", "1 nm"]}, ["sample.radii", "critical_rolling"]),
        ({"radii": ["0.6 um", "0.2 um"], "distance": "0.5 um"}, ["sample.distance", "radii"]),
    ],
)
def test_refused(sample, parts):
    with pytest.raises(DustError) as caught:
        samples.make(sample_block(kind="pair", **sample))
    assert all(part in str(caught.value) for part in parts), caught.value


def test_collision_of_unlike_bodies():
    """The centre of mass rests, and the first touch is that of two surfaces."""
    pair = {"kind": "pair", "radii": ["0.6 um", "0.3 um"], "materials": ["default", "ice"]}
    single = {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]], "radii": ["0.15 um"]}
    made = samples.make(
        sample_block(
            kind="collision", target=pair, projectile=single, speed="2 m/s", gap="1 um", seed=4
        )
    )
    np.testing.assert_allclose(made.radii, [0.6e-6, 0.3e-6, 0.15e-6])
    m = masses_of(made.radii, made.materials)
    assert np.abs(m @ made.velocities).max() < 1e-14 * m.sum()
    assert np.abs(m @ made.positions).max() < 1e-14 * m.sum() * 1e-6
    x = made.positions.copy()
    x[2, 0] -= 1e-6
    gap = np.linalg.norm(x[:2] - x[2], axis=1) - made.radii[:2] - made.radii[2]
    assert gap.min() == pytest.approx(0.0, abs=1e-14)


def test_run_and_go_on(tmp_path):
    """A run of unlike grains: what it writes of them, the same bits after an interruption, and its
    last frame as a sample."""
    scene = make_scene(
        sample={
            "kind": "explicit",
            "positions": [["0 m", "0 m", "0 m"], ["0.799 um", "0 m", "0 m"]],
            "radii": ["0.6 um", "0.2 um"],
            "materials": [0, "ice"],
            "velocities": [["0 m/s", "0 m/s", "0 m/s"], ["0 m/s", "0.3 m/s", "0 m/s"]],
        },
        boundary=box(),
        damping="viscoelastic",
        dt="0.02 ns",
        stop={"steps": 80},
        output={"snapshots": {"steps": 20}, "series": {"steps": 10}},
        **MIXED,
    )
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    execute(scene, whole)
    execute(scene.with_value("stop.steps", 40), parts)
    execute(scene, parts, resume=True)
    frames = []
    for directory in (whole, parts):
        run = analysis.open_run(directory)
        frames.append(analysis.read_frame(run))
        np.testing.assert_allclose(
            analysis.grain_masses(run), masses_of([0.6e-6, 0.2e-6], [0, 1]), rtol=1e-13
        )
        assert np.abs(run.series.energy_residual_relative.values).max() < 1e-3
        volume = 4 / 3 * np.pi * (0.6e-6**3 + 0.2e-6**3)
        room = (run.series.height.values * 1.2e-6 * 1.4e-6)[0]
        assert run.series.filling_factor.values[0] == pytest.approx(volume / room, rel=0.2)
    for name in ("position", "velocity", "spin", "radius"):
        assert np.array_equal(getattr(frames[0], name), getattr(frames[1], name))
    taken = samples.make(sample_block(kind="explicit", file=str(whole)))
    np.testing.assert_allclose(taken.radii, [0.6e-6, 0.2e-6], rtol=1e-15)
    np.testing.assert_array_equal(taken.materials, [0, 1])
    assert taken.contacts is not None and len(taken.contacts["i"]) == 1
