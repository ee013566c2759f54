"""Speeds at which grains would pass through each other, or for which contacts are not made."""

import numpy as np
import pytest
from scenes import FAR, RADIUS, Probe, make_scene, sample_of

from dusttaichi import samples
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.physics import encounter
from dusttaichi.running import execute
from dusttaichi.samples import apply_pushes
from dusttaichi.scene import from_yaml

PAIR = """
name: pair
material: silicate_s12
sample: {{kind: pair, speed: {speed}, gap: 0.5 um}}
boundary: {{kind: open}}
numerics: {{time_step: {step}}}
output: {{snapshots: off}}
stop: {{steps: 200}}
"""


def step_of(speed):
    scene = from_yaml(PAIR.format(speed=speed, step="auto"))
    return scene, chosen_step(ContactTable(scene), apply_pushes(scene, samples.make(scene)))


@pytest.mark.parametrize("step", ("0.3 ns", "auto"))
@pytest.mark.parametrize("speed", ("10 km/s", "2.9e8 m/s"))
def test_grains_that_would_swallow_each_other_are_refused(tmp_path, speed, step):
    """JKR ends at a tenth of a radius; at 10 km/s a head-on collision presses by several."""
    with pytest.raises(
        DustError, match=r"may collide at .*of their radius.*Try a lower speed"
    ) as caught:
        execute(from_yaml(PAIR.format(speed=speed, step=step)), tmp_path / "run")
    assert caught.value.exit_code == 2


def test_the_end_of_the_model_is_where_the_overlap_is_a_tenth():
    scene, step = step_of("50 m/s")
    pair = ContactTable(scene).farthest_pair
    end = step.impact.model_end
    # both are closed forms of one potential; the tolerance is that of the root
    assert encounter.overlap(pair, end) == pytest.approx(0.1 * RADIUS, rel=1e-6)
    assert step.impact.overlap == pytest.approx(encounter.overlap(pair, 50.0) / RADIUS)


def test_a_run_remarks_on_impacts_near_the_end_of_the_model():
    """Energy goes with the square of the speed: `dust check` always says how much it is."""
    scene, step = step_of("1 m/s")
    speed, end = encounter.breaking_speed(ContactTable(scene).farthest_pair), step.impact.model_end
    impact = step_of(f"{3.2 * speed} m/s")[1].impact
    assert "10.2 times the energy that breaks a contact" in impact.text()
    assert not impact.remarks() and not step_of(f"{0.69 * end} m/s")[1].impact.remarks()
    (remark,) = step_of(f"{0.71 * end} m/s")[1].impact.remarks()
    assert "neither flatten nor break grains" in remark


@pytest.mark.parametrize("speed", (1.0, 10.0, 100.0, 1000.0))
def test_the_automatic_step_knows_the_way(speed):
    """No grain goes further than a twentieth of its radius in a step."""
    _, step = step_of(f"{speed} m/s")
    assert step.dt * speed <= 0.05 * RADIUS


def flying(speed, way):
    """Two grains that fly past each other far away; they go `way` radii in a step."""
    v = [[speed, 0, 0], [0, 0, 0]]
    scene = make_scene(dt=way * RADIUS / speed, boundary=FAR)
    return Probe(scene, sample_of(np.array([[0, 0, 0], [0, 9, 0]]) * RADIUS, v))


def test_a_way_that_is_too_long_for_a_step_is_stopped():
    """The longest step of these contacts is 1.5 ns, in which 700 m/s are more than a radius."""
    flying(700.0, 0.45).advance(3)
    with pytest.raises(GuardStop, match=r"0\.55 radii.*Try numerics\.time_step: auto"):
        flying(700.0, 0.55)


def test_faces_faster_than_light_are_stopped(tmp_path):
    """Edges that grow as exp(1e15 t/s) are no numbers before the first search is done."""
    scene = from_yaml("""
name: fast
material: silicate_s12
interaction: {damping: viscoelastic}
sample: {kind: lattice, structure: sc, cells: [4, 4, 4]}
boundary: {kind: periodic, strain_rate: 1e15 s^-1}
output: {snapshots: off}
stop: {steps: 100}
""")
    with pytest.raises(GuardStop, match="faster than light") as caught:
        execute(scene, tmp_path / "run")
    assert caught.value.exit_code == 3


def test_an_extent_that_is_not_a_number_has_no_grid():
    """The search would look for the width of its cells for ever."""
    search = flying(1.0, 1e-4).sim.search
    for extent in (np.nan, np.inf):
        with pytest.raises(GuardStop, match="not a number any more"):
            search._lay_grid(np.zeros(3), np.array([1.0, extent, 1.0]), np.zeros(3), 1.0, 0.0)
