"""The JSON Schema and the table of keys say what the loader does."""

from functools import cache

import jsonschema
import pytest
import yaml
from scenes import BASE, CONFIGS, FULL, edit_base, text_of

from dusttaichi.scene import NAMED, Scene, from_yaml, json_schema, schema_text
from dusttaichi.scene.keys import list_keys
from dusttaichi.scene.yaml_text import read


@cache
def validator():
    return jsonschema.Draft202012Validator(json_schema())


def test_schema_is_in_step_valid_and_describes_every_key():
    assert (CONFIGS / "scene.schema.json").read_text(encoding="utf-8") == schema_text()
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    for block in [json_schema(), *json_schema()["$defs"].values()]:
        for name, field in block.get("properties", {}).items():
            assert "description" in field or name in ("kind", "model"), name
            if "pattern" in field and name != "name":
                assert field["examples"], name
    assert not list(_find_undescribed(json_schema()))


def _find_undescribed(node, location=""):
    """Yield the places of all keys of a schema that say nothing."""
    if isinstance(node, dict):
        for name, field in node.get("properties", {}).items():  # one may be called properties
            if not {"description", "const", "enum"} & set(field):
                yield f"{location}.{name}"
            yield from _find_undescribed(field, f"{location}.{name}")
        for name in node.keys() - {"properties"}:
            yield from _find_undescribed(node[name], f"{location}.{name}")
    elif isinstance(node, list):
        for entry in node:
            yield from _find_undescribed(entry, location)


@pytest.mark.parametrize(
    "text, said",
    [
        ("boundary: {kind: box, wall_sped: 1 m/s}", "'wall_sped' was unexpected"),
        ("boundary: {kind: box, wall_speed: 1}", "1 is not of type 'string'"),
        ("boundary: {kind: torus}", "'torus' is not one of ['box', 'open'"),
        ("sample: {kind: rbd, grains: 0}", "0 is less than the minimum of 1"),
        ("sample: {kind: rbd, sizes: {kind: power}}", "'exponent' is a required property"),
        ("interaction: {rolling: {modifer: 2}}", "'modifer' was unexpected"),
        ("interaction: {damping: {model: viscous, kapa: 1 g/s}}", "'kapa' was unexpected"),
        ("material: {base: ice_t19, gamma: 1 J/m^2}", "'gamma' was unexpected"),
        ("output: {series: {stepps: 3}}", "'stepps' was unexpected"),
    ],
)
def test_an_editor_says_what_is_wrong_inside_of_alternatives(text, said):
    data = read(edit_base(text.split(":")[0], text)).data
    messages = [e.message for e in validator().iter_errors(data)]
    assert any(said in message for message in messages), messages
    assert not any("any of the given schemas" in m for m in messages if "null" not in m), messages


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
    text = text_of(**blocks)
    from_yaml(text)
    if reader is yaml.safe_load:  # its YAML 1.1 reads 1e6 as a text, which an editor would not
        text = text.replace("1e6}", "1000000}")
    validator().validate(reader(text))


# What a schema cannot say: it sees no other block and no unit's dimension.
BY_SCHEMA = [
    "material: quartz", "material: {base: quartz}", "material: {radius: 1 um}",
    "material: {base: ice_t19, poisson_ratio: 0.5}", "material: {base: ice_t19, radius: 1e-7}",
    "material: {base: ice_t19, gamma: 1 J/m^2}", "interaction: {rolling: 8}",
    "interaction: {rolling: {modifier: 0}}", "interaction: {damping: strong}",
    "interaction: {damping: {model: viscous, kapa: 1 g/s}}", "interaction: {shear_modulus: x}",
    "sample: {kind: bam}", "sample: {kind: rbd, grains: 0}",
    "sample: {kind: rbd, size: [9 um, 9 um]}", "boundary: {kind: torus}",
    "boundary: {kind: box, wall_speed: 1}", "boundary: {kind: box, wall_sped: 1 m/s}",
    "boundary: {kind: box, omit: [up]}", "boundary: {kind: open, wall_speed: 1 m/s}",
    "stop: {filling_factor: 0.8}", "numerics: {time_step: 1}", "numerics: {precision: f16}",
    "output: {series: 100}", "output: {window: all}", "name: a/b", "name: cake\nmaterials: x",
]  # fmt: skip


@pytest.mark.parametrize("text", BY_SCHEMA)
def test_schema_refuses(text):
    data = read(edit_base(text.split(":")[0], text)).data
    assert not validator().is_valid(data)


