"""What the YAML may say, and what a user is told who says something else."""

import json
from pathlib import Path

import jsonschema
import pytest
import yaml
from pydantic import ValidationError

from dusttaichi.errors import DustError
from dusttaichi.scene import (
    NAMED,
    NoDamping,
    Scaled,
    Scene,
    Viscoelastic,
    Viscous,
    from_yaml,
    json_schema,
    load,
    schema_text,
)
from dusttaichi.scene.yaml_text import read

CONFIGS = Path(__file__).parent.parent / "configs"
FILES = sorted(CONFIGS.rglob("*.yaml"))
IDS = [str(path.relative_to(CONFIGS)) for path in FILES]

BASE = """\
name: cake
material: silicate_s12
interaction: {rolling: on}
sample: {kind: rbd, grains: 100}
boundary: {kind: box, wall_speed: 1 cm/s}
stop: {filling_factor: 0.55}
numerics: {time_step: auto}
output: {snapshots: off}
"""
LINE = {text.split(":")[0]: number for number, text in enumerate(BASE.splitlines(), start=1)}


def edited(block: str, text: str) -> str:
    """BASE with the line of one block replaced."""
    return "".join(
        f"{text}\n" if line.startswith(f"{block}:") else line
        for line in BASE.splitlines(keepends=True)
    )


def scene(**blocks: str) -> Scene:
    text = BASE
    for block, value in blocks.items():
        text = text.replace(BASE.splitlines()[LINE[block] - 1], f"{block}: {value}")
    return from_yaml(text)


OPEN = {"boundary": "{kind: open}", "stop": "{steps: 10}"}
POSITIONS = "positions: [[0 m, 0 m, 0 m], [1.2 um, 0 m, 0 m]]"


# What is accepted.


@pytest.mark.parametrize("path", FILES, ids=IDS)
def test_configs_load_and_round_trip(path):
    loaded = load(path)
    assert loaded.source == path.read_text(encoding="utf-8")
    assert loaded.path == path
    again = from_yaml(loaded.to_yaml())
    assert again == loaded and hash(again) == hash(loaded)
    assert again.to_yaml() == loaded.to_yaml()


@pytest.mark.parametrize("path", FILES, ids=IDS)
def test_configs_name_the_schema_and_satisfy_it(path):
    text = path.read_text(encoding="utf-8")
    prefix, _, relative = text.splitlines()[0].partition("=")
    assert prefix == "# yaml-language-server: $schema"
    schema = json.loads((path.parent / relative).read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(read(text).data)
    jsonschema.Draft202012Validator(schema).validate(yaml.safe_load(text))
    jsonschema.Draft202012Validator(schema).validate(read(load(path).to_yaml()).data)


def test_seizinger_names_are_distinct():
    names = [load(path).name for path in FILES]
    assert len(set(names)) == len(names)


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


def test_default_intervals_follow_the_boundary():
    box = scene().output
    assert box.series.filling_factor == 0.002 and box.profiles.filling_factor == 0.05
    assert box.snapshots is None
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
    [("on", 1.0), ("{}", 1.0), ("true", 1.0), ("{modifier: 8}", 8.0), ("{modifier: 1e-3}", 1e-3),
     ('{modifier: "2.5"}', 2.5), ("off", None), ("false", None), ("null", None)],
)  # fmt: skip
def test_effect_forms(effect, text, modifier):
    value = getattr(scene(interaction=f"{{{effect}: {text}}}").interaction, effect)
    assert (value.modifier if value else None) == modifier


def test_plain_data_as_other_yaml_readers_give_it():
    data = yaml.safe_load(BASE.replace("rolling: on", "rolling: off, sliding: {modifier: 1e-3}"))
    assert data["interaction"] == {"rolling": False, "sliding": {"modifier": "1e-3"}}
    interaction = Scene.from_dict(data).interaction
    assert interaction.rolling is None and interaction.sliding.modifier == 1e-3


def test_walls_are_kept_in_their_order():
    box = scene(boundary="{kind: box, omit: [top, x_min, top]}", stop="{steps: 5}").boundary
    assert box.omit == ("x_min", "top") and not box.closed


