"""The largest stable step: predicted, measured, enforced; loads for which there are too few."""

import numpy as np
import pytest
from scenes import CONFIGS, FAR, RADIUS, Probe, box, make_scene, sample_of, two_materials

from dusttaichi.errors import DustError
from dusttaichi.grains import contact_network
from dusttaichi.grains.build import build
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.grain_properties import grain_properties
from dusttaichi.grains.preview import preview
from dusttaichi.grains.time_step import fastest, short_loads, step_of_motion, time_step
from dusttaichi.physics import encounter, stability
from dusttaichi.physics import network as springs
from dusttaichi.physics.contact import constants, jkr_curve
from dusttaichi.samples import Sample
from dusttaichi.scene import load
from dusttaichi.studies.extremes_trial import measure_stable_step

D = 2 * RADIUS - 0.16627e-9


def step_of(scene, grains, motion=None):
    return time_step(ContactTable(scene), grains, motion)


def cluster(n):
    return stability.close_packed(n) * D


def growth(n, factor):
    """Kinetic energy after 150 steps over that at the start, dt = factor x the predicted limit.

    The amplitude is so small that no spring comes near its limit: the motion is linear.
    """
    limit = step_of(make_scene(dt="0.01 ns"), n).limit
    rng = np.random.default_rng(41)
    w = 1e-6 * rng.normal(size=(n, 3))
    probe = Probe(make_scene(dt="0.01 ns", boundary=FAR), sample_of(cluster(n), None, w))
    probe.sim.environment.dt = factor * limit * 1e6
    first = probe.sim.ledger.measure_energies()["kinetic_rotation"]
    probe.advance(150)
    return probe.sim.ledger.measure_energies()["kinetic_rotation"] / first


@pytest.mark.parametrize("n", [2, 3])
def test_predicted_limit_is_the_measured_one(n):
    """Beyond the limit the fastest mode grows by exp(2 sqrt(2 (factor - 1))) a step (energy): at
    1.03 by 1e30 in 150 steps, at 0.97 nothing grows."""
    assert growth(n, 0.97) < 100
    assert growth(n, 1.03) > 1e6


def test_unstable_step_is_refused():
    with pytest.raises(DustError, match=r"numerics\.time_step.*not stable.*4\.681 ns.*1\.49 ns"):
        Probe(make_scene(dt="1.5 ns"), sample_of(cluster(2)))


def test_auto_is_a_fraction_of_the_stiffest_period():
    scene = make_scene(dt="auto", numerics={"step_fraction": 0.1})
    assert step_of(scene, 2).dt == pytest.approx(0.1 * 4.6813e-9, rel=1e-4)
    assert step_of(scene, 13).dt < step_of(scene, 3).dt < step_of(scene, 2).dt


def test_walls_count():
    """One grain on a wall: sliding and turning, w^2 = (1 + 5/2) k_s/m with the wall's k_s, which is
    2^(2/3) times that of a pair (a0 ~ R^(2/3)); at least that stiff is what auto must assume."""
    scene = make_scene(dt="auto", boundary=box("bottom"))
    period = step_of(scene, 1).period
    assert period <= 12.39e-9 / np.sqrt(3.5 * 2 ** (2 / 3)) * 1.001


def energy_stays(scene, x, v, w, steps=400):
    """Largest of kinetic + potential + lost over the run, less the start, over the kinetic energy
    given."""
    probe = Probe(scene, sample_of(x, v, w))
    start = probe.energy()
    m = probe.sim.ledger.measure_energies()
    kinetic = (m["kinetic_translation"] + m["kinetic_rotation"]) * 1e-15
    probe.advance(steps)
    stored, lost, _ = probe.energy() - start
    return max(stored, lost) / kinetic


def test_auto_step_is_stable_in_a_corner():
    """A grain that touches all six walls of a strong box is held by six springs at once: stable
    motion loses nothing at amplitudes far below the limits."""
    scene = make_scene(dt="auto", boundary=box(side_walls=1.0))
    gain = energy_stays(scene, np.zeros((1, 3)), [[1e-4, 2e-4, 5e-5]], [[10.0, 20.0, 40.0]])
    assert gain < 1.0


