"""What a result holds on request: orientations, losses of each contact, parts of its load; what it
leaves out, and single precision."""

import numpy as np
import pytest

from dusttaichi import samples
from dusttaichi.analysis import open_run, read_frame
from dusttaichi.errors import DustError
from dusttaichi.grains.build import build
from dusttaichi.physics.contact.constants import pair_constants
from dusttaichi.physics.contact.parts import PARTS, wall_parts
from dusttaichi.running import execute
from dusttaichi.samples import make
from dusttaichi.scene import from_yaml

SPIN = 3e6  # rad/s
TEXT = """
name: asked
material: silicate_s12
interaction: {damping: viscoelastic}
sample:
  kind: explicit
  positions: [[0 m, 0 m, 0 m], [1.1998 um, 0 m, 0 m], [0 m, 9 um, 0 m]]
  velocities: [[0 m/s, 0 m/s, 0 m/s], [0 m/s, 1.5 m/s, 0 m/s], [0 m/s, 0 m/s, 0 m/s]]
  spins: [[1e6 rad/s, 0 rad/s, -6e5 rad/s], [-1e6 rad/s, 0 rad/s, 2e5 rad/s],
          [1e6 rad/s, 2e6 rad/s, 2e6 rad/s]]
boundary: {kind: box, omit: [x_min, x_max, y_min, y_max, bottom], size: [1 cm, 1 cm, 1 cm]}
stop: {steps: 400}
numerics: {threads: 1, time_step: 0.1 ns, precision: f64}
output:
  series: {steps: 100}
  variables: [orientation, loss, grain_loss, sliding_force, rolling_moment, twisting_moment, -spin]
  precision: f32
"""

PRESSED = """
name: pressed
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 3}
boundary: {kind: box, wall_speed: 5 m/s}
stop: {steps: 3000}
numerics: {threads: 1, time_step: 0.2 ns, precision: f64}
output: {series: {steps: 500}, variables: [orientation, loss, grain_loss]}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two grains that slide, roll and twist about each other, and one that spins on its own."""
    with open_run(execute(from_yaml(TEXT), tmp_path_factory.mktemp("asked") / "run")) as opened_run:
        yield opened_run


def test_a_free_grain_turns_about_its_spin(run):
    frame = read_frame(run)
    angle = SPIN * frame.time
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    expected = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])
    # the same rotation by exact steps; seven digits are kept
    np.testing.assert_allclose(frame.orientation[2], expected, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(frame.orientation, axis=1), 1.0, rtol=1e-6)
    np.testing.assert_allclose(read_frame(run, 0).orientation[:, 0], 1.0)


def test_a_spin_of_a_tenth_of_a_radian_a_step_is_followed_to_rounding():
    """Sine and cosine of a step are series: 2000 steps, 200 radians, rounding of 1e-16 each."""
    fast = TEXT.replace("[1e6 rad/s, 2e6 rad/s, 2e6 rad/s]", "[6e8 rad/s, 0 rad/s, 8e8 rad/s]")
    scene = from_yaml(fast)
    sim = build(scene, make(scene))
    sim.advance(2000)
    angle, axis = 1e9 * 2000 * 1e-10, np.array([0.6, 0.0, 0.8])
    expected = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])
    orientation = sim.grain_state["orientation"][sim.grain_state.rank[2]]
    np.testing.assert_allclose(orientation, expected, atol=1e-11)


def test_losses_of_contacts_are_those_of_the_ledger(run):
    """One contact that holds: what has been lost by rolling, sliding and twisting is its own."""
    (contact_loss,) = run.contacts().loss.values
    total_loss = run.series.loss.values[-1]
    names = list(run.series.channel.values)
    for name in ("rolling", "sliding", "twisting"):
        n = names.index(name)
        assert contact_loss[n] == pytest.approx(total_loss[n], rel=1e-6) and total_loss[n] > 0.0
    assert contact_loss[names.index("breaking")] == 0.0
    assert not run.contacts(0).loss.values.any()


def test_losses_of_grains_are_halves_of_those_of_their_contact(run):
    grain_losses = run.tree["snapshots"].grain_loss.values
    (contact_loss,) = run.contacts().loss.values
    np.testing.assert_allclose(
        grain_losses[-1, :2], [0.5 * contact_loss] * 2, rtol=1e-6
    )  # seven digits are kept
    assert not grain_losses[-1, 2].any() and not grain_losses[0].any()