def test_explicit_sample():
    text = f"{{kind: explicit, {POSITIONS}, spins: [[0 rad/s, 0 rad/s, 1 rad/us], [0 rad/s, "
    sample = scene(sample=text + "0 rad/s, 0 rad/s]]}", **OPEN).sample
    assert sample.positions == ((0, 0, 0), (1.2e-6, 0, 0))
    assert sample.spins[0] == (0, 0, 1e6) and sample.velocities is None


@pytest.mark.parametrize("unit, value", [("um", 1e-6), ("nm", 1e-9), ("m", 1.0), ("10 nm", 1e-8)])
def test_units_of_a_sample_file(unit, value):
    assert scene(sample=f"{{kind: explicit, file: a.csv, units: {unit}}}").sample.units == value


def test_sample_file_is_relative_to_the_yaml_file(tmp_path):
    (tmp_path / "grains.csv").write_text("x,y,z\n0,0,0\n")
    file = tmp_path / "a.yaml"
    file.write_text(edited("sample", "sample: {kind: explicit, file: grains.csv}"))
    assert load(file).sample.file == tmp_path / "grains.csv"
    assert from_yaml(load(file).to_yaml()) == load(file)


def test_cylinder():
    size = scene(
        sample="{kind: rbd, shape: cylinder, size: {diameter: 13.2 um, height: 20 um}}"
    ).sample.size
    assert (size.diameter, size.height) == (13.2e-6, 20e-6)


@pytest.mark.parametrize(
    "target", [("", "name"), ("material", "radius"), ("boundary", "wall_speed"), ("stop", "time")]
)
def test_frozen(target):
    block, key = target
    cake = scene()
    with pytest.raises(ValidationError, match="frozen"):
        setattr(getattr(cake, block) if block else cake, key, 1.0)


def test_scenes_that_differ_are_not_equal():
    assert scene() == scene()
    assert scene() != scene(sample="{kind: rbd, grains: 101}")
    assert scene() != "cake"


FULL = {
    "material": "{base: ice_t19, name: my ice, radius: 0.123456789012345678 um}",
    "interaction": "{rolling: off, twisting: {modifier: 0.1}, damping: none, "
    "shear_modulus: printed}",
    "sample": f"{{kind: explicit, {POSITIONS}, velocities: [[1 m/s, 0 m/s, 0 m/s], [0 m/s, 0 m/s, "
    "-1e-17 m/s]]}",
    "boundary": "{kind: box, size: [40 um, 40 um, 3.3333333333333335 um], omit: [bottom]}",
    "stop": "{pressure: 1 kPa, time: 0.1 ms, steps: 1e6}",
    "numerics": "{time_step: 0.3 ns, precision: mixed, backend: cuda, threads: 2, skin: 0.1}",
    "output": "{directory: elsewhere, series: {steps: 7}, profiles: {time: 1 us}, snapshots: off, "
    "contacts: false, window: 100, checkpoint: 5 s}",
}


def test_round_trip_of_everything():
    full = scene(**FULL)
    again = from_yaml(full.to_yaml())
    assert again == full
    assert yaml.safe_load(full.to_yaml()) == read(full.to_yaml()).data


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
    before = scene()
    if get is None:
        before = scene(interaction="{damping: viscous}")
        get = lambda s: s.interaction.damping.kappa == 2e-9  # noqa: E731
    text = before.to_yaml()
    assert get(before.with_value(path, value))
    assert before.to_yaml() == text


def test_with_value_twice_and_in_lists():
    box = scene().with_value("boundary.size", ["40 um"] * 3).with_value("boundary.size.2", "50 um")
    assert box.boundary.size == (40e-6, 40e-6, 50e-6)


def test_with_value_keeps_dependent_defaults_in_step():
    still = scene(stop="{steps: 10}").with_value("boundary.wall_speed", "0 m/s")
    assert still.output.series.steps == 1000 and still.output.profiles is None


@pytest.mark.parametrize(
    "path, value, parts",
    [
        ("boundary.wall_speed", 5, ["boundary.wall_speed = 5", "no unit", '"1 cm/s"']),
        ("boundary.speed", "5 m/s", ["boundary.speed", "unknown key", "wall_speed"]),
        ("boundary.kind.x", 1, ["boundary.kind = 'box' has no keys below it"]),
    ],
)
def test_with_value_refuses_as_the_file_does(path, value, parts):
    with pytest.raises(DustError) as error:
        scene().with_value(path, value)
    assert all(part in str(error.value) for part in parts)


