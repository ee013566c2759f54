"""What a user is told whose YAML file says something that it may not."""

from pathlib import Path

import pytest
from scenes import BASE, LINE, OPEN, POSITIONS, edit_base, scene

from dusttaichi.errors import DustError
from dusttaichi.samples import make as make_sample
from dusttaichi.scene import NAMED, from_yaml, load
from dusttaichi.scene.keys import list_keys

# What is refused: the block's line in BASE, and the parts that the message must have.

REFUSED = [
    ("name: a/b", ['name = "a/b"', "letters, digits"]),
    ("name: 12", ["name = 12", 'YAML reads a number; put it in quotes, "12"; a text']),
    ("name: 20261127", ["name = 20261127", 'put it in quotes, "20261127"']),
    ("name: 1.10", ["name = 1.10", 'put it in quotes, "1.10"']),
    ("name: 007", ["name = 007", 'put it in quotes, "007"']),
    ("name: 1e3", ["name = 1e3", 'put it in quotes, "1e3"']),
    ("name: True", ["name = True", 'YAML reads true or false; put it in quotes, "True"']),
    ("name: ~", ["name = ~", 'YAML reads nothing; put it in quotes, "~"']),
    ("output: {directory: 2026}", ["output.directory = 2026", 'in quotes, "2026"; a path is']),
    ("material: {base: ice_t19, name: 1.0}", ["material.name = 1.0", 'in quotes, "1.0"; a text']),
    ("name: cake\nmateriel: x", ["materiel", "unknown key", 'did you mean "material"?']),
    ("name: cake\nmaterials: x", ['materials = "x"', "a block is needed"]),
    ("name: cake\nmaterials: {ice: quartz}", ['materials.ice = "quartz"', *NAMED]),
    ("name: cake\nmaterials: {default: ice_t19}", ["materials", "cannot name a material"]),
    ("interaction: {mixing: mean}", ['interaction.mixing = "mean"', '"geometric"']),
    ("name: cake\nname: pie", ["name", "given twice, in lines 1 and 2"]),
    ("material: quartz", ['material = "quartz"', *NAMED]),
    ("material: {base: quartz}", ['material.base = "quartz"', *NAMED]),
    ("material: 5", ["material = 5", *NAMED]),
    ("material: {ice_t19: 1}", ["material: one material is needed", "materials:", "shares:"]),
    ("material: {radius: 1 um}", ["material.density", "it is missing", '"2.65 g/cm^3"']),
    ("material: {base: ice_t19, radius: 0 m}", ['material.radius = "0 m"', "above 0", '"0.6 um"']),
    ("material: {base: ice_t19, radius: 1 m}", ["material.radius", "at most 1 mm"]),
    ("material: {base: ice_t19, radius: 1e-7}", ["material.radius = 1e-7", "it has no unit"]),
    ("material: {base: ice_t19, poisson_ratio: 0.5}", ["poisson_ratio = 0.5", "below 0.5"]),
    ("material: {base: ice_t19, poisson_ratio: .nan}", ["poisson_ratio = .nan", "a number"]),
    ("material: {base: ice_t19, critical_rolling: 1 um}", ["critical_rolling", "smaller than"]),
    (
        "material: {base: ice_t19, gamma: 1 J/m^2}",
        ["material.gamma", 'did you mean "surface_energy"? allowed: base, name'],
    ),
    ("material: {base: ice_t19, diameter: 1 um}", ['did you mean "radius", half of it?']),
    ("material: {base: ice_t19, heat_capacity: 1}", ["it belongs to method: continuum; allowed"]),
    ("material: dust_g09", ['"dust_g09" belongs to method: continuum; silicate_s12', *NAMED]),
    ("material: {base: dust_g09}", ['base = "dust_g09": "dust_g09" belongs to method: continuum']),
    ("name: cake\ndimension: 2", ["dimension = 2", "it belongs to method: continuum; allowed"]),
    ("sample: {kind: sphere}", ['"sphere" belongs to method: continuum; "bcca"']),
    ("boundary: {kind: faces}", ['"faces" belongs to method: continuum; "open"']),
    ("numerics: {spacing: 1 mm}", ["numerics.spacing", "it belongs to method: continuum; allowed"]),
    ("output: {phi_1: 1}", ["it belongs to method: continuum (material.compressive.phi_1)"]),
    ("output: {gravity: 1}", ["output.gravity", "it belongs at the top level of the file"]),
    ("boundary: {kind: open, omit: [top]}", ["omit", "unknown key; it belongs to kind: box; "]),
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
    ("stop: {time: 1,5 ns}", ["stop.time", "write a decimal point: 1.5 ns in place of 1,5 ns"]),
    ("numerics: {skin: 0,05}", ["numerics.skin", "0.05 in place of 0,05"]),
    ('stop: {time: "1,5 ns"}', ["stop.time", "write a decimal point in place of the comma"]),
    (
        "sample: {kind: bam}",
        ['sample.kind = "bam"', '"explicit"', '"rbd" or "space_filling" is needed'],
    ),
    ("sample: {grains: 5}", ["sample", "kind is missing", '"explicit"', 'or "space_filling" is']),
    ("sample: [1]", ["sample = [1]", "a block is needed"]),
    ("sample: {kind: rbd}", ["sample", "exactly one of grains and size"]),
    ("sample: {kind: rbd, grains: 0}", ["sample.grains = 0", "a whole number of at least 1"]),
    ("sample: {kind: rbd, grains: 1.5}", ["sample.grains = 1.5", "a whole number"]),
    ("sample: {kind: rbd, grains: .inf}", ["sample.grains = .inf", "a whole number"]),
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
    (
        "sample: {kind: explicit, positions: 5}",
        ["sample.positions = 5", "a list is needed, in [ ] or with a dash"],
    ),
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
    ("boundary: {kind: plate}", ['did you mean "plates"?']),
    (
        "boundary: {kind: torus}",
        ['boundary.kind = "torus"', '"plates", "tube" or "periodic" is needed'],
    ),
    ("boundary: box", ['boundary = "box"', "a block is needed, for example {kind: box}"]),
    ("boundary: {kind: box, wall_speed: 1 cm}", ['wall_speed = "1 cm"', "a speed", '"1 cm/s"']),
    ("boundary: {kind: box, wall_speed: 1}", ["boundary.wall_speed = 1", "no unit", '"1 cm/s"']),
    ("boundary: {kind: box, wall_speed: nan m/s}", ["boundary.wall_speed", "not a finite"]),
    ("boundary: {kind: box, wall_speed: -1 m/s}", ["boundary.wall_speed", "at least 0"]),
    ("boundary: {kind: box, wall_sped: 1 m/s}", ["wall_sped", 'did you mean "wall_speed"?']),
    ("boundary: {kind: box, radius: 1 um}", ["boundary.radius", "it belongs to kind: tube"]),
    ("boundary: {kind: box, density: 1}", ["boundary.density", "did you mean material.density?"]),
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
    (
        "stop: {}",
        [
            "stop",
            "at least one of filling_factor, pressure, stress, surfaces, rest, plateau, creep",
        ],
    ),
    ("stop: 5", ["stop = 5", "a block is needed, with keys from filling_factor"]),
    ("stop: {filling_factor: 0.8}", ["stop.filling_factor = 0.8", "at most 0.74"]),
    ("stop: {filling_factor: 0}", ["stop.filling_factor = 0", "above 0"]),
    ("stop: {pressure: 5 N}", ['stop.pressure = "5 N"', "a pressure above 0", '"120 kPa"']),
    ("stop: {time: 0 s}", ['stop.time = "0 s"', "a time above 0"]),
    ("stop: {steps: 1 s}", ['stop.steps = "1 s"', "a whole number"]),
    ("stop: {pressure: {}}", ["stop.pressure", "above, below or both"]),
    ("stop: {pressure: {under: 1 kPa}}", ["stop.pressure.under", "unknown key", "below"]),
    ("stop: {pressure: {below: 1}}", ["stop.pressure.below", "it has no unit"]),
    ("stop: {pressure: -1 kPa}", ["stop.pressure", "a pressure above 0"]),
    ("stop: {rest: 1e-6}", ["stop.rest", "add a time or steps"]),
    (
        "stop: {stress: {zz: {below: -1 kPa}}, time: 1 us}",
        ["stop.stress", "output.stress: true"],
    ),
    ("numerics: {time_step: 1}", ["numerics.time_step = 1", '"auto" or a time', '"0.3 ns"']),
    ("numerics: {step_fraction: 0.5}", ["step_fraction = 0.5", "at most 0.31"]),
    ("numerics: {precision: f16}", ["numerics.precision", '"f64", "mixed" or "f32" is needed']),
    ("numerics: {accuracy: best}", ["numerics.accuracy", '"fast", "balanced" or "reference"']),
    ("numerics: {newton_steps: 4}", ["newton_steps = 4", "at least 0 and at most 3"]),
    ("numerics: {mass_scaling: 0.5}", ["mass_scaling = 0.5", "at least 1"]),
    ("numerics: {ledger_tolerance: 0}", ["ledger_tolerance = 0", "above 0"]),
    ("numerics: {backend: tpu}", ["numerics.backend", '"cpu" or "cuda" is needed']),
    ("numerics: {backend: gpu}", ['did you mean "cuda"? "cpu" or "cuda" is needed']),
    ("numerics: {backend: GPU}", ['did you mean "cuda"? "cpu" or "cuda" is needed']),
    ("numerics: {backend: CUDA}", ['did you mean "cuda"?']),
    ("numerics: {backend: nvidia}", ['did you mean "cuda"?']),
    ("numerics: {precision: double}", ['did you mean "f64"?']),
    ("numerics: {dt: 1 ns}", ["numerics.dt", 'did you mean "time_step"?']),
    ("numerics: {threads: 0}", ["numerics.threads = 0", '"auto" or a whole number']),
    ("numerics: {skin: -1}", ["numerics.skin = -1", '"auto" or a number above 0']),
    ("output: {directory: 5}", ["output.directory = 5", "a path is needed"]),
    ("output: {series: 100}", ["output.series = 100", "off or a block", "{steps: 1000}"]),
    ("output: {series: on}", ["output.series", "off or a block", "{steps: 1000}"]),
    ("output: {series: {}}", ["output.series", "exactly one of steps, time, filling_factor and"]),
    ("output: {series: {steps: 1, time: 1 s}}", ["output.series", "exactly one of"]),
    ("output: {contacts: 5}", ["output.contacts = 5", "true or false"]),
    ("output: {window: all}", ['output.window = "all"', '"interval" or a whole number']),
    ("output: {checkpoint: 60}", ["output.checkpoint = 60", "no unit", '"60 s"']),
]


