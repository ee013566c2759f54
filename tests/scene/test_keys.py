"""The table of keys: every key is there with its meaning, and its default is the program's."""

import pytest
from scenes import BASE

from dusttaichi.scene import Scene, from_yaml, json_schema
from dusttaichi.scene.keys import rows
from dusttaichi.scene.yaml_text import read

ROWS = rows()
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
}
# Blocks that a scene may do without, with what they need.
MORE = {
    "sphere": {"radius": "6 um", "gap": "1 nm"},
    "gravity": {"central": {"mass": "1 kg"}},
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


def test_every_key_of_the_schema_is_there_with_its_meaning():
    schema = json_schema()
    both = [*ROWS, *rows("continuum")]
    named = {part for key in both for part in key.path.split(".")}
    for block in [schema, *schema["$defs"].values()]:
        assert set(block.get("properties", {})) <= named
    for key in both:
        assert key.meaning and key.allowed, key.path
        assert not (key.needed and key.default), key.path


def test_no_key_is_there_twice():
    single = [(key.path, kind) for key in ROWS for kind in key.kinds or ("",)]
    assert len(single) == len(set(single))


@pytest.mark.parametrize("key", DEFAULTS, ids=lambda key: f"{key.path} {key.kinds}")
def test_default_is_what_the_table_says(key):
    value = read("value: " + key.default.replace("<name>", "cake")).data["value"]
    for kind in key.kinds or ("",):
        scene = scene_with(key, kind)
        assert scene.with_value(key.path.replace("stages.", "stages.0."), value) == scene


def test_what_is_allowed_and_an_example():
    keys = {key.path: key for key in ROWS if not key.kinds}
    radius = keys["material.radius"]
    assert radius.needed and radius.example == "0.6 um"
    assert radius.allowed == "a length above 0 and at most 1 mm"
    assert keys["numerics.skin"].allowed == '"auto" or a number above 0 and at most 10'
    assert keys["push.grains"].allowed == "a list, for each entry a whole number of at least 0"
    assert "silicate_s12" in keys["material"].allowed


def test_a_key_says_which_kinds_have_it():
    kinds = {key.kinds: key for key in ROWS if key.path == "boundary.wall_speed"}
    assert set(kinds) == {("box",), ("plates", "periodic")}
    assert kinds["box",].allowed == "a speed of at least 0"