def test_losses_of_grains_add_up_to_the_ledger(tmp_path):
    """A cake that is pressed: contacts form, break and form again, on walls too, between searches
    that replace the lists; a wall's contacts belong to their grain alone."""
    with open_run(execute(from_yaml(PRESSED), tmp_path / "run")) as run:
        series, frames = run.series.isel(time=-1), run.tree["snapshots"].isel(snapshot=-1)
        expected = series.loss + series.loss_wall
        assert float(series.loss_wall.sum()) > 0.0 and int(series.step) == 3000
        grain_loss = frames.grain_loss.sum("grain")
        for name in run.series.channel.values:
            # of damping the ledger has half a step less than the contacts
            tolerance = 1e-3 if name == "damping" else 1e-9
            assert float(grain_loss.sel(channel=name)) == pytest.approx(
                float(expected.sel(channel=name)), rel=tolerance
            )
        assert all(float(expected.sel(channel=name)) > 0 for name in ("forming", "breaking"))
        assert (frames.grain_loss.values.sum(axis=1) >= 0.0).all()


def test_the_load_of_a_contact_taken_apart(run):
    """Sliding force k_s zeta, rolling moment k_r R xi, twisting moment -k_t phi (S12 eqs 17-20)."""
    scene, frame = from_yaml(TEXT), read_frame(run)
    c, row = pair_constants(scene.material, scene.interaction), run.contacts().isel(contact=0)
    n1, n2 = row.pointer_i.values.astype(float), row.pointer_j.values.astype(float)
    nc = frame.position[0] - frame.position[1]
    nc /= np.linalg.norm(nc)
    arm = 0.6e-6 * (n1 - n2)
    zeta, xi = arm - nc * (arm @ nc), c.R * (n1 + n2)
    # pointers have seven digits, and their sum is small; 1 + 1e-4: the lever of the torques
    magnitudes = np.linalg.norm(row.sliding_force), np.linalg.norm(row.rolling_moment)
    k = c.numbers
    assert magnitudes[0] == pytest.approx(k["k_s"] * np.linalg.norm(zeta), rel=2e-3)
    assert magnitudes[1] == pytest.approx(k["k_r"] * c.R * np.linalg.norm(xi), rel=2e-3)
    assert row.twisting_moment == pytest.approx(-k["k_t"] * float(row.twist), rel=1e-3)
    sim = build(scene, samples.make(scene))
    sim.advance(50)
    contacts = sim.contacts.measure_pairs()
    forces = contacts["normal_force"][:, None] * (
        sim.motion.measure()[0][:1] - sim.motion.measure()[0][1:2]
    )
    forces /= np.linalg.norm(forces, axis=1)[:, None] / np.abs(contacts["normal_force"])
    np.testing.assert_allclose(
        forces + contacts["sliding_force"], contacts["force"], rtol=1e-9, atol=1e-12
    )


def test_a_wall_that_is_slid_along_makes_no_rolling_moment():
    """Sliding force F at the lever r: all of the torque is its own."""
    normal, force = np.array([[0.0, 0.0, 1.0]]), np.array([[2.0, 1.0, 5.0]])
    torque = np.cross(-0.5 * normal, force) + 0.25 * normal
    found = wall_parts(normal, (force, torque), 0.5)
    assert found["normal_force"] == [5.0] and found["twisting_moment"] == [0.25]
    np.testing.assert_allclose(found["sliding_force"], [[2.0, 1.0, 0.0]])
    np.testing.assert_allclose(found["rolling_moment"], 0.0, atol=1e-15)


def test_parts_of_loads_that_are_not_recorded_are_not_computed():
    normal, force = np.array([[0.0, 0.0, 1.0]]), np.array([[2.0, 1.0, 5.0]])
    load = force, np.cross(-0.5 * normal, force)
    assert list(wall_parts(normal, load, 0.5, ("step", "normal_force"))) == ["normal_force"]
    assert tuple(wall_parts(normal, load, 0.5)) == PARTS


def test_what_is_left_out_and_single_precision(run, tmp_path):
    frames = run.tree["snapshots"]
    assert "spin" not in frames and frames.position.dtype == np.float32
    assert frames.snapshot_time.dtype == np.float64 and run.series.time.dtype == np.float64
    assert np.isnan(read_frame(run).spin).all()
    data = from_yaml(TEXT)._input_data | {
        "sample": {"kind": "explicit", "file": str(run.path.parent)}
    }
    sample = make(type(from_yaml(TEXT)).from_dict(data))
    np.testing.assert_allclose(sample.positions, read_frame(run).position)
    assert not sample.spins.any() and len(sample.contacts["i"]) == 1


@pytest.mark.parametrize(
    "text, message",
    [
        ("variables: [colour]", r"output.variables\[0\] = .*no optional variable of that name"),
        ("variables: [-position]", r"output.variables\[0\].*no optional variable of that name"),
        ("precision: f16", "output.precision"),
    ],
)
def test_what_cannot_be_chosen_is_refused(text, message):
    head = TEXT[: TEXT.index("output:")]
    with pytest.raises(DustError, match=message):
        from_yaml(f"{head}output: {{{text}}}\n")