# What is refused: the block's line in BASE, and the parts that the message must have.

REFUSED = [
    ("name: a/b", ['name = "a/b"', "letters, digits"]),
    ("name: 12", ["name = 12", "a text"]),
    ("name: cake\nmaterials: x", ["materials", "unknown key", 'did you mean "material"?']),
    ("name: cake\nname: pie", ["name", "given twice, in lines 1 and 2"]),
    ("material: quartz", ['material = "quartz"', *NAMED]),
    ("material: {base: quartz}", ['material.base = "quartz"', *NAMED]),
    ("material: 5", ["material = 5", *NAMED]),
    ("material: {radius: 1 um}", ["material.density", "it is missing", '"2.65 g/cm^3"']),
    ("material: {base: ice_t19, radius: 0 m}", ['material.radius = "0 m"', "above 0", '"0.6 um"']),
    ("material: {base: ice_t19, radius: 1 m}", ["material.radius", "at most 1 mm"]),
    ("material: {base: ice_t19, radius: 1e-7}", ["material.radius = 1e-07", "it has no unit"]),
    ("material: {base: ice_t19, poisson_ratio: 0.5}", ["poisson_ratio = 0.5", "below 0.5"]),
    ("material: {base: ice_t19, poisson_ratio: .nan}", ["poisson_ratio = NaN", "a number"]),
    ("material: {base: ice_t19, critical_rolling: 1 um}", ["critical_rolling", "smaller than"]),
    ("material: {base: ice_t19, gamma: 1 J/m^2}", ["material.gamma", "allowed: base, name"]),
    ("interaction: {rolling: 8}", ["interaction.rolling = 8", "on, off or a block", "{modifier:"]),
    ("interaction: {rolling: {modifier: 0}}", ["interaction.rolling.modifier = 0", "above 0"]),
    ("interaction: {rolling: {modifier: true}}", ["modifier = true", "a number above 0"]),
    ("interaction: {rolling: {modifier: x}}", ['modifier = "x"', "a number above 0"]),
    ("interaction: {rolling: {m: 1}}", ["interaction.rolling.m = 1", "unknown", "modifier"]),
    ("interaction: {damping: strong}", ['damping = "strong"', "none, viscous, scaled", "{model:"]),
    ("interaction: {damping: on}", ["interaction.damping", "none, viscous, scaled"]),
    ("interaction: {damping: {model: x}}", ['damping.model = "x"', '"viscous", "scaled" or']),
    ("interaction: {damping: {kappa: 1 g/s}}", ["interaction.damping", "model is missing"]),
    (
        "interaction: {damping: {model: viscous, kapa: 1 g/s}}",
        ["interaction.damping.kapa", 'did you mean "kappa"? allowed: model, kappa'],
    ),
    ("interaction: {damping: {model: viscous, kappa: 1 m/s}}", ["kappa", '"1e-6 g/s"']),
    ("interaction: {shear_modulus: x}", ["shear_modulus", '"mindlin" or "printed" is needed']),
    ("interaction:", ["interaction", "nothing is written here"]),
    ("sample: {kind: bam}", ['sample.kind = "bam"', '"explicit" or "rbd" is needed']),
    ("sample: {grains: 5}", ["sample", "kind is missing", '"explicit" or "rbd"']),
    ("sample: [1]", ["sample = [1]", "a block is needed"]),
    ("sample: {kind: rbd}", ["sample", "exactly one of grains and size"]),
    ("sample: {kind: rbd, grains: 0}", ["sample.grains = 0", "a whole number of at least 1"]),
    ("sample: {kind: rbd, grains: 1.5}", ["sample.grains = 1.5", "a whole number"]),
    ("sample: {kind: rbd, grains: .inf}", ["sample.grains = Infinity", "a whole number"]),
    ("sample: {kind: rbd, grains: 9, seed: -1}", ["sample.seed = -1", "at least 0"]),
    ("sample: {kind: rbd, grains: 9, aspect: 0}", ["sample.aspect = 0", "above 0"]),
    ("sample: {kind: rbd, size: [9 um, 9 um]}", ["sample.size", "a list of 3 lengths above 0"]),
    ("sample: {kind: rbd, size: [9 um, 9 um, 9]}", ["sample.size", "it has no unit"]),
    ("sample: {kind: rbd, size: [1 um, 9 um, 9 um]}", ["sample.size", "2 x material.radius"]),
    (
        "sample: {kind: rbd, size: [9 um, 9 um, 9 um], shape: cylinder}",
        ["sample.size", "diameter and height"],
    ),
    ("sample: {kind: rbd, size: {diameter: 9 um}}", ["sample.size.height", "it is missing"]),
    ("sample: {kind: rbd, size: [9 um, 9 um, 9 um], aspect: 2}", ["sample.aspect", "grains"]),
    ("sample: {kind: explicit}", ["sample", "exactly one of positions and file"]),
    ("sample: {kind: explicit, positions: []}", ["sample.positions", "at least one grain"]),
    ("sample: {kind: explicit, positions: 5}", ["sample.positions = 5", "a list is needed"]),
    ("sample: {kind: explicit, positions: [[0, 0, 0]]}", ["positions[0]", "it has no unit"]),
    (
        f"sample: {{kind: explicit, {POSITIONS}, velocities: [[1 m/s, 0 m/s, 0 m/s]]}}",
        ["sample.velocities", "2 and not 1"],
    ),
    (
        "sample: {kind: explicit, file: x.csv, spins: [[0 rad/s, 0 rad/s, 0 rad/s]]}",
        ["sample.spins", "only together with positions"],
    ),
    (f"sample: {{kind: explicit, {POSITIONS}, units: nm}}", ["sample.units", "with file"]),
    ("boundary: {kind: periodic}", ['boundary.kind = "periodic"', '"open" or "box" is needed']),
    ("boundary: box", ['boundary = "box"', "a block is needed", "kind"]),
    ("boundary: {kind: box, wall_speed: 1 cm}", ['wall_speed = "1 cm"', "a speed", '"1 cm/s"']),
    ("boundary: {kind: box, wall_speed: 1}", ["boundary.wall_speed = 1", "no unit", '"1 cm/s"']),
    ("boundary: {kind: box, wall_speed: nan m/s}", ["boundary.wall_speed", "not a finite"]),
    ("boundary: {kind: box, wall_speed: -1 m/s}", ["boundary.wall_speed", "at least 0"]),
    ("boundary: {kind: box, wall_sped: 1 m/s}", ["wall_sped", 'did you mean "wall_speed"?']),
    ("boundary: {kind: box, radius: 1 um}", ["boundary.radius", "did you mean material.radius?"]),
    ("boundary: {kind: open, wall_speed: 1 m/s}", ["boundary.wall_speed", "unknown key"]),
    ("boundary: {kind: box, side_walls: -1}", ["boundary.side_walls = -1", "at least 0"]),
    ("boundary: {kind: box, omit: [up]}", ['boundary.omit[0] = "up"', '"bottom" or "top"']),
    ("boundary: {kind: box, omit: top}", ['boundary.omit = "top"', "a list is needed"]),
    (
        "boundary: {kind: box, omit: [x_min, x_max, y_min, y_max, bottom, top]}",
        ["boundary.omit", "kind: open"],
    ),
    (
        "boundary: {kind: box, omit: [top], wall_speed: 1 cm/s}",
        ['boundary.wall_speed = "1 cm/s"', "the top wall is left out"],
    ),
    ("boundary: {kind: box, size: tight}", ['boundary.size = "tight"', '"fit" or a list']),
    (
        "boundary: {kind: box, wall_speed: 1 m/s, size: [4 um, 4 um, 4 um]}",
        ["boundary.size", "100 grains would fill 1.41"],
    ),
    ("stop: {}", ["stop", "at least one of filling_factor, pressure, time and steps"]),
    ("stop: 5", ["stop = 5", "a block is needed, with keys from filling_factor"]),
    ("stop: {filling_factor: 0.8}", ["stop.filling_factor = 0.8", "at most 0.74"]),
    ("stop: {filling_factor: 0}", ["stop.filling_factor = 0", "above 0"]),
    ("stop: {pressure: 5 N}", ['stop.pressure = "5 N"', "a pressure above 0", '"120 kPa"']),
    ("stop: {time: 0 s}", ['stop.time = "0 s"', "a time above 0"]),
    ("stop: {steps: 1 s}", ['stop.steps = "1 s"', "a whole number"]),
    ("numerics: {time_step: 1}", ["numerics.time_step = 1", '"auto" or a time', '"0.3 ns"']),
    ("numerics: {step_fraction: 0.5}", ["step_fraction = 0.5", "at most 0.31"]),
    ("numerics: {precision: f32}", ["numerics.precision", '"f64" or "mixed" is needed']),
    ("numerics: {backend: tpu}", ["numerics.backend", '"cpu" or "cuda" is needed']),
    ("numerics: {threads: 0}", ["numerics.threads = 0", '"auto" or a whole number']),
    ("numerics: {skin: -1}", ["numerics.skin = -1", '"auto" or a number above 0']),
    ("output: {directory: 5}", ["output.directory = 5", "a path is needed"]),
    ("output: {series: 100}", ["output.series = 100", "off or a block", "{steps: 1000}"]),
    ("output: {series: on}", ["output.series", "off or a block", "{steps: 1000}"]),
    ("output: {series: {}}", ["output.series", "exactly one of steps, time and filling_factor"]),
    ("output: {series: {steps: 1, time: 1 s}}", ["output.series", "exactly one of"]),
    ("output: {contacts: 5}", ["output.contacts = 5", "true or false"]),
    ("output: {window: all}", ['output.window = "all"', '"interval" or a whole number']),
    ("output: {checkpoint: 60}", ["output.checkpoint = 60", "no unit", '"60 s"']),
]


