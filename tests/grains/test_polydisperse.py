"""Grains of different radius and material: constants, motion, conservation."""

import numpy as np
import pytest
import reference as ref
from scenes import (
    FAR,
    Probe,
    box,
    grain,
    make_scene,
    masses_of,
    polydisperse,
    two_materials,
)
from test_pair import compare

from dusttaichi.grains.kernels.contact_numbers import internal_numbers
from dusttaichi.grains.kernels.polydisperse import list_stored_numbers
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.effect_registry import chosen_model
from dusttaichi.physics.contact.material_interface import MIXING
from dusttaichi.running.ledger import ledger
from dusttaichi.samples import Sample

# Constants.

SAME = ("R", "delta0", "F_c", "k_r", "k_s", "k_t", "xi_crit", "zeta_crit", "phi_crit")


@pytest.mark.parametrize("mixing", ref.GAMMA)
@pytest.mark.parametrize("damping", ["none", "viscous", "scaled", "viscoelastic"])
def test_constants_of_a_mixed_contact(mixing, damping):
    """All from sums and roots of a few numbers: 1e-13 is rounding."""
    scene = two_materials(damping=damping, modifiers={"rolling": 8.0, "sliding": 2.5})
    interaction = scene.interaction.model_copy(update={"mixing": mixing})
    silicate, ice = scene.all_materials
    keys = dict(damping=damping, m_r=8.0, m_s=2.5, mixing=mixing)
    pair = constants.mixed_constants(silicate, 0.6e-6, ice, 0.2e-6, interaction)
    expected = ref.mix_constants(grain(0.6e-6, 0), grain(0.2e-6, 1), **keys)
    wall_pair = constants.wall_constants(ice, interaction, 0.2e-6, silicate)
    on_wall = ref.mix_constants(grain(0.2e-6, 1), grain(0.6e-6, 0), wall=True, **keys)
    for ours, theirs in ((pair, expected), (wall_pair, on_wall)):
        for name in SAME:
            assert getattr(ours, name) == pytest.approx(getattr(theirs, name), rel=1e-13), name
        assert ours.kappa == pytest.approx(theirs.kappa(1.0), rel=1e-13)
    swapped = constants.mixed_constants(ice, 0.2e-6, silicate, 0.6e-6, interaction)
    assert swapped.F_c == pytest.approx(pair.F_c, rel=1e-15)


def test_mixing_rules_by_hand():
    """20 and 100 mJ/m^2; equal materials give back gamma to the bit, by every rule."""
    by_hand = {"geometric": 44.72136, "arithmetic": 60.0, "work_of_adhesion": 120 - 100 / 3}
    for rule, value in by_hand.items():
        assert MIXING[rule](20.0, 100.0) == pytest.approx(value, rel=1e-7)
        scene = two_materials()
        interaction = scene.interaction.model_copy(update={"mixing": rule})
        for material in scene.all_materials:
            face = constants.interface(material, material, interaction)
            assert face.gamma == material.surface_energy
            assert face.E_star == constants.reduced_modulus(material)
            pair = constants.pair_constants(material, interaction)
            r = material.radius
            assert pair == constants.mixed_constants(material, r, material, r, interaction)


@pytest.mark.parametrize(
    "damping", [pytest.param("scaled", marks=pytest.mark.long), "viscoelastic"]
)
def test_lanes_hold_the_constants(damping):
    """What a search writes for each contact is what physics.constants says, to rounding."""
    radii, materials = [0.6e-6, 0.2e-6, 0.4e-6], [0, 1, 0]
    # all stand on the floor, two lean on the first
    x = [
        [0, 0, 0.6e-6],
        [np.sqrt(0.8**2 - 0.4**2) * 1e-6, 0, 0.2e-6],
        [0, np.sqrt(1 - 0.2**2) * 1e-6, 0.4e-6],
    ]
    scene = two_materials(damping=damping, boundary=box("bottom"), dt="1 ps")
    probe = Probe(scene, polydisperse(x, radii, materials))
    model, first = chosen_model(scene.interaction), probe.sim.layout.constants
    names, table = list_stored_numbers(model), probe.sim.grain_state.lanes("contact")[:, first:]
    i, j = probe.sim.grain_state.pairs()
    seen = set()

    def holds(row, contact):
        expected = internal_numbers(contact, model)
        np.testing.assert_allclose(row, [getattr(expected, name) for name in names], rtol=1e-13)

    for row, a, b in zip(
        table, probe.sim.grain_state.order[i], probe.sim.grain_state.order[j], strict=False
    ):
        one, second = (scene.all_materials[materials[n]] for n in (a, b))
        pair = constants.mixed_constants(one, radii[a], second, radii[b], scene.interaction)
        holds(row, pair)
        seen.add(frozenset((a, b)))
    assert {frozenset((0, 1)), frozenset((0, 2))} <= seen
    blocks = probe.sim.fields["counts"].to_numpy()[1]
    width = probe.sim.layout.width
    first = len(probe.sim.fields["pair_i"].to_numpy()) * width
    on_floor = probe.sim.fields["wall_grain"].to_numpy().reshape(-1)[: blocks * width]
    for row, g in zip(table[first:], on_floor, strict=False):
        if g < 3:
            n = probe.sim.grain_state.order[g]
            material = scene.all_materials[materials[n]]
            holds(
                row, constants.wall_constants(material, scene.interaction, radii[n], scene.material)
            )