@pytest.mark.parametrize("text, words", REFUSED, ids=[text for text, _ in REFUSED])
def test_refused_with_path_value_allowed_and_line(text, words):
    block = text.split(":")[0]
    with pytest.raises(DustError) as error:
        from_yaml(edit_base(block, text), title="a.yaml")
    message = str(error.value)
    assert message.startswith("a.yaml cannot be used:\n  ")
    for word in words:
        assert word in message
    first = message.splitlines()[1]
    assert first.endswith((f"(line {LINE[block]})", f"(line {LINE[block] + 1})"))


# Files.


@pytest.mark.parametrize(
    "content, words",
    [
        (b"", ["is empty", "name, material, sample, boundary and stop (or stages) are needed"]),
        (b"# nothing\n", ["is empty"]),
        (b"- a\n- b\n", ["does not contain a scene"]),
        (b"hello", ["does not contain a scene"]),
        (b"a: [1, 2\n", ["is not valid YAML", "(line 2, column 1)"]),
        (b"a: 1\n\tb: 2\n", ["is not valid YAML", "(line 2"]),
        (b"a: 1\n---\nb: 1\n", ["is not valid YAML", "another document"]),
        (b"a: !!python/object:os.system x\n", ["is not valid YAML", "(line 1"]),
        (b"a: &b [*b]\n", ["is not valid YAML", "anchor refers to itself"]),
        (b"a: !!timestamp xyz\n", ["'xyz' cannot be read as !!timestamp (line 1, column 4)"]),
        (b"a: !!bool maybe\n", ["'maybe' cannot be read as !!bool (line 1, column 4)"]),
        (b"a: !!int 1.5\n", ["'1.5' cannot be read as !!int"]),
        (b"a: !own x\n", ["'x' cannot be read as !own"]),
        (b"a: " + b"1" * 5000 + b"\n", ["is not valid YAML", "4300"]),
        (b"a: " + b"[" * 5000 + b"\n", ["is not valid YAML"]),
        (b"a: \x01\n", ["is not valid YAML"]),
        (b"[1]: 2\n", ["is not valid YAML", "a key must be a word"]),
        ("a: {kind:\u00a0open}\n".encode(), ["U+00A0 (no-break space)", "'kind:\\xa0open'"]),
        ("a:\n\u3000b: 1\n".encode(), ["U+3000 (ideographic space)", "(line 2, column 1)"]),
        (b"a: {<<: 5}\n", ["<< needs a block, or a list of blocks, to merge"]),
        (b"a: &b {<<: *b}\n", ["anchor refers to itself"]),
        (b"a: &b {c: &d {<<: *b}}\n", ["anchor refers to itself"]),
        (b"\xff\xfe\x00\x80", ["is not a text file in UTF-8"]),
    ],
)
def test_files_that_are_not_a_scene(tmp_path, content, words):
    file = tmp_path / "a.yaml"
    file.write_bytes(content)
    with pytest.raises(DustError) as error:
        load(file)
    message = str(error.value)
    assert message.startswith(str(file)) and "\n" not in message
    assert all(word in message for word in words)