@pytest.mark.parametrize(
    "damping",
    [{"model": "viscoelastic", "time": "100 ps"}, {"model": "viscous", "kappa": "1e-2 g/s"}],
)
def test_strong_damping_shortens_the_step_or_is_refused(damping):
    """Damping is explicit: too much of it is unstable at a step that the springs alone allow."""
    v = [[1e-4, 0, 0], [-1e-4, 0, 0]]
    try:
        gain = energy_stays(
            make_scene(dt="auto", damping=damping, boundary=FAR), cluster(2), v, None
        )
    except DustError as error:
        assert "damping" in str(error)
    else:
        assert gain < 1.5


def test_contacts_as_they_are_give_the_period_of_the_cluster():
    """Close-packed thirteen, at rest: what the dense matrices say of it (to the 1e-4 of overlaps
    that differ by rounding only)."""
    scene = make_scene(dt="auto", boundary=FAR)
    sim = build(scene, sample_of(cluster(13)))
    period, limit = contact_network.stable_step(sim.contacts, sim.contact_table, sim.motion)
    assert period == pytest.approx(step_of(make_scene(dt="auto"), 13).period, rel=1e-4)
    assert limit == pytest.approx(period / np.pi, rel=1e-4)


def test_sparse_and_dense_eigenvalues_agree(monkeypatch):
    """eigsh is asked for 1e-4."""
    scene = make_scene(dt="auto", boundary=FAR)
    sim = build(scene, sample_of(cluster(13)))
    dense = contact_network.stable_step(sim.contacts, sim.contact_table, sim.motion)[0]
    monkeypatch.setattr(springs, "DENSE", 10)
    assert contact_network.stable_step(sim.contacts, sim.contact_table, sim.motion)[
        0
    ] == pytest.approx(dense, rel=1e-4)


def test_limit_of_unlike_grains_and_a_wall_is_the_measured_one():
    """A large grain on a wall with two small ones of another size on top."""
    scene = two_materials(dt="0.01 ns", boundary=box("bottom"))
    r = np.array([1.0, 0.5, 0.3]) * RADIUS
    material, law = scene.material, scene.interaction
    apart = [
        r[0] + radius - constants.mixed_constants(material, r[0], material, radius, law).delta0
        for radius in r[1:]
    ]
    height = r[0] - constants.wall_constants(material, law, r[0]).delta0
    x = np.array([[0, 0, height], [0, 0, height + apart[0]], [apart[1], 0, height]])
    still = np.zeros((3, 3))
    sim = build(scene, Sample(x, still, still.copy(), radii=r))
    estimate = contact_network.stable_step(sim.contacts, sim.contact_table, sim.motion)[1]
    assert measure_stable_step(sim, estimate) == pytest.approx(estimate, rel=0.05)


@pytest.mark.parametrize("time", ["12.5 ps", "60 ps"])
def test_limit_of_strong_damping_is_the_measured_one(time):
    """Three grains, damped so that springs or damping rule: by bisection to 1 %."""
    damping = {"model": "viscoelastic", "time": time}
    scene = make_scene(dt="0.01 ns", boundary=FAR, damping=damping)
    sim = build(scene, sample_of(cluster(3)))
    estimate = contact_network.stable_step(sim.contacts, sim.contact_table, sim.motion)[1]
    assert measure_stable_step(sim, estimate) == pytest.approx(estimate, rel=0.02)
    damped_limit = stability.damped_limit(
        constants.grain_mass(scene.material),
        constants.pair_constants(scene.material, scene.interaction),
        None,
        3,
    )
    assert damped_limit == pytest.approx(estimate, rel=1e-3)