# Motion.


def scatter_pairs(rng, radii, gap, n_pairs, spacing):
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
    materials = np.array([0, 1, 1, 0, 0, 1, 0, 0, 1, 1, 1, 0])
    gap = np.array([-0.1, 0.0137, 0.0231, 0.031, 0.0413, -0.03]) * 1e-9
    scale = 40.0 if slipping else 1.0
    x = scatter_pairs(rng, radii, gap, 6, 3e-6)
    v = scale * 0.004 * rng.normal(size=(12, 3)) * [0, 1, 1]
    v[0::2, 0] = -np.array([0.01, 0.02, 0.05, 0.1, 0.15, 0.03])
    v[1::2, 0] = -v[0::2, 0]
    return x, v, scale * 2.5e4 * rng.normal(size=(12, 3)), radii, materials


def test_ledger_closes():
    """Second order in dt: a step three times as short leaves a ninth of the residual, or rounding;
    collisions with the floor and each other, everything slips, everything damped."""
    sample = bump_lumps(1.0, 1e7)
    sample.velocities[:, 2] -= 1.0
    residuals = []
    for dt, steps in (("0.03 ns", 700), ("0.01 ns", 2100)):
        scene = two_materials(dt=dt, damping="viscoelastic", boundary=box("bottom"))
        probe = Probe(scene, sample)
        start = probe.sim.ledger.measure()
        probe.advance(steps)
        last = probe.sim.ledger.measure()
        m = last.parts
        residuals.append(abs(ledger(last, start)[1]))
        assert np.all(m["loss"] > 0) and m["wall_contacts"] > 0
    assert residuals[1] < residuals[0] < 2e-3
    assert residuals[1] < 3e-4


@pytest.mark.parametrize("slipping", [False, True], ids=["elastic", "slipping"])
def test_against_reference(slipping):
    """Tolerances as for equal pairs (test_pair): rounding of positions without slip, and 3e-4 with
    it, where pointers of the small grains turn three times as far."""
    x, v, w, radii, materials = oblique(slipping)
    probe = Probe(
        two_materials(dt="0.02 ns", damping="viscoelastic", boundary=FAR),
        polydisperse(x, radii, materials, v, w),
    )
    reference = ref.Reference(
        x,
        v,
        w,
        probe.dt,
        lambda i, j: probe.pair(i, j, damping="viscoelastic"),
        masses=masses_of(radii, materials),
        radii=radii,
    )
    compare(probe, reference, 3e-4 if slipping else 1e-8, 400, 100)
    slips = probe.sim.ledger.measure_energies()["loss"][3:5]
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
    stuff = [grain(r, material) for r, material in zip(radii, materials, strict=True)]
    numbers = [ref.mix_constants(*stuff[2 * k : 2 * k + 2]) for k in range(n)]
    delta0 = np.array([p.delta0 for p in numbers])
    m = masses_of(radii, materials)
    reduced = m[0::2] * m[1::2] / (m[0::2] + m[1::2])
    energy = np.array([p.F_c for p in numbers]) * delta0
    speed = np.tile(factors, len(kinds)) * np.sqrt(2 * 0.772241 * energy / reduced)
    x = scatter_pairs(None, radii, -1e-6 * delta0, n, 70e-6)
    v = np.zeros((2 * n, 3))
    v[0::2, 0], v[1::2, 0] = -speed * reduced / m[0::2], speed * reduced / m[1::2]
    probe = Probe(two_materials(dt="0.2 ps", boundary=FAR), polydisperse(x, radii, materials, v))
    probe.advance(100_000)
    assert not probe.contacts()
    e = (probe.v[0::2, 0] - probe.v[1::2, 0]) / speed
    expected = np.sqrt(1 - 1 / np.tile(factors, len(kinds)) ** 2)
    np.testing.assert_allclose(e, expected, atol=1e-3)


