"""Softened contacts (numerics.stiffness_scaling): what stays, what changes, samples."""

import numpy as np
import pytest
import xarray as xr
from scenes import CONFIGS, FAR, Probe, box, make_scene, polydisperse, sample_of, two_materials

from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.grain_properties import scale_materials
from dusttaichi.grains.kernels.contact_numbers import internal_numbers
from dusttaichi.grains.kernels.polydisperse import list_stored_numbers
from dusttaichi.grains.preview import preview
from dusttaichi.grains.time_step import time_step
from dusttaichi.physics.contact import constants
from dusttaichi.physics.contact.effect_registry import chosen_model
from dusttaichi.running import execute
from dusttaichi.scene import from_yaml, load

S = 0.03


def pair_and_wall(scene):
    table = ContactTable(scene)
    return table.farthest_pair, table.farthest_wall


def softer(scene, scale=S):
    numerics = scene.numerics.model_copy(update={"stiffness_scaling": scale})
    return scene.model_copy(update={"numerics": numerics})


@pytest.mark.parametrize("speed, warns", [("5 mm/s", False), ("20 cm/s", True)])
def test_dust_check_warns_of_impacts_that_break_contacts(speed, warns):
    """Two grains of this silicate stick below 11 cm/s; a wall throws them at twice its speed."""
    scene = load(CONFIGS / "trade/omni.yaml").with_value("boundary.wall_speed", speed)
    rows = dict(preview(softer(scene)).sections)["Softened contacts"]
    texts = [text for name, text in rows if name == "remark"]
    assert [("stick below 11 cm/s" in text) for text in texts] == [True] * warns


@pytest.mark.parametrize("damping", ["viscous", "scaled", "viscoelastic"])
@pytest.mark.parametrize("scale", [0.1, 0.003])
def test_what_a_softened_contact_keeps(damping, scale):
    """Powers of s by hand; all are products of a few roots: 1e-12 is rounding."""
    scene = make_scene(damping=damping, modifiers={"rolling": 8.0, "sliding": 2.5})
    for hard, soft in zip(pair_and_wall(scene), pair_and_wall(softer(scene, scale)), strict=True):

        def ratio(number, hard=hard, soft=soft):
            return number(soft) / number(hard)

        same = {
            "pull-off": lambda c: c.F_c,
            "rolling stiffness": lambda c: c.k_r,
            "rolling limit": lambda c: c.xi_crit,
            "largest sliding force": lambda c: c.k_s * c.zeta_crit,
            "largest twisting moment": lambda c: c.k_t * c.phi_crit,
            "damping ratio": lambda c: c.kappa / np.sqrt(c.k_n * c.mass),
            "overlap at rest": lambda c: c.rest_overlap,
            "mass": lambda c: c.mass,
        }
        for name, number in same.items():
            assert ratio(number) == pytest.approx(1.0, rel=1e-12), name
        for name in ("k_n", "k_s"):
            power = ratio(lambda c, name=name: getattr(c, name))
            assert power == pytest.approx(scale ** (2 / 3), rel=1e-12), name
        # energies go with the overlap
        for name in ("barrier", "bound", "delta0"):
            power = ratio(lambda c, name=name: getattr(c, name))
            assert power == pytest.approx(scale ** (-2 / 3), rel=1e-9), name
        assert soft.delta0 - soft.gap == pytest.approx(hard.delta0, rel=1e-9)


def test_periods_grow_with_the_root_of_the_normal_stiffness():
    """Where rolling and twisting, whose springs stay, are left out."""
    scene = make_scene(effects=("sliding",), boundary=box(wall_speed=0.01), dt="auto")
    periods = [time_step(ContactTable(softer(scene, scale)), 100).period for scale in (1.0, S)]
    assert periods[1] / periods[0] == pytest.approx(S ** (-1 / 3), rel=1e-9)


def test_scaling_is_applied_once():
    """Of mass and stiffness alike; a scene without has the materials that it was given."""
    factors = {"mass_scaling": 4, "stiffness_scaling": S}
    scene = make_scene(boundary=box(wall_speed=0.01), numerics=factors)
    once = scale_materials(scene)
    assert scale_materials(once).material == once.material
    assert once.material.density == 4 * scene.material.density
    assert once.material.young_modulus == S * scene.material.young_modulus
    assert once.material.stiffness_scaling == pytest.approx(S, rel=1e-15)
    plain = make_scene()
    assert scale_materials(plain) is plain