ROWS = list_keys()
DEFAULTS = [key for key in ROWS if key.default and not key.default.startswith("true for")]
PAIR = {"kind": "pair"}
# Blocks of a kind, with what they need.
KINDS = {
    ("sample", "rbd"): {"grains": 9},
    ("sample", "pca"): {"grains": 9},
    ("sample", "bcca"): {"grains": 8},
    ("sample", "random_packing"): {"grains": 9},
    ("sample", "space_filling"): {"grains": 9},
    ("sample", "chain"): {"grains": 9},
    ("sample", "collision"): {"target": PAIR, "projectile": PAIR, "speed": "1 m/s"},
    ("sample", "lattice"): {"structure": "sc", "grains": 9},
    ("sample", "explicit"): {"file": "grains.csv"},
    ("sample", "cutout"): {"of": PAIR, "diameter": "3 um"},
    ("forces", "gravity"): {"central": {"mass": "1 kg"}},
    ("forces", "gas_drag"): {"density": "1 kg/m^3"},
    ("forces", "rotating_frame"): {"angular_velocity": ["0 rad/s", "0 rad/s", "1 rad/s"]},
    ("forces", "electric_field"): {
        "field": ["1 V/m", "0 V/m", "0 V/m"],
        "magnetic_field": ["1 T", "0 T", "0 T"],
        "frequency": "1 s^-1",
    },
    ("surfaces", "plane"): {"point": ["0 m"] * 3, "normal": [0, 0, 1]},
    ("surfaces", "sphere"): {"radius": "90 um"},
    ("surfaces", "cylinder"): {"radius": "90 um"},
}
# Blocks that a scene may do without, with what they need.
MORE = {
    "sphere": {"radius": "6 um", "gap": "1 nm"},
    "gravity": {"central": {"mass": "1 kg"}},
    "charge": {"mean": "1e-17 C"},
    "collisions": {"speed": ["1 m/s"], "impact_parameter": {"rings": 2}},
}
STAGES = {"stages": [{"name": "a", "stop": {"steps": 1}}], "stop": None}


def scene_with(key, kind):
    """A scene in which the key has its place."""
    data = read(BASE).data | {"stop": {"steps": 10}}
    block, *below = key.path.split(".")
    if block == "stages" and below:
        data |= STAGES | {"boundary": {"kind": "box"}}
    elif kind and block == "interaction":
        data["interaction"] = {"damping": kind}
    elif block == "forces" and below:
        kind = kind or "gravity"
        data["boundary"] = {"kind": "open"}
        data["charge"] = "1e-17 C"
        own = dict(KINDS["forces", kind])
        if below[-1] in ("field", "magnetic_field"):
            del own[below[-1]]
        data["forces"] = [{"kind": kind, **own}]
    elif block == "surfaces" and below:
        kind = kind or "cylinder"
        data["boundary"] = {"kind": "open"}
        data["surfaces"] = [{"kind": kind, **KINDS["surfaces", kind]}]
    elif kind:
        data[block] = {"kind": kind, **KINDS.get((block, kind), {})}
    elif below[:1] == ["asperities"] and below[1:]:
        data |= {"material": "silica_pd08", "interaction": {"asperities": "on"}}
    elif below == ["name"]:
        data["material"] = {**from_yaml(BASE).model_dump(mode="json")["material"]}
        del data["material"]["name"], data["material"]["asperity_volume"]
    elif block in MORE and below:
        data[block] = MORE[block]
        if block == "collisions":
            body = {"kind": "collision", **KINDS["sample", "collision"]}
            data |= {"sample": body, "boundary": {"kind": "open"}, "stop": {"time": "1 us"}}
    data["output"] = {}
    data = {name: value for name, value in data.items() if value is not None}
    return Scene.from_dict(data)


def test_every_key_of_the_schema_is_there_once_with_its_meaning():
    schema = json_schema()
    both = [*ROWS, *list_keys("continuum")]
    named = {name for key in both for name in key.path.split(".")}
    for block in [schema, *schema["$defs"].values()]:
        assert set(block.get("properties", {})) <= named
    for key in both:
        assert key.meaning and key.allowed, key.path
        assert not (key.required and key.default), key.path
    single = [(key.path, kind) for key in ROWS for kind in key.kinds or ("",)]
    assert len(single) == len(set(single))


@pytest.mark.parametrize("key", DEFAULTS, ids=lambda key: f"{key.path} {key.kinds}")
def test_default_is_what_the_table_says(key):
    value = read("value: " + key.default.replace("<name>", "cake")).data["value"]
    for kind in key.kinds or ("",):
        scene = scene_with(key, kind)
        path = key.path.replace("stages.", "stages.0.").replace("forces.", "forces.0.")
        path = path.replace("surfaces.", "surfaces.0.")
        assert scene.with_value(path, value) == scene


def test_what_is_allowed_of_which_kinds():
    keys = {key.path: key for key in ROWS if not key.kinds}
    radius = keys["material.radius"]
    assert radius.required and radius.example == "0.6 um"
    assert radius.allowed == "a length above 0 and at most 1 mm"
    assert keys["numerics.skin"].allowed == '"auto" or a number above 0 and at most 10'
    assert keys["push.grains"].allowed == "a list, for each entry a whole number of at least 0"
    assert "silicate_s12" in keys["material"].allowed
    allowed = {key.kinds: key for key in ROWS if key.path == "boundary.wall_speed"}
    assert set(allowed) == {("box", "tube"), ("plates", "periodic")}
    assert allowed["box", "tube"].allowed == "a speed of at least 0"
