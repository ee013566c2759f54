"""Sticking speed and restitution, against the closed form of the model's own jumps."""

import json
import math
import os

import numpy as np
import pytest
import reference as ref
import xarray as xr
from program import dust
from scenes import RADIUS, box, make_scene

from dusttaichi import method, plots
from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.errors import DustError
from dusttaichi.scene import load
from dusttaichi.studies import sticking_task as task
from dusttaichi.studies.colliding_bodies import TwoBodies
from dusttaichi.studies.restitution_map import RestitutionMap, list_map_rows
from dusttaichi.studies.scene_settings import apply_settings
from dusttaichi.studies.sticking_search import Collision, Search, compute_closed_form, list_rows
from dusttaichi.studies.study_types import PointResult

pytestmark = pytest.mark.usefixtures("one_core")

WALL = ref.numbers(wall=True)
FACTORS = np.geomspace(1.01, 20.0, 6)


def answer_study(study):
    """What is found of a study whose requests are answered by this process."""
    answers = {}
    while points := [point for point in study.points(answers) if point.label not in answers]:
        for point in points:
            answers[point.label] = PointResult(point, measured=task.run(None, **point.arguments))
    return answers


def sticking(scene, *arguments, **options):
    study = Search(scene, *arguments, **options)
    return study.build_result(answer_study(study))


def restitution(scene, low, high, count, *arguments):
    """The map; low, high [m/s]."""
    study = RestitutionMap(scene, "map", f"{low:.17g} m/s,{high:.17g} m/s,{count}", *arguments)
    return study.dataset(answer_study(study))


def pair(gap="1 nm", **keys):
    return make_scene(
        sample={"kind": "pair", "gap": gap, "speed": "0.1 m/s"}, stop={"time": "25 ns"}, **keys
    )


def below_a_wall(**keys):
    """A grain that flies up at a wall, its surface an equilibrium overlap away from it."""
    height = 2 * RADIUS + 0.001 * WALL.delta0  # the smallest that the checks of the scene allow
    return make_scene(
        sample={
            "kind": "explicit",
            "positions": [["0 m"] * 3],
            "velocities": [["0 m/s", "0 m/s", "0.1 m/s"]],
        },
        boundary=box("top", size=(4 * RADIUS, 4 * RADIUS, height)),
        stop={"time": "25 ns"},
        **keys,
    )


def compare(scene, tolerance):
    """e(v) to 1e-3 down to 1.01 v_s.

    There e^2 is 0.02, so that 2e-3 of it is 4e-5 of the energy: a contact is found up to v dt too
    late, an error of up to 1.15 v dt/delta0, and breaks up to v_after dt too late.
    """
    low, high = compute_closed_form(scene) * FACTORS[[0, -1]]
    data = restitution(scene, low, high, len(FACTORS), tolerance)
    assert not data.bound.any() and data.attrs["closed_form"] == 1
    np.testing.assert_allclose(data.restitution, np.sqrt(1 - FACTORS**-2), rtol=1e-3)


def test_restitution_of_a_pair_and_on_a_wall():
    """From the very first touch on, so that the steps only tell at the end."""
    compare(pair("-1e-7 nm"), 3e-4)
    assert compute_closed_form(below_a_wall()) == pytest.approx(0.124, abs=0.5e-3)
    compare(below_a_wall(), 4e-5)


def test_sticking_speed_from_any_bracket():
    speed = sticking(pair(), 1e-3, low=0.05, high=0.33)
    assert speed.speed == pytest.approx(0.1101, rel=1e-3)
    assert speed.closed == pytest.approx(0.1101, abs=0.5e-4)
    assert speed.low < speed.high <= 1.001 * speed.low and not len(speed.sticking_above)
    assert np.array_equal(speed.bound, speed.speeds <= speed.low)
    assert dict(list_rows(speed))["sticking speed"].startswith("0.110")
    # tolerance 20 %: only the search itself is looked at
    speed = sticking(pair(), 0.2, 0.5, 2.0)
    assert speed.low < 0.1101 < speed.high and speed.high < 1.2 * speed.low


def test_a_pair_starts_apart_or_it_is_said():
    """Without a gap the grains of a pair start in contact, where they would have to escape."""
    bare = make_scene(sample={"kind": "pair"}, stop={"time": "25 ns"})
    apart = Collision(bare, 0.2)
    assert np.ptp(apart.sample.positions[:, 0]) == pytest.approx(2.002 * RADIUS, rel=1e-9)
    assert "1.2 nm apart" in apart.start and not Collision(pair(), 0.2).start
    assert "escape" in Collision(pair("-0.1 nm"), 0.2).start


