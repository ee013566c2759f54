"""The contact laws of the examples in the docs, none of which the program knows: normal laws,
damping laws, an effect with history, channel and material property of its own."""

import runpy
from contextlib import contextmanager

import numpy as np
import pytest
from scenes import (
    EXAMPLES,
    FAR,
    RADIUS,
    Probe,
    box,
    extensions_forgotten,
    forget_registered,
    law_of_the_docs,
    make_scene,
    polydisperse,
    sample_of,
)

from dusttaichi.analysis import open_run
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.preview import _contact
from dusttaichi.grains.time_step import time_step
from dusttaichi.physics.contact import constants, effect_registry, register
from dusttaichi.running import execute
from dusttaichi.running.ledger import ledger
from dusttaichi.samples import make
from dusttaichi.scene import load

LINES = 130  # of an example
# the precision that ships; double is tighter and is as long to compile
PRECISIONS = ["mixed", pytest.param("f64", marks=pytest.mark.long)]
NORMAL = {"hertz": {}, "dmt": {}, "linear_cohesion": {"stiffness": "80 N/m", "cohesion": "10 MPa"}}
DAMPING = {"brilliantov": {}, "crack_tip": {"speed": "5 m/s"}}


@contextmanager
def example(name):
    with forget_registered():
        yield runpy.run_path(str(EXAMPLES / name))


@pytest.mark.parametrize("name", ["normal_laws", "damping_laws", "sintered_neck"])
def test_an_example_is_short(name):
    assert len((EXAMPLES / f"{name}.py").read_text().splitlines()) <= LINES


def test_unscaled_sliding_is_that_of_contacts_that_are_not_softened():
    with extensions_forgotten():
        scene = load(EXAMPLES / "unscaled_sliding.yaml")
        soft = scene.with_value("numerics.stiffness_scaling", 0.1)
        hard_pair, same = ContactTable(scene).farthest_pair, ContactTable(soft).farthest_pair
        linear = ContactTable(soft.with_value("interaction.sliding.law", "linear")).farthest_pair
        for name, factor in (("k_s", 0.1 ** (2 / 3)), ("zeta_crit", 0.1 ** (-2 / 3))):
            # to rounding
            assert same.numbers[name] == pytest.approx(hard_pair.numbers[name], rel=1e-12)
            assert linear.numbers[name] == pytest.approx(
                factor * hard_pair.numbers[name], rel=1e-12
            )


def scene_of(interaction=None, precision="f64", dt="0.05 ns", **keys):
    scene = make_scene(dt=dt, boundary=FAR, numerics={"precision": precision}, **keys)
    for path, value in (interaction or {}).items():
        scene = scene.with_value(f"interaction.{path}", value)
    return scene


def meeting(speed, gap=1e-12, spin=0.0, side=0.0):
    x = np.array([[0, 0, 0], [2 * RADIUS + gap, 0, 0]])
    v = np.array([[speed / 2, side, 0], [-speed / 2, -side, 0]])
    return sample_of(x, v, [[0, 0, spin], [spin, 0, -spin]])


def open_part(probe, start):
    """What the ledger leaves open, over the kinetic energy of the start."""
    end_measurement = probe.sim.ledger.measure()
    return ledger(end_measurement, start)[0] / start.kinetic, end_measurement


# Normal laws.


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize(
    "law", ["hertz", "dmt", pytest.param("linear_cohesion", marks=pytest.mark.long)]
)
def test_normal_law(law, precision):
    """A bounce: kernel and host have the same force and energy, momenta are kept, and nothing is
    lost but what a pull that begins at touch does in the step that finds it (2e-3 without)."""
    with example("normal_laws.py"):
        scene = scene_of({"normal": {"law": law, **NORMAL[law]}}, precision, effects=())
        pair = constants.pair_constants(scene.material, scene.interaction)
        probe = Probe(scene, meeting(0.3))
        start, tolerance = probe.sim.ledger.measure(), 1e-9 if precision == "f64" else 1e-5
        seen = 0
        for _ in range(60):
            probe.advance(20)
            contacts = probe.sim.contacts.measure_pairs()
            if len(contacts["overlap"]):
                force, energy, _ = pair.curve(contacts["overlap"][0] * 1e-6)
                scale = abs(pair.curve(np.float64(1e-10))[0]) + pair.F_c
                assert contacts["normal_force"][0] * 1e-9 == pytest.approx(
                    force, abs=tolerance * scale
                )
                stored = probe.sim.ledger.measure_energies()["potential"][0] * 1e-15
                assert stored == pytest.approx(energy, abs=tolerance * scale * 1e-9)
                seen += 1
        residual, end = open_part(probe, start)
        assert seen > 3 and abs(residual) < 2e-3
        assert end.parts["contacts"] == 0
        v = probe.v
        late = pair.F_c * 0.3 * probe.dt / (0.5 * pair.mass * 0.3**2)
        assert v[1, 0] - v[0, 0] == pytest.approx(0.3, rel=2e-3 + late)
        assert np.abs(v.sum(axis=0)).max() < 1e-12