def test_a_nest_of_aliases_takes_no_time():
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 30)]
    # without the bound it has no end
    with pytest.raises(DustError, match="its aliases repeat more than 100000 values"):
        from_yaml("\n".join(lines))


def test_aliases_and_merge_keys():
    size = "{kind: box, wall_speed: 1 m/s, size: [&edge 40 um, *edge, *edge]}"
    assert from_yaml(edit_base("boundary", f"boundary: {size}")).boundary.size == (40e-6,) * 3
    # YAML 1.1: what is written beside << comes first, then the blocks in their order
    text = (
        "{kind: collision, target: &t {kind: bcca, grains: 16, seed: 1}, speed: 1 m/s, projectile: "
    )
    for block in ("{<<: *t, seed: 2}", "{seed: 2, <<: [{kind: bcca, grains: 16}, *t]}"):
        sample = from_yaml(edit_base("sample", f"sample: {text}{block}}}")).sample
        projectile = sample.projectile
        assert (projectile.kind, projectile.grains, projectile.seed) == ("bcca", 16, 2)
        assert (sample.target.grains, sample.target.seed) == (16, 1)


def test_a_no_break_space_in_a_value_is_a_space():
    stop = from_yaml(edit_base("stop", "stop: {time: 1\u00a0ns\u00a0}")).stop
    assert stop.time == 1e-9


