"""`dust check`: quick, in the order of a physicist, with the speed of this machine."""

import dataclasses
import json
import re

import numpy as np
import pytest
from program import dust, invoke, python
from scenes import CONFIGS

from dusttaichi import method, simulate
from dusttaichi.analysis.numbers.general import END
from dusttaichi.commands.check import _duration
from dusttaichi.errors import DustError
from dusttaichi.physics.contact import constants
from dusttaichi.scene import Scene, load, quantities
from dusttaichi.studies import step_times


def read_check(*words):
    result = invoke("check", *words)
    assert result.exit_code == 0, result.output
    return result.output


def test_it_begins_with_sample_contacts_step_and_cost():
    text = read_check("smoke")
    titles = ["Sample", "Contact of two grains", "Contact of a grain and a wall", "Time step"]
    positions = [text.index(f"\n{title}\n") for title in [*titles, "Memory", "Cost"]]
    assert positions == sorted(positions)
    assert "steps at most                              4,000" in text
    assert "Compiled in" not in text and "critical_rolling" not in text


def test_it_says_how_far_side_walls_hold_grains_and_what_is_reached_already():
    row = r"rolling, sliding, twisting at side walls +times 0.001 \(boundary.side_walls\)"
    assert len(re.findall(row, read_check("smoke"))) == 1  # of walls, not of two grains
    text = read_check(
        "smoke", "--set", "boundary.side_walls=1", "--set", "stop.filling_factor=0.01"
    )
    assert "at side walls" not in text
    assert re.search(r"steps at most +0: filling factor 0.01 is reached at the start", text)


def test_it_says_where_few_grains_do_not_fill_their_box():
    settings = ("name=loose", "sample={kind: space_filling, grains: 100, filling_factor: 0.005}")
    text = read_check("smoke", *(word for setting in settings for word in ("--set", setting)))
    (filling_factor,) = re.findall(
        r"in the box around them the filling factor is ([\d.]+)\. Use", text
    )
    assert float(filling_factor) > 0.0125  # of 0.005
    assert re.search(rf"filling factor of the bounding box +{filling_factor}", text)


def test_as_json_it_has_numbers(tmp_path):
    """The keys that docs/commands.md promises."""
    data = json.loads(read_check("smoke", "--json"))
    assert data["format"] == "dusttaichi check 1" and data["valid"] is True
    assert (data["name"], data["method"], data["particles"]) == ("smoke", "grains", 60)
    assert data["time_step_s"] == pytest.approx(0.15e-9)
    (stage,) = data["stages"]
    assert stage["most_steps"] == 4000 and stage["most_time_s"] == pytest.approx(0.6e-6)
    assert data["run_time_s"]["likely"] > 0.0 and "Contact of two grains" in data["text"]
    path = tmp_path / "bad.yaml"
    path.write_text("name: bad\nmaterial: silicate_s12\nsample: {kind: rbd, grain: 5}\n")
    result = invoke("check", path, "--json")
    refused = json.loads(result.stdout)
    assert isinstance(result.exception, DustError) and refused["valid"] is False
    assert any(text.startswith("sample.grain = 5: unknown key") for text in refused["problems"])


COLLIDING = [
    "collide", "--set", "sample.target.grains=20", "--set", "sample.projectile.grains=20",
    "--set", "collisions.speed=[10 m/s, 40 m/s, 100 m/s]", "--set", "collisions.bodies={a: "
    "{kind: pca, grains: 20}, b: {kind: pca, grains: 30}}",
]  # fmt: skip


def test_of_a_study_of_collisions_it_has_the_size_the_cost_and_the_limit_of_the_model():
    text = read_check(*COLLIDING)
    assert "dust collide runs the 150 collisions of the last section" in text
    study = text.partition("\nStudy, by dust collide\n")[2]
    assert "150: 2 bodies x 3 speeds x 5 impact parameters x 5 pairs of seeds" in study
    assert re.search(r"grains of both bodies +40 to 60", study)
    assert re.search(r"side by side +at most 50 in a process", study)  # 2000 grains
    assert "speeds from 100 m/s on (1 of 3) exceed the range of the contact model" in study
    assert re.search(r"run time at most +.* (min|s) to .* (min|s|h), ", study)
    study_values = json.loads(read_check(*COLLIDING, "--json"))["study"]
    assert (study_values["command"], study_values["runs"]) == ("dust collide", 150)
    assert 0.0 < study_values["run_time_s"]["least"] < study_values["run_time_s"]["most"]
    # at a fixed step of 0.02 ns, 5 us and a flight of a radius before it
    fixed = [*COLLIDING, "--set", "numerics.time_step=0.02 ns", "--set", "collisions.refine=3"]
    flights = sum(round(0.1e-6 / v / 0.02e-9 + 5e-6 / 0.02e-9) for v in (10.0, 40.0, 100.0))
    study_values = json.loads(read_check(*fixed, "--json"))["study"]
    assert study_values["runs"] == 300  # three speeds more
    assert study_values["most_steps"] == pytest.approx(2 * flights * 2 * 25, rel=1e-4)
    assert "study" not in json.loads(read_check("smoke", "--json"))