def lump(rng, n=14, ratio=3.0):
    """Touching unlike grains: each new one rests against one that is there, none overlaps much."""
    radii = 0.6e-6 / rng.uniform(1, ratio, n)
    radii[:2] = 0.6e-6, 0.6e-6 / ratio
    materials = rng.integers(0, 2, n)
    x = np.zeros((1, 3))
    while len(x) < n:
        k = len(x)
        base = rng.integers(k)
        way = ref.unit(rng.normal(size=3))
        position = x[base] + way * (radii[base] + radii[k] - 0.05e-9)
        if np.all(np.linalg.norm(x - position, axis=1) > radii[:k] + radii[k] - 0.06e-9):
            x = np.concatenate([x, [position]])
    return x, radii, materials


def bump_lumps(speed, spin, seed=5):
    """Two lumps that collide obliquely, every grain with its own spin."""
    rng = np.random.default_rng(seed)
    x, radii, materials = lump(rng)
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
    return polydisperse(np.concatenate([x, second]), np.tile(radii, 2), np.tile(materials, 2), v, w)


@pytest.mark.parametrize("speed, spin", [(0.01, 1e3), (1.0, 1e7)], ids=["gentle", "slipping"])
def test_momenta(speed, spin):
    """To rounding, past the limits of rolling, sliding and twisting or not."""
    probe = Probe(two_materials(dt="0.02 ns", boundary=FAR), bump_lumps(speed, spin))
    probe.assert_momenta_stay(5, 200)
    loss = probe.sim.ledger.measure_energies()["loss"]
    if speed > 0.1:
        assert np.all(loss[3:] > 0)  # past all three limits


def test_loads_are_minus_the_gradient():
    """As for equal grains (test_effects): complex steps of the reference's energies."""
    radii, materials = [0.6e-6, 0.2e-6, 0.3e-6], [0, 1, 1]
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
    probe = Probe(
        two_materials(boundary=box("bottom"), dt="0.02 ns"), polydisperse(x, radii, materials, v, w)
    )
    probe.advance(20)
    measured = probe.sim.ledger.measure_energies()
    assert np.all(measured["loss"][1:] == 0) and np.all(measured["loss_wall"][1:] == 0)
    floor = probe.sim.domain.box.offset[4] * 1e-6

    def potentials(x, turn):
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
    expected = potentials(probe.x, still).real / 1e-15
    assert np.all(expected > 0) or np.all(expected[:, 1:] > 0)
    for value, expected_value in zip(("potential", "potential_wall"), expected, strict=True):
        np.testing.assert_allclose(measured[value], expected_value, rtol=1e-10, atol=1e-14)
    force, torque = probe.loads()
    h = 1e-30
    for n in range(3):
        for axis in range(3):
            step = np.zeros((3, 3), complex)
            step[n, axis] = 1j * h
            by_place = -potentials(probe.x + step, still).sum().imag / h
            by_angle = -potentials(probe.x, step).sum().imag / h
            assert by_place == pytest.approx(force[n, axis], abs=1e-9 * np.abs(force).max())
            assert by_angle == pytest.approx(torque[n, axis], abs=1e-9 * np.abs(torque).max())


def test_equal_grains_by_the_long_way():
    """The motion of a scene of equal grains, to rounding (grown as in test_effects), with walls,
    damping and slip."""
    d = 2 * 0.6e-6 - 0.1e-9
    octahedron = np.concatenate([np.eye(3), -np.eye(3)]) * d / np.sqrt(2)
    x = np.concatenate([octahedron, octahedron + [2.4e-6 + 0.5e-6, 0, 0]])
    rng = np.random.default_rng(6)
    v = np.array([[0.3, 0.1, 0.0]] * 6 + [[-0.3, 0.0, 0.0]] * 6) + 0.1 * rng.normal(size=(12, 3))
    w = 1e6 * rng.normal(size=(12, 3))
    scene = two_materials(damping="viscoelastic", boundary=box())
    alike = Probe(make_scene(damping="viscoelastic", boundary=box()), Sample(x, v, w))
    alike.advance(300)
    expected, m = (alike.x, alike.v, alike.w), alike.sim.ledger.measure_energies()
    probe = Probe(scene, polydisperse(x, np.full(12, 0.6e-6), None, v, w))
    probe.advance(300)
    for value, expected_value in zip((probe.x, probe.v, probe.w), expected, strict=True):
        assert np.abs(value - expected_value).max() < 1e-8 * np.abs(expected_value).max()
    ours = probe.sim.ledger.measure_energies()
    assert ours["contacts"] == m["contacts"] and ours["wall_contacts"] == m["wall_contacts"] > 0
    for name in ("loss", "loss_wall", "potential", "potential_wall"):
        np.testing.assert_allclose(ours[name], m[name], rtol=1e-6, atol=1e-9)
    assert ours["kinetic_rotation"] == pytest.approx(m["kinetic_rotation"], rel=1e-7)
    assert ours["largest_strain"] == pytest.approx(m["largest_strain"], rel=1e-7)