def test_map_is_written(tmp_path):
    found = restitution(pair(), 0.05, 1.0, 16, 0.01)
    save_ensemble(found, tmp_path / "map/restitution.nc")
    with xr.open_dataset(tmp_path / "map/restitution.nc") as data:
        bound = data.bound.values == 1
        assert np.array_equal(bound, data.speed.values < 0.1101)
        assert np.all((data.restitution.values == 0) == bound)
        assert np.array_equal(data.fragments, np.where(bound, 1, 2))
        assert data.speed.attrs["units"] == "m/s" and data.attrs["title"] == "test"
        slowest = data.speed.values[~bound].min()
    assert dict(list_map_rows(found))["slowest without sticking"] == f"{slowest:.6g} m/s"
    drawn = plots.save(plots.restitution_map(found), tmp_path / "map/restitution.png")
    assert drawn.stat().st_size > 1000


def test_numbers_as_json(tmp_path, capsys):
    (tmp_path / "pair.yaml").write_text(pair().to_yaml())
    words = ["sticking", tmp_path / "pair.yaml", "--tolerance", 0.2, "-o", tmp_path / "search"]
    dust(*words, "--json", "-q")
    found = json.loads(capsys.readouterr().out)
    assert found["low"] < 0.1101 < found["high"] and found["low"] < found["speed"] < found["high"]
    assert len(found["speeds"]) == len(found["bound"])
    # that it goes on where it ended is the engine's: test_workers
    (tmp_path / "pair.yaml").write_text(pair().to_yaml())
    words = ["sticking", tmp_path / "pair.yaml", "--tolerance", 0.1, "-q", "--resume"]
    dust(*words, "--map", "0.05 m/s,0.5 m/s,3", "-o", tmp_path / "map")
    assert len((tmp_path / "map/restitution.jsonl").read_text().splitlines()) == 3
    with xr.open_dataset(tmp_path / "map/restitution.nc") as data:
        assert data.bound.values.tolist() == [1, 0, 0]


def test_a_search_continues_with_the_speeds_that_are_stored(tmp_path, capsys):
    """Of an interrupted one no speed is computed again; progress is told without a terminal."""
    (tmp_path / "pair.yaml").write_text(pair().to_yaml())
    words = ["sticking", tmp_path / "pair.yaml", "--tolerance", 0.1, "-o", tmp_path / "search"]
    dust(*words)
    output, rows = capsys.readouterr(), tmp_path / "search/search.jsonl"
    assert "round 1: 16 speeds from 0.0275" in output.err and "round 2: " in output.err
    lines = rows.read_text().splitlines()
    rows.write_text("\n".join(lines[:20]))  # the second round had begun
    dust(*words, "--resume")
    second_output = capsys.readouterr()
    assert (
        "16 of 16 are already finished" in second_output.err
        and "4 of 16 are already" in second_output.err
    )
    assert sorted(rows.read_text().splitlines()) == sorted(lines)
    assert second_output.out == output.out


def test_a_limit_of_the_model_is_said():
    """Grains may overlap by a tenth of their radius at most."""
    study = RestitutionMap(pair(), "map", "0.1 m/s,1 km/s,5")
    assert "speeds from 1e3 m/s on (1 of 5) exceed the range of the contact model" in study.beyond
    assert not Search(pair()).beyond
    assert Search(pair(), low=50.0, high=500.0).beyond.startswith("speeds from 1")
    assert RestitutionMap(below_a_wall(), "map", "0.1 m/s,1 km/s,5").beyond


def test_refused():
    with pytest.raises(DustError, match="allowed: pair, collision"):
        Search(make_scene())
    with pytest.raises(DustError, match="the second above the first"):
        Search(pair(), low=0.2, high=0.1)
    with pytest.raises(DustError, match="--tolerance"):
        Search(pair(), tolerance=0)
    with pytest.raises(DustError, match="--map 1,2"):
        RestitutionMap(pair(), "nowhere", "1,2")
    with pytest.raises(DustError, match="must be one value"):
        apply_settings(pair(), ["sample.speed=1m/s,2m/s"])
    assert apply_settings(pair(), ["sample.speed=1m/s"]).sample.speed == 1.0


@pytest.mark.parametrize(
    "name, speed", [("sticking", 0.1101), ("paszun_dominik2008/sticking_wall", 0.1488)]
)
def test_configs(name, speed):
    assert compute_closed_form(load(f"configs/{name}.yaml")) == pytest.approx(speed, abs=1e-4)