@pytest.mark.parametrize("text, parts", REFUSED, ids=[text for text, _ in REFUSED])
def test_refused_with_path_value_allowed_and_line(text, parts):
    block = text.split(":")[0]
    with pytest.raises(DustError) as error:
        from_yaml(edited(block, text), title="a.yaml")
    message = str(error.value)
    assert message.startswith("a.yaml cannot be used:\n  ")
    for part in parts:
        assert part in message
    first = message.splitlines()[1]
    assert first.endswith((f"(line {LINE[block]})", f"(line {LINE[block] + 1})"))


@pytest.mark.parametrize(
    "blocks, parts",
    [
        (
            {"boundary": "{kind: open}"},
            ["stop.filling_factor = 0.55", "without all six walls", "kind: box"],
        ),
        ({"boundary": "{kind: box}"}, ["stop.filling_factor", "while the top wall rests"]),
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
            ["stop.pressure", "wall rests", "add a time or steps"],
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
            ["output.profiles.filling_factor = 0.1", "use steps or time"],
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
    ],
)
def test_blocks_that_do_not_go_together(blocks, parts):
    with pytest.raises(DustError) as error:
        scene(**blocks)
    assert all(part in str(error.value) for part in parts)


def test_all_problems_at_once_in_the_order_of_the_file():
    text = edited("boundary", "boundary:\n  kind: box\n  wall_speed: 1 cm\n  sides: 5")
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
    text = BASE.replace(BASE.splitlines()[LINE[block] - 1] + "\n", "")
    with pytest.raises(DustError, match=f"  {block}: it is missing"):
        from_yaml(text)