def test_files_that_are_missing_a_directory_or_may_not_be_read(tmp_path, monkeypatch):
    with pytest.raises(DustError, match=r"a\.yaml: there is no such file"):
        load(tmp_path / "a.yaml")
    with pytest.raises(DustError, match="is a directory; a YAML file is needed"):
        load(tmp_path)
    file = tmp_path / "a.yaml"
    file.write_text(edit_base("sample", "sample: {kind: explicit, file: none.csv}"))
    with pytest.raises(DustError) as error:
        load(file)
    assert 'sample.file = "none.csv": there is no such file' in str(error.value)
    assert "(line 4)" in str(error.value)

    # The test may run as root, who may read everything.
    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    (tmp_path / "a.yaml").write_text("name: a\n")
    monkeypatch.setattr(Path, "read_text", refuse)
    with pytest.raises(DustError, match="cannot be read: permission denied"):
        load(tmp_path / "a.yaml")


@pytest.mark.parametrize(
    "text, word",
    [
        ("zz: a\x00b", "the character U+0000 is not allowed (line 9"),
        ('zz: "a\\0b"', "the character U+0000 is not allowed (line 9"),
        ('zz: "\\ud800"', "the character U+D800 is not allowed (line 9"),
        ("\n".join(f"k{n}: 1" for n in range(500)), "and 470 more"),
    ],
)
def test_texts_that_no_scene_has(text, word):
    with pytest.raises(DustError) as error:
        from_yaml(f"{BASE}{text}\n")
    assert word in str(error.value) and len(str(error.value)) < 10_000


def test_a_chain_that_no_memory_holds():
    with pytest.raises(DustError, match=r"sample.grains: 1e\+12 grains need 1e\+06 GB of memory"):
        make_sample(scene(sample="{kind: chain, grains: 1e12}", **OPEN))


def test_a_key_that_is_known_elsewhere_is_not_sent_where_it_stands():
    """`radii` belongs to some kinds of bodies; one of another kind was told to write it where it
    was written."""
    target = "{kind: rbd, grains: 9, radii: [1 um]}"
    sample = f"{{kind: collision, target: {target}, projectile: {{kind: pair}}, speed: 1 m/s}}"
    with pytest.raises(DustError) as error:
        scene(**OPEN, sample=sample)
    assert "radii" in str(error.value) and "unknown key" in str(error.value)
    assert "did you mean sample.target.radii" not in str(error.value)


