"""Grains under a top wall and on side walls, against closed forms and the NumPy reference."""

import numpy as np
import pytest
import reference as ref
from scenes import RADIUS, Probe, box, make_scene, sample_of
from test_pair import BOTH, DAMPINGS, compare

WALL = ref.numbers(wall=True)
MASS, INERTIA = ref.mass_and_inertia()
SPACING = 6 * RADIUS
DOWN = np.array([0.0, 0.0, -1.0])


def under_a_wall(gap, v, w=(0, 0, 0), wall_speed=0.0, **keys):
    """Six grains in a row, `gap` below the top wall; the other walls are left out.

    Returns the probe and what the reference needs to know: x, v, w, wall.
    """
    x = np.zeros((6, 3))
    x[:, 0] = np.arange(6) * SPACING
    # height of the box: bottom in equilibrium with the lowest grain, see build.make_box
    height = 2 * RADIUS - WALL.delta0 + gap
    size = (5 * SPACING + 4 * RADIUS, 4 * RADIUS, height)
    boundary = box("top", size=size, wall_speed=wall_speed)
    probe = Probe(make_scene(boundary=boundary, **keys), sample_of(x, v, w))
    plane = probe.sim.domain.box.offset[5] * 1e-6
    assert plane == pytest.approx(-(RADIUS + gap), rel=1e-12)
    wall = ref.Wall(DOWN, plane, wall_speed)
    v, w = (np.array(a, float) + np.zeros((6, 3)) for a in (v, w))
    return probe, x, v, w, wall


def reference_of(probe, x, v, w, wall, damping):
    absent_walls = [ref.Wall(-DOWN, -1.0)] * 5  # the walls that are left out, far away
    return ref.Reference(
        x,
        v,
        w,
        probe.dt,
        ref.numbers(damping=damping),
        ref.numbers(wall=True, damping=damping),
        [*absent_walls, wall],
    )


@BOTH
def test_sticking_speed_and_restitution(precision):
    """As for pairs (see there for step and tolerances): 0.124 m/s, full mass instead of half.

    A box has to be as high as a grain is wide, so the grains start delta0 away from the wall and
    meet it within one step: at most 1.2e-3 nm at 20 v_s, and 6e-5 nm = 1.5e-4 delta0 near v_s.
    """
    sticking = np.sqrt(2 * 0.77224 * WALL.F_c * WALL.delta0 / MASS)
    assert sticking == pytest.approx(0.124, abs=0.5e-3)
    factors = np.array([0.998, 1.002, 1.05, 1.5, 5.0, 20.0])
    gap = 1.001 * WALL.delta0  # the smallest the checks of the scene allow
    v = (factors * sticking)[:, None] * -DOWN
    probe, *_ = under_a_wall(gap, v, dt="0.5 ps", numerics={"precision": precision})
    probe.advance(60000)
    assert set(probe.contacts()) == {(0, -6)}
    e = -probe.v[:, 2] / v[:, 2]
    np.testing.assert_allclose(e[2:], np.sqrt(1 - 1 / factors[2:] ** 2), rtol=2e-3)
    assert 0 < e[1] < 0.1


@pytest.mark.parametrize("slipping", [False, True], ids=["elastic", "slipping"])
@pytest.mark.parametrize("damping", DAMPINGS)
def test_against_reference(damping, slipping):
    """1e-8 as for pairs; slipping on a wall moves the foot and loses nothing to renormalising but
    (xi/r)^2 = 1e-5 of the rolling pointer."""
    rng = np.random.default_rng(12)
    scale = 60.0 if slipping else 0.5
    v = scale * 0.004 * rng.normal(size=(6, 3)) * [1, 1, 0]
    v[:, 2] = [0.05, 0.07, 0.1, 0.13, 0.09, 0.06]
    w = scale * 2e4 * rng.normal(size=(6, 3))
    probe, x, v, w, wall = under_a_wall(0.4713e-9, v, w, 0.02, dt="0.1 ns", damping=damping)
    reference = reference_of(probe, x, v, w, wall, damping)
    compare(probe, reference, 1e-4 if slipping else 1e-8, 300, 60)
    assert (probe.sim.ledger.measure_energies()["loss_wall"][3:5].sum() > 0) == slipping