# Files.


@pytest.mark.parametrize(
    "content, parts",
    [
        (b"", ["is empty", "name, material, sample, boundary and stop are needed"]),
        (b"# nothing\n", ["is empty"]),
        (b"- a\n- b\n", ["does not hold a scene"]),
        (b"hello", ["does not hold a scene"]),
        (b"a: [1, 2\n", ["is not valid YAML", "(line 2, column 1)"]),
        (b"a: 1\n\tb: 2\n", ["is not valid YAML", "(line 2"]),
        (b"a: 1\n---\nb: 1\n", ["is not valid YAML", "another document"]),
        (b"a: !!python/object:os.system x\n", ["is not valid YAML", "(line 1"]),
        (b"a: &b [*b]\n", ["is not valid YAML", "anchor"]),
        (b"a: \x01\n", ["is not valid YAML"]),
        (b"[1]: 2\n", ["is not valid YAML", "a key must be a word"]),
        (b"\xff\xfe\x00\x80", ["is not a text file in UTF-8"]),
    ],
)
def test_files_that_are_not_a_scene(tmp_path, content, parts):
    file = tmp_path / "a.yaml"
    file.write_bytes(content)
    with pytest.raises(DustError) as error:
        load(file)
    message = str(error.value)
    assert message.startswith(str(file)) and "\n" not in message
    assert all(part in message for part in parts)