CONTINUUM = {
    "name": "a",
    "method": "continuum",
    "dimension": "2",
    "material": "dust_g09",
    "sample": "{kind: block, size: [1 mm, 1 mm]}",
    "boundary": "{kind: open}",
    "numerics": "{spacing: 0.1 mm}",
    "stop": "{time: 1 us}",
}


@pytest.mark.parametrize(
    "key, text, word",
    [
        ("dimension", '"3"', 'dimension = "3": did you mean 3, a plain number? 2 or 3 is needed'),
        ("dimension", "3D", "did you mean 3, a plain number? 2 or 3 is needed"),
        ("dimension", "two", "did you mean 2, a plain number? 2 or 3 is needed"),
        ("dimension", "1", "dimension = 1: 2 or 3 is needed"),
        ("dimension", "2.5", "dimension = 2.5: 2 or 3 is needed"),
        ("dimension", "true", "dimension = true: 2 or 3 is needed"),
        ("dimension", "[2]", "dimension = [2]: 2 or 3 is needed"),
        ("dimension", "plane", 'dimension = "plane": 2 or 3 is needed'),
        ("dim", "2", 'dim = 2: unknown key; did you mean "dimension"?'),
        ("interaction", "{rolling: off}", "interaction: unknown key; it belongs to method: grains"),
        ("numerics", "{spacing: 0.1 mm, accuracy: fast}", "it belongs to method: grains; allowed"),
        ("boundary", "{kind: box}", '"box" belongs to method: grains; "open" or "faces" is'),
        ("sample", "{kind: rbd}", '"rbd" belongs to method: grains; use "block" or "sphere" here'),
        ("sample", "{kind: sphere, radius: 1 mm}", 'did you mean "diameter", twice of it?'),
        ("material", "ice_t19", '"ice_t19" belongs to method: grains; dust_g09'),
        ("material", "{base: ice_t19}", '"ice_t19" belongs to method: grains; one of dust_g09'),
    ],
)
def test_words_of_the_other_method_and_plain_numbers(key, text, word):
    lines = {**CONTINUUM, key: text}
    with pytest.raises(DustError) as error:
        from_yaml("\n".join(f"{name}: {value}" for name, value in lines.items()))
    assert word in str(error.value)


@pytest.mark.parametrize(
    "key, text, path",
    [
        ("drive", "{sphere_speed: [0 m/s, 0 m/s, 1 m/s]}", "stages[0].drive.sphere_speed"),
        ("drive", "{push: [{grains: [0], force: [0 nN, 0 nN, 1 nN]}]}", "stages[0].drive.push"),
        ("output", "{contacts: false}", "output.contacts"),
        ("output", "{forces: off}", "output.forces"),
    ],
)
def test_keys_that_a_method_does_not_read_are_refused(key, text, path):
    """Not one of them in silence; defaults, which a resolved scene writes, are no fault."""
    lines = dict(CONTINUUM)
    if key == "drive":
        lines["stages"] = f"[{{name: b, drive: {text}, stop: {lines.pop('stop')}}}]"
    else:
        lines[key] = text
    with pytest.raises(DustError) as error:
        from_yaml("\n".join(f"{name}: {value}" for name, value in lines.items()))
    (fault,) = str(error.value).splitlines()[1:]
    scene = from_yaml("\n".join(f"{name}: {value}" for name, value in CONTINUUM.items()))
    assert path in fault and type(scene).IGNORED[".".join(path.split(".")[-2:])] in fault
    assert from_yaml(scene.to_yaml()) == scene


def test_the_table_of_keys_names_the_law_of_sizes():
    keys = {row.path: row for row in list_keys()}
    laws = {
        "exponent": ("power",),
        "median": ("lognormal",),
        "sigma": ("lognormal",),
        "smallest": ("power", "lognormal"),
        "radii": ("list",),
    }
    assert {name: keys[f"sample.sizes.{name}"].kinds for name in laws} == laws
    example = keys["sample.sizes"].example
    assert example.startswith("{kind: lognormal, median: 0.6 um, ")
    sample = f"{{kind: rbd, grains: 9, sizes: {example}}}"
    assert scene(sample=sample, **OPEN).sample.sizes.sigma == 0.5
    assert "rbd" in keys["sample.sizes.kind"].kinds


def test_a_kind_of_grains_is_sent_to_those_of_the_continuum():
    text = "name: a\nmethod: continuum\nmaterial: dust_g09\nsample: {kind: collision}\n"
    with pytest.raises(DustError, match='use "impact" or "several" here'):
        from_yaml(text)