@pytest.mark.parametrize("lid", [0.0, 0.02], ids=["along", "along and down"])
def test_a_layer_between_walls_that_are_driven(lid):
    """A layer one grain high between a floor and a lid that moves along itself, and down as well:
    lower than two grains, and rolling past its limit on both walls. Tolerance as above."""
    x = np.zeros((6, 3))
    x[:, 0] = np.arange(6) * SPACING
    size = (5 * SPACING + 4 * RADIUS, 4 * RADIUS, 2 * RADIUS - 2 * WALL.delta0)
    boundary = box("bottom", "top", size=size, wall_speed=lid) | {"shear_speed": "0.5 m/s"}
    scene = make_scene(boundary=boundary, dt="0.1 ns", damping="viscoelastic")
    w = 1e4 * np.random.default_rng(4).normal(size=(6, 3))
    probe = Probe(scene, sample_of(x, np.zeros((6, 3)), w))
    floor, plane = probe.sim.domain.box.offset[4:] * 1e-6
    lids = ref.Wall(-DOWN, floor), ref.Wall(DOWN, plane, lid, along=np.array([0.5, 0.0, 0.0]))
    far = [ref.Wall(-DOWN, -1.0)] * 4
    numbers = (ref.numbers(wall=wall, damping="viscoelastic") for wall in (False, True))
    reference = ref.Reference(x, np.zeros((6, 3)), w, probe.dt, *numbers, [*far, *lids])
    compare(probe, reference, 1e-4, 300, 60)
    assert len(probe.contacts()) == 12
    assert probe.sim.ledger.measure_energies()["loss_wall"][3:5].sum() > 0


def test_rolling_displacement_stays_at_its_limit():
    v = np.array([0.5, 0.0, 0.0])
    w = np.cross(DOWN, v) / RADIUS
    probe, *_ = under_a_wall(0.4671e-9, v - 0.05 * DOWN, w, dt="0.05 ns", damping="viscoelastic")
    probe.advance(400)
    contacts = probe.contacts()
    assert len(contacts) == 6
    for n1, _, _ in contacts.values():
        xi = ref.length(ref.xi_of(n1, DOWN, WALL))
        # (xi/r)^2 = 1e-5 is what renormalising the pointer leaves
        assert xi == pytest.approx(WALL.xi_crit, rel=1e-5)


@pytest.mark.parametrize("damping", ["viscoelastic", "none"])
def test_rolling_grain_gains_no_energy(damping):
    """PHYSICS section 2: without the shift of the foot a grain that rolls at 0.5 m/s has nine times
    its kinetic energy after 20 ns."""
    v = np.array([0.5, 0.0, 0.0])
    w = np.cross(DOWN, v) / RADIUS
    assert np.allclose(v + np.cross(w, -DOWN * RADIUS), 0)  # the top of the grain rests
    probe, *_ = under_a_wall(0.4671e-9, v - 0.05 * DOWN, w, dt="0.05 ns", damping=damping)
    start = probe.energy()
    kinetic = 6 * (MASS * 0.5**2 / 2 + INERTIA * (0.5 / RADIUS) ** 2 / 2)
    # the speed towards the wall, and what the well gives beyond the jump of forming, 1.2 - 0.7
    well = 6 * (MASS * 0.05**2 / 2 + 0.55 * WALL.F_c * WALL.delta0)
    for _ in range(40):
        probe.advance(20)
        energy = probe.energy()
        m = probe.sim.ledger.measure_energies()
        motion_energy = (m["kinetic_translation"] + m["kinetic_rotation"]) * 1e-15
        assert motion_energy < kinetic + well
        # 1e-3 of the kinetic energy: second order in a step of 1 % of the stiffest period
        assert abs((energy - start) @ [1, 1, -1]) < 1e-3 * kinetic
    assert probe.sim.ledger.measure_energies()["wall_contacts"] == 6
    assert probe.sim.ledger.measure_energies()["loss_wall"][3] > 0