def test_map_over_speed_and_angle_has_the_single_maps():
    """Angles are a dimension before the speed; every point is what its own map gives."""
    scene = load("configs/sticking.yaml")
    both = restitution(scene, 0.2, 0.8, 2, 1e-2, ["sample.angle=0 deg,40 deg"])
    assert both.restitution.dims == ("sample.angle", "speed")
    np.testing.assert_allclose(both["sample.angle"], np.radians([0.0, 40.0]))
    alone = restitution(scene, 0.2, 0.8, 2, 1e-2)
    np.testing.assert_array_equal(both.restitution[0], alone.restitution)  # bit for bit
    # only the part of the speed along the line of centres is lost: an oblique hit keeps more
    assert np.all(both.restitution[1] != both.restitution[0])


def test_unlike_grains_have_the_closed_form_of_their_contact():
    scene = load("configs/sticking.yaml").with_value("sample.radii", ["0.6 um", "0.2 um"])
    m = scene.material
    R, mass = 0.15e-6, [4 / 3 * np.pi * r**3 * m.density for r in (0.6e-6, 0.2e-6)]
    E_star = m.young_modulus / (2 * (1 - m.poisson_ratio**2))
    a0 = (9 * np.pi * m.surface_energy * R**2 / E_star) ** (1 / 3)
    F_c, delta0 = 3 * np.pi * m.surface_energy * R, a0**2 / (3 * R)
    reduced = mass[0] * mass[1] / sum(mass)
    expected = np.sqrt(2 * 0.77224 * F_c * delta0 / reduced)
    assert compute_closed_form(scene) == pytest.approx(expected, rel=1e-4)  # digits of 0.77224
    data = restitution(scene, 2.0 * expected, 3.0 * expected, 2, 1e-3)
    assert float(data.restitution[0]) == pytest.approx(np.sqrt(1 - 1 / 4), abs=1e-3)


def test_a_collision_is_the_run_of_its_scene_with_all_its_grains():
    """Bodies of unequal grains fly until the surfaces of two grains touch, and end after `stop`."""
    scene = make_scene(
        damping="viscous",
        sample={
            "kind": "collision",
            "target": {"kind": "pca", "grains": 12, "seed": 1},
            "projectile": {"kind": "pca", "grains": 12, "seed": 2},
            "speed": "2 m/s",
            "gap": "5 nm",
        },
        stop={"time": "100 ns"},
        threads=1,
    )
    collision = Collision(scene, 1e-2)
    answer = task.run(None, **collision.make_request(2.0).arguments)
    how = method.find_method(scene)
    sim = how.build(scene, how.make_sample(scene))
    sim.advance(math.ceil(102.5e-9 / (sim.dt * 1e-6)))
    assert answer["time_step"] == sim.dt * 1e-6
    assert answer["contacts"] == len(sim.contacts.measure_pairs()["grain_i"])
    _, v, w = sim.motion.measure()
    energy = 0.5 * (sim.bodies.mass * np.sum(v**2) + sim.bodies.inertia * np.sum(w**2)) * 1e-15
    assert answer["kinetic"] == pytest.approx(energy, rel=1e-12)  # sums in another order
    # their centres pass through each other
    broken = task.run(None, **collision.make_request(20.0).arguments)
    assert not broken["bound"] and broken["fragments"] > 5 and math.isnan(broken["restitution"])


def flight(scene):
    sample, _, way = task.make_moving_bodies(scene)
    return task._measure_flight(TwoBodies(scene, sample), way)


def test_flight_ends_where_surfaces_touch(tmp_path):
    """Of unequal grains: of a pair, and of grains of a file, of which the larger meets the wall."""
    scene = load("configs/sticking.yaml").with_value("sample.radii", ["0.6 um", "0.2 um"])
    assert flight(scene) == pytest.approx(1e-9, rel=1e-6)
    lines = ["x [um],y [um],z [um],vx [m/s],vy [m/s],vz [m/s],radius [um]"]
    lines += ["0,0,0,0,0,0.2,0.6", "1.1,0,0.1,0,0,0.4,0.4"]
    (tmp_path / "grains.csv").write_text("\n".join(lines))
    scene = below_a_wall().with_value(
        "sample", {"kind": "explicit", "file": str(tmp_path / "grains.csv")}
    )
    # see below_a_wall; the digits are those of the constants of the reference
    assert flight(scene) == pytest.approx(1.001 * WALL.delta0, rel=1e-5)
    assert Collision(scene, 0.5).make_request(1.0).inputs == (
        os.path.relpath(tmp_path / "grains.csv"),
    )