def test_rest_of_dmt():
    """delta0 by the balance of forces: nothing is felt there (1e-9 of the pull-off force)."""
    with example("normal_laws.py"):
        scene = scene_of({"normal": {"law": "dmt"}}, material="ice_t19")
        pair = constants.pair_constants(scene.material, scene.interaction)
        assert pair.F_c == pytest.approx(4 * np.pi * pair.gamma * pair.R, rel=1e-9)
        assert abs(pair.curve(pair.delta0)[0]) < 1e-9 * pair.F_c


# Damping.


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("law", ["brilliantov", pytest.param("crack_tip", marks=pytest.mark.long)])
def test_damping_law(law, precision):
    """Dissipates, at the tip of a crack more than the elastic viscous law, and the ledger closes
    (5e-3 of the energy: the step that finds a touch)."""
    with example("damping_laws.py"):
        lost = {}
        further = {"viscoelastic": {}} if law == "crack_tip" else {}
        for name, keys in {law: DAMPING[law], **further}.items():
            scene = scene_of({"damping": {"model": name, **keys}}, precision, dt="0.02 ns")
            probe = Probe(scene, meeting(0.5))
            start = probe.sim.ledger.measure()
            probe.advance(1500)
            residual, end = open_part(probe, start)
            assert abs(residual) < 5e-3
            lost[name] = end.parts["loss"][2]
        assert lost[law] > 0.0
        if law == "crack_tip":
            assert lost[law] > 1.1 * lost["viscoelastic"]


def test_cross_term_is_the_slope_of_the_force():
    """A dF/d delta; 1e-3: of the slope, where 12 s^3 - 2 is 3 and more (see `rise`)."""
    with example("damping_laws.py"):
        scene = scene_of({"damping": {"model": "brilliantov", "time": "10 ps"}})
        pair = constants.pair_constants(scene.material, scene.interaction)
        overlap = np.array([0.5, 1.0, 3.0, 10.0]) * pair.delta0
        expected = 1e-11 * pair.slope(overlap)
        np.testing.assert_allclose(pair.kappa_at(overlap), expected, rtol=2e-3)


# The neck.

NECK = {"effects": {"neck": {"radius": 0.05}}}


def make_necked(strength, precision="f64", sample=None, **keys):
    material = {"base": "silicate_s12", "properties": {"neck_strength": strength}}
    scene = scene_of(NECK, precision, material=material, **keys)
    d = 2 * RADIUS - constants.pair_constants(scene.material, scene.interaction).delta0
    return Probe(scene, sample or sample_of([[0, 0, 0], [d, 0, 0]]))


def test_a_neck_needs_its_strength():
    with example("sintered_neck.py"):
        with pytest.raises(DustError, match=r"material\.properties\.neck_strength.*it is missing"):
            scene_of(NECK).with_value("material", "silicate_s12").to_yaml()
        with pytest.raises(DustError, match="neck_strength = 3.*unit"):
            make_necked(3)


def test_the_automatic_step_knows_stiff_necks():
    """Shorter by about the root of the stiffnesses' ratio: twelve along the normal alone."""
    with example("sintered_neck.py"):
        material = {"base": "silicate_s12", "properties": {"neck_strength": "1 GPa"}}
        bare = time_step(ContactTable(scene_of(material=material, dt="auto")), 2)
        stiff = time_step(ContactTable(scene_of(NECK, material=material, dt="auto")), 2)
        assert 2.0 < bare.period / stiff.period < 8.0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_strong_neck_holds(precision):
    """Grains that turn and move apart at speeds within its strength: momenta are kept, and the
    ledger closes, without any loss (1e-3 of the energy: leapfrog at a fiftieth of a period)."""
    with example("sintered_neck.py"):
        d = 2 * RADIUS - 0.16627e-9
        w = [[2e4, 1e4, -1e4], [-1e4, 2e4, 1e4]]
        sample = sample_of([[0, 0, 0], [d, 0, 0]], [[0, 0.002, 0], [0.001, -0.002, 0.001]], w)
        probe = make_necked("1 GPa", precision, sample)
        start = probe.sim.ledger.measure()
        contacts_before = probe.sim.contacts.measure_pairs()
        assert contacts_before["neck"].tolist() == [1.0]
        probe.advance(2000)
        residual, end = open_part(probe, start)
        assert probe.sim.contacts.measure_pairs()["neck"].tolist() == [1.0]
        names = probe.sim.layout.channels
        assert names[-1] == "neck" and end.parts["loss"][-1] == 0.0
        assert probe.sim.layout.model.potentials[-1] == "neck"
        assert end.parts["potential"][-1] > 0.0
        assert abs(residual) < 1e-3