def test_contacts_of_unlike_grains_have_the_same_numbers():
    """What a search writes for each contact is what physics.constants says, to rounding."""
    scene = softer(two_materials(damping="viscoelastic"))
    radii, materials = [0.6e-6, 0.2e-6], [0, 1]
    probe = Probe(scene, polydisperse([[0, 0, 0], [0.8e-6, 0, 0]], radii, materials))
    scaled_scene, model = scale_materials(scene), chosen_model(scene.interaction)
    names, first = list_stored_numbers(model, softened=True), probe.sim.layout.constants
    one, second = scaled_scene.all_materials
    pair = constants.mixed_constants(one, radii[0], second, radii[1], scene.interaction)
    expected = internal_numbers(pair, model)
    row = probe.sim.grain_state.lanes("contact")[0, first:]
    np.testing.assert_allclose(row, [getattr(expected, name) for name in names], rtol=1e-12)
    assert probe.sim.grain_state["touch"][0, 0] == pytest.approx(expected.touch, rel=1e-15)
    # at rest at the distance of hard grains, as far as that is known in double precision
    distance = 0.8e-6 - pair.rest_overlap
    probe = Probe(scene, polydisperse([[0, 0, 0], [distance, 0, 0]], radii, materials))
    assert abs(probe.loads()[0][0, 0]) < 1e-6 * pair.F_c


def test_grains_at_rest_stay_and_pull_as_hard():
    """At the distance of hard grains at rest nothing pulls; at first touch JKR pulls with 8/9 of
    the pull-off force 3 pi gamma R (s^3 = 2/3), whatever the stiffness."""
    scene = softer(make_scene(boundary=FAR))
    pair = ContactTable(scene).farthest_pair
    distance = 2 * pair.r - pair.rest_overlap

    def force(gap):
        probe = Probe(scene, sample_of([[0, 0, 0], [distance + gap, 0, 0]]))
        return probe.loads()[0][0, 0]  # towards the other is positive

    # an overlap is known to 1e-16 m, and k_n = 40 N/m
    assert abs(force(0.0)) < 1e-6 * pair.F_c
    # the slope there is 2/3 of 4 F_c/delta0: 1e-6 of delta0 short of it
    pull = 8 / 9 * 3 * np.pi * 0.02 * 0.3e-6
    assert force((1 - 1e-6) * pair.delta0) == pytest.approx(pull, rel=1e-4)


PRESSED = """
name: pressed
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 1}
boundary: {kind: box, side_walls: 0.001, wall_speed: 0.5 m/s}
stop: {time: 1 us}
numerics: {threads: 1, stiffness_scaling: 0.03}
output: {variables: [sliding_force]}
"""


def test_a_softened_sample_is_taken_over(tmp_path):
    """Sliding forces of its contacts stay; grains at rest stay where they are."""
    run = execute(from_yaml(PRESSED), tmp_path / "soft")
    sample = f"sample: {{kind: explicit, file: {run}, keep: [walls]}}"
    text = PRESSED.replace("sample: {kind: rbd, grains: 60, seed: 1}", sample)
    forces = {}
    for scale in (0.03, 1):
        scene = from_yaml(text.replace("0.03", f"{scale}"))
        hard = execute(scene, tmp_path / f"on_{scale}")
        with xr.open_datatree(hard / "result.nc") as tree:
            contacts, count = tree["contacts"], int(tree["snapshots"].contact_count.values[0])
            pairs = [contacts[name].values[:count] for name in ("grain_i", "grain_j")]
            force = contacts["sliding_force"].values[:count]
            forces[scale] = dict(zip(zip(*pairs, strict=True), force, strict=True))
    both = sorted(set(forces[0.03]) & set(forces[1]))
    assert len(both) > 20
    soft, hard = (np.array([forces[s][pair] for pair in both]) for s in (0.03, 1))
    largest = np.abs(soft).max()
    np.testing.assert_allclose(hard, soft, atol=2e-3 * largest)


def refusal(text):
    with pytest.raises(DustError) as caught:
        from_yaml(text)
    return str(caught.value)


def test_it_is_refused_where_a_scene_is_about_what_it_changes():
    base = "name: a\nmaterial: silicate_s12\nstop: {time: 1 us}\n"
    soft = "numerics: {stiffness_scaling: 0.1}\n"
    open_ = "boundary: {kind: open}\n"
    collision = (
        "sample: {kind: collision, speed: 1 m/s, target: {kind: pca, grains: 20}, "
        "projectile: {kind: pca, grains: 20}}\n"
    )
    assert "bodies stick" in refusal(base + open_ + collision + soft)
    from_yaml(base + open_ + collision + soft.replace("0.1", "0.1, scaling_anyway: true"))
    push = "push: [{grains: [0], velocity: [1 cm/s, 0 m/s, 0 m/s]}]\n"
    wave = "sample: {kind: chain, grains: 20}\n" + push
    assert "speed of sound" in refusal(base + open_ + wave + soft)
    pressed = "sample: {kind: rbd, grains: 20}\nboundary: {kind: box, wall_speed: 1 cm/s}\n"
    text = refusal(base.replace("silicate_s12", "ice_t19") + pressed + soft.replace("0.1", "0.001"))
    assert "of the radius" in text and "0.019 and more" in text