def test_file_missing_or_a_directory(tmp_path):
    with pytest.raises(DustError, match=r"a\.yaml: there is no such file"):
        load(tmp_path / "a.yaml")
    with pytest.raises(DustError, match="is a directory; a YAML file is needed"):
        load(tmp_path)


def test_file_that_may_not_be_read(tmp_path, monkeypatch):
    # The test may run as root, who may read everything.
    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_text", refuse)
    with pytest.raises(DustError, match="cannot be read: permission denied"):
        load(tmp_path / "a.yaml")


def test_missing_sample_file(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text(edited("sample", "sample: {kind: explicit, file: none.csv}"))
    with pytest.raises(DustError) as error:
        load(file)
    assert 'sample.file = "none.csv": there is no such file' in str(error.value)
    assert "(line 4)" in str(error.value)


# The JSON Schema.


def test_schema_file_is_in_step():
    assert (CONFIGS / "scene.schema.json").read_text(encoding="utf-8") == schema_text()


def test_schema_is_valid_and_names_its_draft():
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"


def test_schema_describes_every_key_and_gives_an_example_of_every_quantity():
    for block in [json_schema(), *json_schema()["$defs"].values()]:
        for name, field in block.get("properties", {}).items():
            assert "description" in field or name in ("kind", "model"), name
            if "pattern" in field and name != "name":
                assert field["examples"], name


SHORTHANDS = [
    {},
    *({"material": name} for name in NAMED),
    {"material": "{base: ice_t19, radius: 1 µm}"},
    *({"interaction": f"{{damping: {word}}}"} for word in ("none", "null", "viscous", "scaled")),
    *({"interaction": f"{{rolling: {word}}}"} for word in ("on", "off", "true", "{}")),
    {"sample": "{kind: rbd, shape: cylinder, size: {diameter: 13.2 um, height: 20 um}}"},
    {"sample": "{kind: explicit, file: a.csv, units: um}"},
    FULL,
]


@pytest.mark.parametrize("blocks", SHORTHANDS, ids=str)
@pytest.mark.parametrize("reader", [lambda text: read(text).data, yaml.safe_load])
def test_schema_accepts_what_loads(blocks, reader):
    text = BASE
    for block, value in blocks.items():
        text = text.replace(BASE.splitlines()[LINE[block] - 1], f"{block}: {value}")
    from_yaml(text)
    if reader is yaml.safe_load:  # its YAML 1.1 reads 1e6 as a text, which an editor would not
        text = text.replace("1e6}", "1000000}")
    jsonschema.Draft202012Validator(json_schema()).validate(reader(text))


# What a schema cannot say: it sees no other block and no unit's dimension.
BY_SCHEMA = [
    "material: quartz", "material: {base: quartz}", "material: {radius: 1 um}",
    "material: {base: ice_t19, poisson_ratio: 0.5}", "material: {base: ice_t19, radius: 1e-7}",
    "material: {base: ice_t19, gamma: 1 J/m^2}", "interaction: {rolling: 8}",
    "interaction: {rolling: {modifier: 0}}", "interaction: {damping: strong}",
    "interaction: {damping: {model: viscous, kapa: 1 g/s}}", "interaction: {shear_modulus: x}",
    "sample: {kind: bam}", "sample: {kind: rbd, grains: 0}",
    "sample: {kind: rbd, size: [9 um, 9 um]}", "boundary: {kind: periodic}",
    "boundary: {kind: box, wall_speed: 1}", "boundary: {kind: box, wall_sped: 1 m/s}",
    "boundary: {kind: box, omit: [up]}", "boundary: {kind: open, wall_speed: 1 m/s}",
    "stop: {filling_factor: 0.8}", "numerics: {time_step: 1}", "numerics: {precision: f32}",
    "output: {series: 100}", "output: {window: all}", "name: a/b", "name: cake\nmaterials: x",
]  # fmt: skip


@pytest.mark.parametrize("text", BY_SCHEMA)
def test_schema_refuses(text):
    data = read(edited(text.split(":")[0], text)).data
    assert not jsonschema.Draft202012Validator(json_schema()).is_valid(data)