def test_a_weak_neck_breaks_into_the_bare_contact():
    """Pulled by a bending spin past its strength: its energy goes to its channel."""
    with example("sintered_neck.py"):
        d = 2 * RADIUS - 0.16627e-9
        sample = sample_of([[0, 0, 0], [d, 0, 0]], None, [[0, 0, 3e5], [0, 0, -3e5]])
        probe = make_necked("1 MPa", "mixed", sample)
        start = probe.sim.ledger.measure()
        probe.advance(1000)
        residual, end = open_part(probe, start)
        assert probe.sim.contacts.measure_pairs()["neck"].tolist() == [-1.0]
        assert end.parts["contacts"] == 1 and end.parts["loss"][-1] > 0.0
        assert abs(residual) < 5e-3


@pytest.mark.long  # the neck itself: the tests above
def test_necks_are_in_the_result(tmp_path):
    """A run has the energy of the necks, their losses and which are whole, in snapshots as well."""
    with forget_registered(), extensions_forgotten():
        scene = load(EXAMPLES / "sintered_neck.yaml").with_value("stop", {"steps": 40})
        with open_run(execute(scene, tmp_path / "run")) as run:
            assert run.series.spring.values.tolist()[-1] == "neck"
            assert run.series.channel.values.tolist()[-1] == "neck"
            for group in ("contacts", "wall_contacts"):
                necks = run.contacts(snapshot=0, group=group).neck
                assert necks.size and (necks == 1.0).all()


@pytest.mark.long  # so do contacts of every scene: samples/test_samples_explicit
def test_a_sample_brings_its_necks_along(tmp_path):
    """As they were, turned with a body that is turned; where one is broken no new one is made."""
    with forget_registered(), extensions_forgotten():
        scene = load(EXAMPLES / "sintered_neck.yaml").with_value("stop", {"steps": 2000})
        scene = scene.with_value("material.properties.neck_strength", "1 kPa")
        folder = execute(scene, tmp_path / "run")
        sample_keys = {"kind": "explicit", "file": str(folder), "keep": ["walls", "box"]}
        second_probe = Probe(
            scene.with_value("sample", sample_keys), make(scene.with_value("sample", sample_keys))
        )
        with open_run(folder) as run:
            for group, contacts in (
                ("contacts", second_probe.sim.contacts.measure_pairs()),
                ("wall_contacts", second_probe.sim.contacts.measure_walls()),
            ):
                stored_contacts = run.contacts(group=group)
                assert set(stored_contacts.neck.values) == {-1.0, 1.0}, group
                keys = ("grain_i", "grain_j") if group == "contacts" else ("grain", "wall")
                order_before, order_after = (
                    np.lexsort([np.asarray(a[k]) for k in keys])
                    for a in (stored_contacts, contacts)
                )
                for name in ("neck", "neck_rest", "neck_twist", "neck_bending", "neck_shear"):
                    scale = 1e-6 if name in ("neck_rest", "neck_bending", "neck_shear") else 1.0
                    values = np.asarray(stored_contacts[name])[order_before]
                    # single precision, the default, of what is up to a nanometre
                    np.testing.assert_allclose(
                        scale * contacts[name][order_after], values, atol=1e-15
                    )


def unequal():
    """Scene of two materials with necks, radii of two grains, constants of their contact."""
    ice = {"base": "ice_t19", "properties": {"neck_strength": "20 MPa"}}
    silicate = {"base": "silicate_s12", "properties": {"neck_strength": "60 MPa"}}
    scene = scene_of(NECK, material=silicate, materials={"ice": ice}, dt="5 ps")
    first, second = scene.all_materials
    radii = [0.6e-6, 0.1e-6]
    pair = constants.mixed_constants(first, radii[0], second, radii[1], scene.interaction)
    return scene, radii, pair


def test_properties_of_unequal_grains_mix():
    with example("sintered_neck.py"):
        assert unequal()[-1].neck_strength == 40e6


@pytest.mark.long
def test_necks_of_unequal_grains():
    """They hold, and the ledger closes as above."""
    with example("sintered_neck.py"):
        scene, radii, pair = unequal()
        x = np.array([[0, 0, 0], [sum(radii) - pair.delta0, 0, 0]])
        probe = Probe(scene, polydisperse(x, radii, [0, 1], w=[[0, 0, 1e5], [0, 1e5, 0]]))
        start = probe.sim.ledger.measure()
        probe.advance(500)
        residual, _ = open_part(probe, start)
        assert probe.sim.contacts.measure_pairs()["neck"].tolist() == [1.0] and abs(residual) < 1e-3