def test_speeds_at_which_no_collision_starts_are_said():
    text = read_check(*COLLIDING[:5], "--set", "collisions.speed=[10 m/s, 5 km/s]")
    assert "none starts from 5e3 m/s on: grains would swallow each other" in text


def test_of_a_continuum_it_says_particles_material_and_step():
    text = read_check(CONFIGS / "guettler2009/bead.yaml")
    for line in (
        "4,752: 3,657 dust, 112 rigid, 983 fixed",
        "compressive strength Sigma                 37.12 Pa",  # p_m = 1.3 kPa at 0.15
        "time step at the start                     1.592 µs",  # 0.5 h / 40.82 m/s
        "steps at most                              353",
    ):
        assert line in text
    text = read_check(CONFIGS / "guettler2009/bead.yaml", "--forces")
    assert "the method of this scene has no forces without a step" in text


def test_of_a_continuum_it_says_what_is_coarse_and_what_whole_steps_miss():
    """The bead of configs/trade is 5.5 spacings wide; an output step is 25.47 us."""
    bead = CONFIGS / "trade/bead.yaml"
    text = read_check(bead, "--set", "stop.time=400 us")
    assert "spacings, fewer than the 12 that keep numerical dissipation low" in text
    assert re.search(r"25.47\d* µs in place of 10 µs", text)
    assert "numerics.time_step: 10 µs matches it exactly" in text
    assert re.search(r"407.5\d* µs in place of 0.4 ms", text)
    fine = ("numerics.spacing=80 um", "numerics.time_step=10 us", "stop.time=400 us")
    text = read_check(bead, *(word for setting in fine for word in ("--set", setting)))
    assert "numerical dissipation" not in text and "in place of" not in text


def test_of_a_continuum_that_meets_a_wall_at_the_start_it_says_that_steps_may_be_shorter():
    """The run takes 1.266 us: the dust at the wall is strained by 8.4 m/s already."""
    wall = CONFIGS / "guettler2009/wall_impact.yaml"
    text = read_check(wall)
    assert "at most 1.592 µs, 8 time steps at the start" in text
    assert re.search(r"at most 1.592\d* µs in place of 1 µs", text)
    assert "output step                                1 µs" in read_check(
        wall, "--set", "numerics.time_step=1 us"
    )


def test_a_step_that_does_not_resolve_how_bodies_meet_is_said():
    """The shipped collision takes 0.2 ns; `auto` would resolve it."""
    phrase = "times the step resolving the impact"
    assert f"1.7 {phrase}" in read_check("collision")
    assert phrase not in read_check("collision", "--set", "numerics.time_step=auto")


def test_what_the_sample_refuses_is_not_called_valid(tmp_path, capsys):
    """Overlapping grains and bodies, a body that is smaller than a particle; what single precision
    does not resolve, and a cell that cannot get lower, as the build says."""
    box = "material: silicate_s12\nstop: {time: 1 us}\nboundary: {kind: box}\n"
    near = "sample: {kind: explicit, positions: [[0 m, 0 m, 0 m], [0.5 um, 0 m, 0 m]]}\n"
    far = near.replace("0.5 um", "900 um") + "numerics: {precision: f32}\n"
    flat = "sample: {kind: lattice, structure: sc, cells: [4, 5, 2]}\nboundary: {kind: periodic, "
    flat += "size: [fit, fit, 2.44 um], strain_rate: [0 s^-1, 0 s^-1, -1000 s^-1]}\n"
    sphere = "sphere: {radius: 50 um, density: 2000 kg/m^3, position: [0 um, 0 um, 0 um]}\n"
    coarse = (CONFIGS / "guettler2009/bounce.yaml").read_text()
    coarse = re.sub(r"spacing: [^,}\n]*", "spacing: 5 mm", coarse)
    refused = {
        "diameters": f"name: a\n{box}{near}",
        "overlaps": f"name: b\n{box}sample: {{kind: rbd, grains: 20}}\n{sphere}",
        "smaller than one particle": coarse,
        "single precision knows": f"name: c\n{box}{far}",
        "two grains .* it cannot be compressed": f"name: d\n{box.partition('boundary')[0]}{flat}",
    }
    for reason, text in refused.items():
        file = tmp_path / "scene.yaml"
        file.write_text(text)
        with pytest.raises(DustError, match=reason):
            dust("check", file)
        assert "valid" not in capsys.readouterr().out