def test_stiffness_is_the_slope_of_the_force():
    """Against differences of 1e-5 of the JKR curve; the curve against its definition."""
    s = np.array([0.7, 1.0, 1.5, 4.0])
    assert jkr_curve.scaled_radius(3 * s**4 - 2 * s) == pytest.approx(s, rel=1e-12)

    def force(s):
        return s**6 - s**3

    h = 1e-5
    rise = (force(s + h) - force(s - h)) / (3 * (s + h) ** 4 - 3 * (s - h) ** 4 - 4 * h)
    assert jkr_curve.slope(s) == pytest.approx(rise / 0.3, rel=1e-7)


def test_overlap_of_a_fast_collision_is_that_of_hertz():
    """(15/16 m* v^2 / (E* R^1/2))^(2/5), adhesion at 100 m/s being 2 % of it."""
    scene = make_scene()
    c = constants.pair_constants(scene.material, scene.interaction)
    E_star = constants.reduced_modulus(scene.material)
    hertz = (15.0 / 16.0 * c.mass * 100.0**2 / (E_star * np.sqrt(c.R))) ** 0.4
    assert encounter.overlap(c, 100.0) == pytest.approx(hertz, rel=0.03)


def test_slow_bodies_keep_the_step_of_the_stiffest_period():
    """A cake at rest or pressed at 5 cm/s: nothing of the limits for fast bodies is felt."""
    scene = make_scene(
        dt="auto",
        modifiers={"rolling": 8, "sliding": 2.5},
        damping="viscoelastic",
        boundary=box(wall_speed=0.05),
    )
    sample = sample_of(cluster(13))
    sample.info["coordination"] = 2.0
    motion = fastest(scene, sample, RADIUS)
    assert not motion.alone
    assert motion.grains == pytest.approx(0.1)
    assert step_of(scene, 13, motion).dt == step_of(scene, 13).dt
    fast = scene.with_value("boundary.wall_speed", "30 m/s")
    assert step_of(fast, 13, fastest(fast, sample, RADIUS)).dt < 0.5 * motion_free(fast)


def motion_free(scene):
    return step_of(scene, 13).dt


def test_spins_and_unlike_grains_are_resolved():
    scene = make_scene(dt="auto")
    sample = sample_of(cluster(2), None, [[0, 0, 1e9], [0, 0, 0]])
    assert step_of(scene, 2, fastest(scene, sample, RADIUS)).dt * 1e9 <= encounter.TURN
    mixture = Sample(
        sample.positions, sample.velocities, sample.spins * 0, radii=np.array([0.1, 1.0]) * RADIUS
    )
    bodies = grain_properties(scene, mixture)
    motion = fastest(scene, mixture, mixture.radii)
    step = step_of_motion(ContactTable(scene), motion)
    assert (
        step_of_motion(ContactTable(scene, bodies), motion) < 0.2 * step
    )  # the small grain's contacts ring so


def test_a_draft_has_too_few_steps_for_a_load_of_the_same_time():
    """12 us are 39,786 steps of 0.30 ns, and 7,878 of a draft."""
    scene = load(CONFIGS / "trade/unseen/load_steps.yaml")
    draft = scene.with_value("numerics.accuracy", "draft")
    assert "Controlled loads" not in dict(preview(scene).sections)
    texts = [text for _, text in dict(preview(draft).sections)["Controlled loads"]]
    assert [text.split(" controls")[0] for text in texts] == ["stage hold_5", "stage hold_20"]
    assert "for 7,878 steps" in texts[0] and "stop.time at least 23 µs" in texts[0]


def test_only_stages_that_nothing_else_ends_have_a_remark():
    scene = load(CONFIGS / "trade/unseen/load_steps.yaml")
    settling = scene.with_value("stages.1.stop", {"creep": "200 s^-1", "time": "12 us"})
    counted = settling.with_value("stages.3.stop", {"steps": 20_000})
    assert len(short_loads(scene, 2e-9)) == 2
    assert len(short_loads(settling, 2e-9)) == 1
    assert short_loads(counted, 2e-9) == []