@pytest.fixture(scope="module", autouse=True)
def law():
    with law_of_the_docs() as names:
        yield names


def scene(speed=None, dt="0.1 ns", precision="f64", **keys):
    """Of the built-in law without a speed."""
    numerics = {"precision": precision}
    scene = make_scene(damping="none", dt=dt, boundary=box("bottom"), numerics=numerics, **keys)
    if speed is None:
        return scene
    return scene.with_value("interaction.rolling", {"law": "speed_dependent", "speed": speed})


def spinning(scene, unequal=False):
    """A pair high above the floor and a grain on it, all of which roll fast."""
    radii = np.array([0.6e-6, 0.5e-6 if unequal else 0.6e-6, 0.6e-6])
    x = np.array([[0, 0, 5e-6], [radii[:2].sum() - 0.1e-9, 0, 5e-6], [0, 0, RADIUS - 0.1e-9]])
    w = np.array([[0, -2e6, 0], [1e5, 2e6, 0], [2e6, 0, 1e5]])
    sample = polydisperse(x, radii, None, 0.0, w) if unequal else sample_of(x, None, w)
    return Probe(scene, sample)


def roll_probe(probe, steps):
    """(ledger residual, rolling losses of pairs and walls, positions, spins)."""
    start = probe.sim.ledger.measure()
    probe.advance(steps)
    last = probe.sim.ledger.measure()
    m = last.parts
    return ledger(last, start)[1], (m["loss"][3], m["loss_wall"][3]), probe.x, probe.w


@pytest.mark.parametrize(
    "precision, rounding", [pytest.param("f64", 1e-9, marks=pytest.mark.long), ("mixed", 1e-6)]
)
def test_limit_case_is_the_built_in_law(precision, rounding):
    """Where the speed is beyond all measure the limit is xi_crit: the same to rounding, which the
    compiler may take in another order (400 steps, as in test_effects)."""
    _, lost, x, w = roll_probe(spinning(scene(precision=precision)), 400)
    _, same, x2, w2 = roll_probe(spinning(scene("2.9e8 m/s", precision=precision)), 400)
    assert min(lost) > 0
    np.testing.assert_allclose(same, lost, rtol=100 * rounding)
    assert np.abs(x2 - x).max() < rounding * RADIUS
    assert np.abs(w2 - w).max() < 10 * rounding * np.abs(w).max()


@pytest.mark.parametrize(
    "unequal", [False, pytest.param(True, marks=pytest.mark.long)], ids=["equal", "unequal"]
)
def test_ledger_closes(unequal):
    """At a speed that makes the limit half as large again; a step four times as short leaves less
    than half of the residual (first order: the limit changes within a step)."""
    residuals = []
    for dt, steps in (("0.2 ns", 250), ("0.05 ns", 1000)):
        residual, lost, _, _ = roll_probe(spinning(scene("1 m/s", dt=dt), unequal), steps)
        residuals.append(abs(residual))
        assert min(lost) > 0
    assert residuals[0] < 2e-3 and residuals[1] < max(0.5 * residuals[0], 1e-6)


def test_its_numbers_are_told_and_its_keys_are_checked(law):
    """`dust check` and the table of the docs have the number of the law."""
    made = scene("2 cm/s")
    pair = constants.pair_constants(made.material, made.interaction)
    assert pair.slowness == pytest.approx(50.0) and pair.k_r > 0
    rows = dict(_contact(pair, made))
    assert any("slowness" in title and value == "50 s/m" for title, value in rows.items())
    assert ("rolling", "speed_dependent", "slowness") in {
        row[:3] for row in effect_registry.table_of_numbers()
    }
    with pytest.raises(DustError, match=r"rolling\.speed = 2: it has no unit"):
        scene(2)
    with pytest.raises(DustError, match=r"rolling\.law = .*linear, speed_dependent is needed"):
        make_scene().with_value("interaction.rolling", {"law": "none_such"})
    made = scene("2 cm/s")
    assert type(made).from_dict(made.plain) == made
    law = law["RollingWithSpeed"]
    for effect, name, keys, text in (
        ("roling", "mine", law, "rolling, sliding"),
        ("rolling", "linear", law, "built-in"),
        ("twisting", "mine", object(), "lacks NUMBERS, numbers, HISTORY"),
    ):
        with pytest.raises(ValueError, match=text):
            register(effect, name, keys)