def test_it_compiles_nothing():
    code = "import sys; sys.argv = ['dust', 'check', 'smoke']\n"
    code += "from dusttaichi.compute.engine import ti\n"
    code += "ti.init = None\n"  # which whatever compiles has to call
    code += "from dusttaichi.commands.app import main\nmain()"
    process = python("-c", code)
    assert process.returncode == 0 and "4,000" in process.stdout, process.stderr


TWO = """
name: two
material: silicate_s12
sample: {kind: explicit, positions: [[0 um, 0 um, 0 um], [1.199 um, 0 um, 0 um]]}
interaction: {damping: none}
boundary: {kind: box}
numerics: {precision: f64, threads: 1, newton_steps: 2}
stop: {time: 1 us}
"""


def test_the_forces_of_the_start_are_those_of_the_law(tmp_path):
    """Two grains 1 nm deep, in walls that they touch at rest: 2 by one, 4 by two of them."""
    (tmp_path / "two.yaml").write_text(TWO)
    text = read_check(tmp_path / "two.yaml", "--forces")
    title = "\nForces of the contacts at the start\n"
    rows = dict(re.findall(r"^  (\S.*?)  +(.*)$", text[text.index(title) :], re.MULTILINE))
    scene = load(tmp_path / "two.yaml")
    pair = constants.pair_constants(scene.material, scene.interaction)
    wall = constants.wall_constants(scene.material, scene.interaction)
    force, energy, _ = pair.curve(1e-9)
    energy += 10 * wall.curve(wall.delta0)[1]
    assert rows["contacts between grains"] == "1" and rows["contacts with walls"] == "10"
    assert rows["coordination number"] == "1"
    for row in ("largest force on a grain", "mean force on a grain"):
        value = quantities.parse(rows[row].partition(",")[0], "force")
        assert value == pytest.approx(force, rel=1e-3), row  # four digits are printed
    for row in ("normal", "all effects"):
        value = quantities.parse(rows[f"potential energy, {row}"], "energy")
        assert value == pytest.approx(energy, rel=1e-3)
    assert rows["potential energy, sliding"] == "0 J"
    total = [
        quantities.parse(f, "force") for f in rows["total force on the walls"][1:-1].split(",")
    ]
    assert np.abs(total).max() < 1e-6 * force  # walls are where grains rest
    with simulate(scene) as simulation:
        forces, torque = simulation.forces()  # the same in Python, undigested
    np.testing.assert_allclose(forces, [[-force, 0, 0], [force, 0, 0]], atol=1e-6 * force)
    assert torque.shape == (2, 3) and not torque.any()


def test_without_a_measurement_the_run_time_is_an_order_of_magnitude(monkeypatch):
    text = read_check("smoke")
    assert "steps/s, within an order of magnitude; --time measures it" in text
    scene = load("smoke")
    least, seconds, longest = step_times.estimate_step_time(scene, 60)
    assert least < seconds < longest
    # on a GPU the launches of a step take a time that hardly depends on the number of grains
    device = scene.with_value("numerics.backend", "cuda")
    small, large = (step_times.estimate_step_time(device, size)[1] for size in (60, 100_000))
    on_cores = step_times.estimate_step_time(scene, 100_000)[1]
    assert seconds < small < large < 2 * small < 0.1 * on_cores
    run_time = json.loads(read_check("smoke", "--json"))["run_time_s"]
    assert run_time == {"least": 4000 * least, "likely": 4000 * seconds, "most": 4000 * longest}
    monkeypatch.setattr(step_times, "measure_step_time", lambda scene, plan: (0.8e-5, 1e-5, 2e-2))
    text = read_check("smoke", "--time")
    assert "100,000 steps/s, measured now" in text
    assert "run time at most                           1 s to 80 s, plus start-up" in text
    assert json.loads(read_check("smoke", "--time", "--json"))["run_time_s"]["most"] == 80.0


@pytest.mark.parametrize(
    ("name", "seconds"), [("continuum/pressing", 3.1e-3), ("continuum/collision", 0.28)]
)
def test_the_order_of_magnitude_counts_the_time_steps_of_a_continuum(name, seconds):
    """Within the stated factor of measured steps, each of which has several of the method."""
    values = json.loads(read_check(name, "--json"))
    steps = values["stages"][0]["most_steps"]
    shortest, longest = (values["run_time_s"][word] / steps for word in ("least", "most"))
    assert shortest < seconds < longest


def test_the_first_steps_of_a_scene_tell_its_speed(monkeypatch):
    """Steps of 1 ms, after the first one, whose kernels are compiled."""

    class Sim:
        step = 0

        def advance(self, steps):
            clock[0] += 10.0 if self.step == 0 else 1e-3 * steps
            self.step += steps

    clock, scene = [0.0], load("smoke")
    grains = method.find_method(scene)
    monkeypatch.setattr(step_times.real_time, "perf_counter", lambda: clock[0])
    fake = dataclasses.replace(grains, build=lambda *_: Sim(), make_sample=lambda scene: None)
    monkeypatch.setattr(step_times.method, "find_method", lambda scene: fake)
    least, seconds, longest = step_times.measure_step_time(scene, [("", 4000, "")])
    assert seconds == pytest.approx(1e-3) and least < seconds < longest
    with pytest.raises(DustError, match="ends after one step"):
        step_times.measure_step_time(scene, [("", 1, "")])


