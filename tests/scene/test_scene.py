"""What the YAML may say, what becomes of it, and which blocks do not go together."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml
from scenes import (
    BASE,
    CONFIGS,
    FULL,
    OPEN,
    POSITIONS,
    edit_base,
    extensions_forgotten,
    scene,
    text_of,
)

from dusttaichi.errors import DustError
from dusttaichi.scene import (
    NAMED,
    NoDamping,
    Scaled,
    Scene,
    Viscoelastic,
    Viscous,
    as_scene,
    from_yaml,
    load,
)
from dusttaichi.scene.yaml_text import read

FILES = sorted(CONFIGS.rglob("*.yaml"))
IDS = [str(path.relative_to(CONFIGS)) for path in FILES]


@pytest.fixture(autouse=True)
def leave_nothing_behind():
    with extensions_forgotten():
        yield


# What is accepted.


@pytest.mark.parametrize("path", FILES, ids=IDS)
def test_configs_round_trip_and_satisfy_the_schema_that_they_name(path):
    loaded, text = load(path), path.read_text(encoding="utf-8")
    assert loaded.source == text and loaded.path == path
    written = loaded.to_yaml()
    repeated_scene = from_yaml(written)
    assert repeated_scene == loaded and hash(repeated_scene) == hash(loaded)
    assert repeated_scene.to_yaml() == written
    absolute_text = loaded.to_yaml(absolute=True)
    assert from_yaml(absolute_text).to_yaml(absolute=True) == absolute_text
    prefix, _, relative = text.splitlines()[0].partition("=")
    assert prefix == "# yaml-language-server: $schema"
    schema = json.loads((path.parent / relative).read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(schema)
    for data in (read(text).data, yaml.safe_load(text), read(written).data):
        validator.validate(data)


def test_names_of_configs_are_distinct():
    names = {read(path.read_text(encoding="utf-8")).data["name"] for path in FILES}
    assert len(names) == len(FILES)


def test_values_are_si_and_defaults_as_documented():
    cake = scene()
    assert cake.material.radius == 0.6e-6
    assert cake.material.density == 2650.0
    assert cake.boundary.wall_speed == 0.01
    assert cake.boundary.size == "fit" and cake.boundary.side_walls == 1e-3
    assert cake.interaction.shear_modulus == "mindlin"
    assert cake.interaction.sliding.modifier == 1.0
    assert cake.interaction.damping == Viscous(model="viscous", kappa="1e-6 g/s")
    assert cake.numerics.time_step == "auto" and cake.numerics.step_fraction == 0.2
    assert cake.output.directory == Path("runs/cake")
    assert cake.output.window == "interval" and cake.output.checkpoint == 60.0
    box = scene().output
    assert box.series.filling_factor == 0.002 and box.profiles.filling_factor == 0.05
    assert box.snapshots is None  # off in the scene
    assert scene(output="{precision: f32}").output.snapshots == "auto"
    open_ = scene(**OPEN).output
    assert open_.series.steps == 1000 and open_.profiles is None
    assert scene(output="{series: off, profiles: {steps: 5}}").output.series is None


@pytest.mark.parametrize("name", NAMED)
def test_named_materials(name):
    assert scene(material=name).material.name == name
    changed = scene(material=f"{{base: {name}, surface_energy: 25.5 mJ/m^2}}").material
    assert changed.surface_energy == 0.0255
    assert changed.radius == scene(material=name).material.radius
    assert changed.name == f"{name}, changed"


def test_material_by_six_numbers():
    numbers = ", ".join(f"{key}: {value}" for key, value in NAMED["ice_t19"].items())
    material = scene(material=f"{{{numbers}}}").material
    assert material.radius == 1e-7 and material.name == "custom"


@pytest.mark.parametrize(
    "text, damping",
    [
        ("none", NoDamping(model="none")),
        ("null", NoDamping(model="none")),
        ("off", NoDamping(model="none")),
        ("viscous", Viscous(model="viscous")),
        ("scaled", Scaled(model="scaled", coefficient=0.01)),
        ("viscoelastic", Viscoelastic(model="viscoelastic", time="12.5 ps")),
        ("{model: none}", NoDamping(model="none")),
        ("{model: viscous, kappa: 2e-6 g/s}", Viscous(model="viscous", kappa="2e-6 g/s")),
    ],
)
def test_damping_forms(text, damping):
    assert scene(interaction=f"{{damping: {text}}}").interaction.damping == damping


@pytest.mark.parametrize("effect", ["rolling", "sliding", "twisting"])
@pytest.mark.parametrize(
    "text, modifier",
    [
        ("on", 1.0),
        ("{}", 1.0),
        ("true", 1.0),
        ("{modifier: 8}", 8.0),
        ("{modifier: 1e-3}", 1e-3),
        ('{modifier: "2.5"}', 2.5),
        ("off", None),
        ("false", None),
        ("null", None),
    ],
)
def test_effect_forms(effect, text, modifier):
    value = getattr(scene(interaction=f"{{{effect}: {text}}}").interaction, effect)
    assert (value.modifier if value else None) == modifier


def test_plain_data_and_numbers_of_python():
    data = yaml.safe_load(BASE.replace("rolling: on", "rolling: off, sliding: {modifier: 1e-3}"))
    assert data["interaction"] == {"rolling": False, "sliding": {"modifier": "1e-3"}}
    interaction = Scene.from_dict(data).interaction
    assert interaction.rolling is None and interaction.sliding.modifier == 1e-3
    data = yaml.safe_load(BASE)
    data["sample"]["grains"] = np.int64(50)
    data["interaction"]["rolling"] = {"modifier": np.float32(0.5)}
    read = Scene.from_dict(data)
    assert read.sample.grains == 50 and read.interaction.rolling.modifier == 0.5
    assert type(read.sample.grains) is int


def test_values_of_python_in_a_changed_scene():
    base = Scene.from_dict(yaml.safe_load(BASE))
    assert base.with_value("sample.grains", np.int64(60)).input_data["sample"]["grains"] == 60
    assert base.with_value("material", base.material).material == base.material
    with pytest.raises(DustError, match="sample.grains.*<object"):
        base.with_value("sample.grains", object())
    data = base.input_data | {"stages": np.array([])}
    assert as_scene(data) == as_scene(base.input_data | {"stages": []})


def test_explicit_sample_cylinder_and_walls():
    text = f"{{kind: explicit, {POSITIONS}, spins: [[0 rad/s, 0 rad/s, 1 rad/us], [0 rad/s, "
    sample = scene(sample=text + "0 rad/s, 0 rad/s]]}", **OPEN).sample
    assert sample.positions == ((0, 0, 0), (1.2e-6, 0, 0))
    assert sample.spins[0] == (0, 0, 1e6) and sample.velocities is None
    size = scene(
        sample="{kind: rbd, shape: cylinder, size: {diameter: 13.2 um, height: 20 um}}"
    ).sample.size
    assert (size.diameter, size.height) == (13.2e-6, 20e-6)
    box = scene(boundary="{kind: box, omit: [top, x_min, top]}", stop="{steps: 5}").boundary
    assert box.omit == ("x_min", "top")


@pytest.mark.parametrize("unit, value", [("um", 1e-6), ("nm", 1e-9), ("m", 1.0), ("10 nm", 1e-8)])
def test_units_of_a_sample_file(unit, value):
    assert scene(sample=f"{{kind: explicit, file: a.csv, units: {unit}}}").sample.units == value


def test_sample_file_is_relative_to_the_yaml_file(tmp_path):
    (tmp_path / "grains.csv").write_text("x,y,z\n0,0,0\n")
    file = tmp_path / "a.yaml"
    file.write_text(edit_base("sample", "sample: {kind: explicit, file: grains.csv}"))
    assert load(file).sample.file == tmp_path / "grains.csv"
    assert from_yaml(load(file).to_yaml()) == load(file)


@pytest.mark.parametrize(
    "target", [("", "name"), ("material", "radius"), ("boundary", "wall_speed"), ("stop", "time")]
)
def test_frozen(target):
    block, key = target
    cake = scene()
    path = f"{block}.{key}".lstrip(".")
    with pytest.raises(DustError, match=rf"immutable; scene.with_value\('{path}', ...\)"):
        setattr(getattr(cake, block) if block else cake, key, 1.0)


def test_the_way_to_change_an_entry_of_a_list_is_named():
    text = edit_base("stop", "stages: [{name: wait, stop: {steps: 3}}]")
    staged = from_yaml(text.replace(", wall_speed: 1 cm/s", ""))
    with pytest.raises(DustError, match=r"scene.with_value\('stages.0.name', ...\)"):
        staged.stages[0].name = "rest"
    assert staged.with_value("stages.0.name", "rest").stages[0].name == "rest"


def test_round_trip_of_everything_and_equality():
    full = scene(**FULL)
    repeated_scene = from_yaml(full.to_yaml())
    assert repeated_scene == full
    assert yaml.safe_load(full.to_yaml()) == read(full.to_yaml()).data
    assert scene() == scene()
    assert scene() != scene(sample="{kind: rbd, grains: 101}")
    assert scene() != "cake"


# Sweeps.


@pytest.mark.parametrize(
    "path, value, get",
    [
        ("boundary.wall_speed", "5 cm/s", lambda s: s.boundary.wall_speed == 0.05),
        ("interaction.rolling.modifier", 8, lambda s: s.interaction.rolling.modifier == 8.0),
        ("interaction.rolling", "off", lambda s: s.interaction.rolling is None),
        ("interaction.damping.kappa", "2e-6 g/s", None),
        ("material.surface_energy", "25 mJ/m^2", lambda s: s.material.surface_energy == 0.025),
        ("material.surface_energy", "25 mJ/m^2", lambda s: s.material.radius == 0.6e-6),
        ("material", "ice_t19", lambda s: s.material.radius == 1e-7),
        ("numerics.threads", 2, lambda s: s.numerics.threads == 2),
        ("sample.seed", 7, lambda s: s.sample.seed == 7),
        ("name", "other", lambda s: s.output.directory == Path("runs/other")),
        ("boundary.size", ["40 um"] * 3, lambda s: s.boundary.size == (40e-6,) * 3),
    ],
)
def test_with_value(path, value, get):
    first_scene = scene()
    if get is None:
        first_scene = scene(interaction="{damping: viscous}")
        get = lambda s: s.interaction.damping.kappa == 2e-9  # noqa: E731
    text = first_scene.to_yaml()
    assert get(first_scene.with_value(path, value))
    assert first_scene.to_yaml() == text


def test_with_value_twice_in_lists_and_dependent_defaults():
    box = scene().with_value("boundary.size", ["40 um"] * 3).with_value("boundary.size.2", "50 um")
    assert box.boundary.size == (40e-6, 40e-6, 50e-6)
    still = scene(stop="{steps: 10}").with_value("boundary.wall_speed", "0 m/s")
    assert still.output.series.steps == 1000 and still.output.profiles is None


@pytest.mark.parametrize(
    "path, value, words",
    [
        ("boundary.wall_speed", 5, ["boundary.wall_speed = 5", "no unit", '"1 cm/s"']),
        ("boundary.speed", "5 m/s", ["boundary.speed", "unknown key", "wall_speed"]),
        ("boundary.kind.x", 1, ["boundary.kind = 'box' has no keys below it"]),
    ],
)
def test_with_value_refuses_as_the_file_does(path, value, words):
    with pytest.raises(DustError) as error:
        scene().with_value(path, value)
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize(
    "blocks, words",
    [
        (
            {"boundary": "{kind: open}"},
            ["stop.filling_factor = 0.55", "without all six walls", "kind: box"],
        ),
        ({"boundary": "{kind: box}"}, ["stop.filling_factor", "while the top wall is stationary"]),
        (
            {"boundary": "{kind: box, omit: [x_min], wall_speed: 1 m/s}"},
            ["stop.filling_factor", "without all six walls"],
        ),
        ({**OPEN, "stop": "{pressure: 1 kPa, steps: 5}"}, ["stop.pressure", "the top wall"]),
        (
            {"boundary": "{kind: box, omit: [top]}", "stop": "{pressure: 1 kPa, steps: 5}"},
            ["stop.pressure", "the top wall, and there is none"],
        ),
        (
            {"boundary": "{kind: box}", "stop": "{pressure: 1 kPa}"},
            ["stop.pressure", "wall is stationary", "add a time or steps"],
        ),
        (
            {
                "boundary": "{kind: box, omit: [bottom], wall_speed: 1 m/s}",
                "stop": "{pressure: 1 kPa}",
            },
            ["stop.pressure", "without a bottom wall"],
        ),
        (
            {**OPEN, "output": "{profiles: {filling_factor: 0.1}}"},
            ["output.profiles.filling_factor = 0.1", "use strain, steps or time"],
        ),
        (
            {"numerics": "{time_step: 1 ns}", "output": "{series: {time: 0.1 ns}}"},
            ['output.series.time = "0.1 ns"', "shorter than numerics.time_step"],
        ),
        (
            {
                "sample": "{kind: rbd, size: [40 um, 40 um, 40 um]}",
                "boundary": "{kind: box, wall_speed: 1 m/s, size: [40 um, 40 um, 39 um]}",
            },
            ["boundary.size", "the sample does not fit"],
        ),
        (
            {
                "sample": f"{{kind: explicit, {POSITIONS}}}",
                "boundary": "{kind: box, wall_speed: 1 m/s, size: [2 um, 9 um, 9 um]}",
            },
            ["boundary.size", "the sample does not fit"],
        ),
        # far outside of what can be computed
        ({"boundary": "{kind: box, wall_speed: 1e-300 m/s}"}, ["boundary.wall_speed", "1e-20 m/s"]),
        ({"boundary": "{kind: box, wall_speed: 1e200 m/s}"}, ["boundary.wall_speed", "3e+08 m/s"]),
        ({"boundary": "{kind: box, side_walls: 1e300}"}, ["boundary.side_walls", "1e+12 can"]),
        ({"boundary": "{kind: plates, glue: 1e300}"}, ["boundary.glue", "1e+12 can"]),
        ({"sample": "{kind: pair, gap: 1e200 m}"}, ["sample.gap", "1e+07 m can"]),
        ({"sample": "{kind: pair, gap: 1e9999999 um}"}, ["sample.gap", "not a finite number"]),
        ({"stop": "{steps: 1e18}"}, ["stop.steps", "1e+15 can"]),
        # what would hold a pressure or a stress
        ({"boundary": "{kind: plates, shear_rate: 1 s^-1}"}, ["boundary.shear_rate", "unknown"]),
        (
            {"boundary": "{kind: box, omit: [top], pressure: 5 kPa}"},
            ["boundary.pressure", "nothing that it could move"],
        ),
        (
            {"boundary": "{kind: periodic, stress: [free, free, free]}"},
            ["boundary.stress", "it sets the scale"],
        ),
        (
            {"boundary": "{kind: periodic, axes: [x, y], shear_rate: 1 s^-1}"},
            ["boundary.shear_rate", "no cell that it"],
        ),
        ({"boundary": "{kind: periodic, gain: 0.3}"}, ["boundary.gain", "neither is given"]),
        (
            {"boundary": "{kind: periodic, pressure: 1 kPa, stress: -1 kPa}"},
            ["boundary.", "not allowed together with stress"],
        ),
        (
            {"boundary": "{kind: box, pressure: 1 kPa, shear_speed: 1 m/s, gain: 0}"},
            ["boundary.gain", "above 0"],
        ),
    ],
)
def test_blocks_that_do_not_go_together(blocks, words):
    with pytest.raises(DustError) as error:
        scene(**blocks)
    assert all(word in str(error.value) for word in [*words, "(line "])


def test_all_problems_at_once_in_the_order_of_the_file():
    text = edit_base("boundary", "boundary:\n  kind: box\n  wall_speed: 1 cm\n  sides: 5")
    text = text.replace("grains: 100", "grains: -1")
    with pytest.raises(DustError) as error:
        from_yaml(text, title="a.yaml")
    lines = str(error.value).splitlines()
    assert lines[1].lstrip().startswith("sample.grains = -1") and lines[1].endswith("(line 4)")
    assert lines[2] == (
        '  boundary.wall_speed = "1 cm": a speed of at least 0 is needed, for example "1 cm/s"'
        "  (line 7)"
    )
    assert lines[3].lstrip().startswith("boundary.sides = 5") and lines[3].endswith("(line 8)")
    assert len(lines) == 4


@pytest.mark.parametrize("block", ["name", "material", "sample", "boundary", "stop"])
def test_missing_block(block):
    text = edit_base(block, "# left out")
    with pytest.raises(DustError, match=f"  {block}: it is missing"):
        from_yaml(text)


DUST = """
name: falling
method: continuum
material: dust_g09
sample: {kind: block, size: [1 mm, 1 mm]}
numerics: {spacing: 0.1 mm}
stop: {steps: 1}
"""
GRAINS = text_of(**OPEN)


def acceleration(scene, gravity):
    return from_yaml(f"{scene}\ngravity: {gravity}\n").gravity.acceleration


@pytest.mark.parametrize("scene", [GRAINS, DUST], ids=["grains", "continuum"])
def test_one_number_is_downwards_and_a_list_goes_anywhere(scene):
    assert acceleration(scene, "9.81 m/s^2") == (0.0, 0.0, -9.81)
    assert acceleration(scene, "0 m/s^2") == (0.0, 0.0, 0.0)
    for written in ("{}", "{{acceleration: {}}}"):
        slant = written.format("[1 m/s^2, 0 m/s^2, -2 m/s^2]")
        assert acceleration(scene, slant) == (1.0, 0.0, -2.0)


def test_plane_strain_has_x_and_z():
    assert acceleration(DUST, "[1 m/s^2, -2 m/s^2]") == (1.0, 0.0, -2.0)
    repeated_scene = from_yaml(from_yaml(f"{DUST}gravity: [1 m/s^2, -2 m/s^2]").to_yaml())
    assert repeated_scene.gravity.acceleration == (1.0, 0.0, -2.0)


@pytest.mark.parametrize(
    "scene, gravity, message",
    [
        (GRAINS, "-9.81 m/s^2", ["of at least 0 (downwards)", "acceleration: [0 m/s^2"]),
        (GRAINS, "9.81", ["gravity = 9.81", '"9.81 m/s^2"']),
        (GRAINS, "[1 m/s^2, 2 m/s^2]", ["gravity", "a list of 3 accelerations"]),
        (GRAINS, "{}", ["exactly one of acceleration and central"]),
        (GRAINS, "1e300 m/s^2", ["cannot be computed with", "1e+15 m/s^2 can"]),
        (GRAINS, "[0 m/s^2, 0 m/s^2, -1e16 m/s^2]", ["computed with", "1e+15 m/s^2 can"]),
        (GRAINS, "1e-30 m/s^2", ["cannot be computed with", "1e+15 m/s^2 can"]),
        (DUST, "up", ['gravity = "up"', '"9.81 m/s^2"']),
        (DUST, "[0 m/s^2, 1 m/s^2, 0 m/s^2]", ["gravity.acceleration[1]", "no y in plane strain"]),
        (DUST, "{central: {mass: 1 kg}}", ["gravity.central", "method: grains only"]),
        (
            f"{DUST}boundary: {{kind: faces, periodic: [x]}}",
            "[1 m/s^2, -2 m/s^2]",
            ["gravity.acceleration[0]", "the cell is periodic along x"],
        ),
    ],
)
def test_what_it_is_not(scene, gravity, message):
    with pytest.raises(DustError) as refused:
        from_yaml(f"{scene}\ngravity: {gravity}\n")
    for words in message:
        assert words in str(refused.value), str(refused.value)
