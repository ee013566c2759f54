"""The JSON Schema: an editor accepts and refuses what the loader does."""

from functools import cache

import jsonschema
import pytest
import yaml
from scenes import CONFIGS, FULL, edited, text_of

from dusttaichi.scene import NAMED, from_yaml, json_schema, schema_text
from dusttaichi.scene.yaml_text import read


@cache
def validator():
    return jsonschema.Draft202012Validator(json_schema())


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


def _described(node, where=""):
    """Yield the places of all keys of a schema that say nothing."""
    if isinstance(node, dict):
        for name, field in node.get("properties", {}).items():  # one may be called properties
            if not {"description", "const", "enum"} & set(field):
                yield f"{where}.{name}"
            yield from _described(field, f"{where}.{name}")
        for name in node.keys() - {"properties"}:
            yield from _described(node[name], f"{where}.{name}")
    elif isinstance(node, list):
        for part in node:
            yield from _described(part, where)


def test_every_key_says_what_it_is():
    assert not list(_described(json_schema()))


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
    data = read(edited(text.split(":")[0], text)).data
    found = [e.message for e in validator().iter_errors(data)]
    assert any(said in message for message in found), found
    assert not any("any of the given schemas" in m for m in found if "null" not in m), found


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
    data = read(edited(text.split(":")[0], text)).data
    assert not validator().is_valid(data)