def test_durations_are_said_as_people_do():
    times = [0.2, 47, 400, 20000, 1e6]
    assert [_duration(t) for t in times] == ["1 s", "47 s", "6.7 min", "5.6 h", "12 days"]


GRAINS = {
    "name": "plain",
    "material": "silicate_s12",
    "sample": {"kind": "lattice", "structure": "sc", "grains": 64},
    "boundary": {"kind": "box", "wall_speed": "5 cm/s"},
    "stop": {"steps": 10},
}
DUST = {
    "name": "plain",
    "method": "continuum",
    "material": "dust_g09",
    "sample": {"kind": "sphere", "diameter": "1 mm", "velocity": ["0 m/s", "-3 m/s"]},
    "boundary": {"kind": "faces", "bottom": "rigid"},
    "numerics": {"spacing": "100 um"},
    "stop": {"steps": 1},
}
BEAD = {"kind": "elastic", "diameter": "1.1 mm", "density": "2540 kg/m^3", "bulk_modulus": "10 MPa"}
COARSE = {"spacing": "150 um", "contact": "separate"}
IMPACT = {
    "kind": "impact",
    "target": {"kind": "block", "size": ["3 mm", "2 mm"]},
    "projectile": BEAD | {"shear_ratio": 0.6},
    "speed": "0.5 m/s",
}
BAR = {"kind": "block", "size": ["1.5 mm", "3 mm"]}
LAYER = {"layer": "0.3 mm"}
STRETCHED = {"kind": "faces", "bottom": LAYER, "top": LAYER, "wall_speed": "-2 cm/s"}
STRESSED = {"spacing": "100 um", "artificial_stress": "on"}
PULLED = {"kind": "plates", "wall_speed": "-5 cm/s"}
PRESSED = {"kind": "plates", "wall_speed": "5 cm/s"}
PACKING = {"kind": "random_packing", "size": ["6 um"] * 3, "filling_factor": 0.3}
DISC = {"kind": "cutout", "of": PACKING, "diameter": "5 um", "length": "5 um"}
PAIR = {"kind": "pair", "gap": "1 nm", "speed": "1 m/s"}
CASES = [
    (GRAINS, {}, ["interaction.damping"]),
    (GRAINS, {"interaction": {"damping": "viscous"}}, []),
    (GRAINS, {"boundary": PULLED}, ["output.series"]),
    (GRAINS, {"boundary": PULLED, "output": {"series": {"strain": 1e-3}}}, []),
    (
        GRAINS,
        {"boundary": PRESSED, "sample": DISC, "interaction": {"damping": "viscous"}},
        ["output.series"],
    ),
    (GRAINS, {"sample": PAIR, "boundary": {"kind": "open"}}, ["numerics.accuracy"]),
    (DUST, {}, ["numerics.viscosity", "numerics.contact"]),
    (DUST, {"numerics": {"spacing": "100 um", "viscosity": "impact", "contact": "separate"}}, []),
    (DUST, {"sample": IMPACT, "numerics": COARSE}, ["numerics.spacing"]),
    (DUST, {"sample": BAR, "boundary": STRETCHED}, ["numerics.artificial_stress"]),
    (DUST, {"sample": BAR, "boundary": STRETCHED | {"wall_speed": "2 cm/s"}}, []),
    (DUST, {"sample": BAR, "boundary": STRETCHED | {"bottom": "open"}}, []),
    (DUST, {"sample": BAR, "boundary": STRETCHED, "numerics": STRESSED}, []),
    (DUST, {"sample": IMPACT, "numerics": COARSE | {"spacing": "90 um"}}, []),
]


@pytest.mark.parametrize(("base", "changes", "keys"), CASES)
def test_defaults_to_change_are_named(base, changes, keys):
    scene = Scene.from_dict(base | changes)
    sections = dict(method.find_method(scene).preview(scene).sections)
    assert [key for key, _ in sections.get("Defaults to change", [])] == keys


def test_the_table_of_a_run_has_them():
    (row,) = (number for number in END.numbers if number.name == "advice")
    texts = "numerics.viscosity: impact. Dense: 8 %\nnumerics.contact: separate"
    rows = row.table_rows({"advice": texts})
    assert rows == [
        ("set numerics.viscosity", "impact. Dense: 8 %", ""),
        ("set numerics.contact", "separate", ""),
    ]
