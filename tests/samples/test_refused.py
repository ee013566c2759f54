"""Blocks of samples that are refused, and kinds that are not of this package."""

import runpy
from typing import Annotated, Literal

import numpy as np
import pytest
from bodies import ICE, SIZES, R, make_sample, refuse_sample, scene
from pydantic import Field
from scenes import EXAMPLES

from dusttaichi.errors import DustError
from dusttaichi.samples import Sample, SampleBlock, register, sample_registry
from dusttaichi.scene import from_yaml, json_schema, schema_text
from dusttaichi.scene.fields import Count, Number
from dusttaichi.scene.keys import list_keys

BODY = {"kind": "pca", "grains": 120}
# what the blocks of a kind have where a case does not say otherwise; None: without the key
USUAL = {
    "collision": {"target": BODY, "projectile": BODY, "speed": "1 m/s"},
    "cutout": {"of": {"kind": "lattice", "structure": "sc", "cells": [9, 9, 9]}},
}
REFUSED = {
    "bcca": [
        ({}, "sample.grains: it is missing"),
        ({"grains": 0}, "a whole number of at least 1"),
        ({"grains": 64, "shape": "box"}, "unknown key"),
        ({"grains": 2**30}, "too many for bcca; allowed: at most 1048576"),
        ({"grains": 9, "mass_ratio": 0.01, "sizes": SIZES}, "sample.mass_ratio = 0.01: a number"),
    ],
    "collision": [
        ({"speed": None}, "sample.speed"),
        ({"target": {"kind": "ball"}}, 'sample.target.kind = "ball"'),
        ({"target": {"grains": 4}}, "sample.target: kind is missing"),
        ({"target": {"kind": "bcca", "grains": 0}}, "sample.target.grains = 0: a whole number"),
        ({"projectile": {"kind": "rbd"}}, "sample.projectile: exactly one of grains and size"),
        ({"projectile": {"kind": "pca", "grain": 4}}, 'did you mean "grains"?'),
        ({"orientation": "any"}, '"random" or "as given" is needed'),
        ({"gap": "-1 nm"}, "a length of at least 0 is needed"),
        ({"target": {"kind": "collision"}}, 'sample.target.kind = "collision"'),
    ],
    "cutout": [
        ({}, "exactly one of diameter and grains is needed"),
        ({"diameter": "5 um", "grains": 3}, "exactly one of diameter and grains is needed"),
        ({"diameter": "5 um", "seed": 3}, "it is allowed only together with grains"),
        ({"grains": 9, "length": "5 um"}, "it is allowed only together with diameter"),
        ({"grains": 730}, "sample.grains = 730: sample.of has 729 grains; allowed: no more"),
        (
            {"grains": 9, "seed": 1, "of": {"kind": "chain", "grains": 20}},
            "sample.seed: sample.of has no periodic cell",
        ),
        (
            {"diameter": "0.5 um", "of": {"kind": "chain", "grains": 2}},
            "sample.diameter = 0.5 µm: no grain is inside",
        ),
        ({"diameter": "5 um", "axis": "x"}, "sample.axis"),
        ({"diameter": "5 um", "of": {"kind": "collision"}}, "sample.of.kind"),
        (
            {"diameter": "5 um", "of": {"kind": "explicit", "file": "a", "keep": ["box"]}},
            "sample.of.keep",
        ),
        ({"diameter": "5 um", "of": {"kind": "rbd", "size": ["1 um"] * 3}}, "sample.of.size"),
    ],
    "lattice": [
        ({"cells": [2, 2, 2]}, "sample.structure: it is missing"),
        ({"structure": "hcp", "cells": [2, 2, 2]}, '"sc", "bcc", "fcc" or "ccp" is needed'),
        ({"structure": "sc"}, "exactly one of cells, grains and size is needed"),
        ({"structure": "sc", "cells": [2, 2, 2], "grains": 9}, "exactly one of cells, grains and"),
        ({"structure": "sc", "cells": [2, 2]}, "a list of 3 whole numbers of at least 1"),
        ({"structure": "sc", "cells": [2, 2, 0]}, "sample.cells[2] = 0: a whole number of at le"),
        ({"structure": "sc", "size": ["1 um"] * 3}, "1 x 1 x 1 µm is too small for a grain"),
        ({"structure": "ccp", "size": ["1.3 um"] * 3}, "contains no whole cell of ccp"),
        (
            {"structure": "sc", "grains": 8, "shares": {"default": 1}},
            "sample.shares: unequal grains cannot all touch at the sites",
        ),
        ({"structure": "sc", "grains": 10**9}, "allowed: 2e+07"),
        ({"structure": "sc", "size": ["1 m"] * 3}, "allowed: 2e+07"),
        ({"structure": "sc", "cells": [10**9, 10**9, 10**9]}, "allowed: 2e+07"),
    ],
    "pair": [
        ({"gap": "1 nm", "distance": "2 um"}, "sample.gap = "),
        ({"gap": "-0.2 um"}, "sample.gap: grains 0 and 1 (from 0) are 1 µm apart"),
        ({"gap": "-2 um"}, "sample.gap: grains 0 and 1 (from 0) are 0 µm apart"),
        ({"distance": "0.5 um"}, "sample.distance: grains 0 and 1"),
        ({"distance": "0 um"}, "a length above 0 is needed"),
        ({"speed": "-1 m/s"}, "a speed of at least 0 is needed"),
        ({"impact_parameter": "2 um"}, "sample.impact_parameter: 2 µm is more than the distance"),
        ({"impact_parameter": -0.1}, "a length of at least 0 is needed, or a number of at least 0"),
        ({"impact_parameter": "1 s"}, '"0.5 um" or 0.5'),
        ({"impact_parameter": True}, '"0.5 um" or 0.5'),
        ({"angle": "30"}, "it has no unit; an angle"),
        ({"angle": "120 deg"}, "an angle of at least 0"),
        ({"angle": "30 deg", "impact_parameter": 0.2}, "not allowed together with impact_param"),
        ({"spins": [["0 rad/s"] * 3]}, "sample.spins"),
    ],
    "chain": [
        ({}, "sample.grains: it is missing"),
        ({"grains": 5, "axis": "w"}, '"x", "y" or "z" is needed'),
    ],
    "pca": [
        ({}, "exactly one of grains and size is needed"),
        ({"grains": 5, "shape": "ball"}, '"aggregate", "box" or "cylinder" is needed'),
        ({"grains": 5, "aspect": 2}, "sample.aspect = 2: it is allowed only with shape box"),
        ({"shape": "aggregate", "size": ["9 um"] * 3}, "of which nothing is cut"),
        ({"shape": "box", "size": {"diameter": "9 um", "height": "9 um"}}, "a list of 3 lengths"),
        ({"size": ["9 um"] * 3, "aspect": 2}, "sample.aspect = 2: it is allowed only together"),
        ({"size": ["1 um"] * 3}, "sample.size: 1 x 1 x 1 µm is too small for a grain"),
        ({"size": ["1 cm"] * 3}, "sample: the aggregate would have some"),
        ({"grains": 10**9}, "allowed: 4e+06"),
        ({"grains": 10, "shape": "box", "aspect": 1e-6}, "an aspect closer to 1"),
        ({"grains": 9, "sizes": SIZES | {"smallest": "1 um"}}, "above smallest"),
        ({"grains": 9, "sizes": {"kind": "list", "radii": ["1 um"], "shares": [1, 2]}}, "1 and no"),
        ({"grains": 9, "sizes": {"kind": "normal"}}, 'sample.sizes.kind = "normal"'),
        ({"grains": 9, "shape": "box", "cluster": 2, "sizes": SIZES}, "sample.cluster = 2: it is"),
        (
            {"grains": 9, "shares": {"iron": 1}, "materials": ICE},
            "sample.shares.iron = 1: the scene does not have it; allowed: default, ice",
        ),
    ],
    "rbd": [
        ({"grains": 20, "aspect": 50.0, "periodic": True}, "narrower than two grains"),
        ({"size": ["0.5 um", "20 um", "20 um"], "sizes": SIZES}, "0.5 x 20 x 20 µm is too small"),
        ({"size": ["1.206 um"] * 3}, "contains no whole grain"),
        ({"size": ["1 cm"] * 3}, "sample: the cake to cut from would have some 1.7e+11 grains; al"),
        ({"grains": 10, "aspect": 1e-5}, "allowed: 2e+07"),
    ],
    "random_packing": [
        ({}, "exactly one of grains and size is needed"),
        ({"grains": 9, "size": ["9 um"] * 3}, "exactly one of grains and size"),
        ({"grains": 9, "filling_factor": 0.7}, "a number above 0 and at most 0.62 is needed"),
        ({"grains": 9, "filling_factor": 0}, "a number above 0 and at most 0.62"),
        ({"grains": 2}, "narrower than two grains"),
        ({"size": ["1 um"] * 3}, "too small for a grain"),
        ({"grains": 10**7}, "allowed: 2e+05"),
    ],
}
CASES = [(kind, *case) for kind, cases in REFUSED.items() for case in cases]


@pytest.mark.parametrize("kind, keys, words", CASES)
def test_refused(kind, keys, words):
    block = {**USUAL.get(kind, {}), **keys}
    value_by_name = {key: value for key, value in block.items() if value is not None}
    assert words in refuse_sample(kind=kind, **value_by_name)


EXAMPLE = EXAMPLES / "hollow_sphere.py"


@pytest.fixture(autouse=True)
def leave_no_kind_behind():
    yield
    sample_registry.GRAINS.restore({})


class RingSample(SampleBlock):
    """Grains in a ring."""

    kind: Literal["ring"]
    grains: Count = Field(description="number of grains")
    spread: Annotated[float, Number(ge=1)] = Field(1.0, description="distance over that in contact")


def ring(spec, materials):
    angle = 2 * np.pi * np.arange(spec.grains) / spec.grains
    reach = spec.spread * materials.distance / (2 * np.sin(np.pi / spec.grains))
    flat = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return Sample.at_rest(reach * flat)


def test_the_example_of_the_docs():
    namespace = runpy.run_path(str(EXAMPLE), run_name="__main__")
    sample, spec = namespace["sample"], namespace["scene"].sample
    distance = np.linalg.norm(sample.positions, axis=1)
    assert (distance + R <= spec.outer).all() and (distance - R >= spec.inner).all()
    # RBD fills 0.15 of its bulk; whole grains leave a third of so thin a shell empty
    shell = 4 / 3 * np.pi * (spec.outer**3 - spec.inner**3)
    assert 0.07 < len(sample) * 4 / 3 * np.pi * R**3 / shell < 0.15
    assert sample.info["kind"] == "hollow_sphere" and sample.info["grains"] == len(sample)
    text = namespace["scene"].to_yaml()
    assert "outer: 8 um" in text and from_yaml(text) == namespace["scene"]


def test_a_registered_kind_is_known_everywhere_and_can_collide():
    assert "RingSample" not in json_schema()["$defs"]
    register(RingSample)(ring)
    sample = make_sample("ring", grains=12)
    assert sample.info["coordination"] == 2 and sample.info["kind"] == "ring"
    assert "RingSample" in json_schema()["$defs"]
    assert {key.path for key in list_keys() if key.kinds == ("ring",)} >= {"sample.spread"}
    assert "sample.grains = 0: a whole number of at least 1" in refuse_sample(kind="ring", grains=0)
    assert 'did you mean "spread"?' in refuse_sample(kind="ring", grains=3, spred=2)
    assert '"ring" or "space_filling" is needed' in refuse_sample(kind="rings")
    body = {"kind": "ring", "grains": 6}
    spec = {"kind": "collision", "projectile": {"kind": "chain", "grains": 2}, "speed": "1 m/s"}
    sample = make_sample(**spec, target=body)
    assert len(sample) == 8 and sample.info["target"]["kind"] == "ring"
    assert "sample.target.grains" in refuse_sample(
        **{**spec, "target": {**body, "grains": 0}, "speed": "1 m/s"}
    )
    register(RingSample)(lambda spec, materials: Sample.at_rest(np.zeros((1, 3))))
    assert len(make_sample("ring", grains=5)) == 1
    sample_registry.GRAINS.restore({})
    assert '"ring"' not in schema_text()  # nor in kinds within kinds


def test_what_does_not_go_with_other_blocks():
    class Shy(RingSample):
        kind: Literal["shy"]

        def conflicts(self, scene):
            return [("grains", "not here")] if scene.boundary.kind == "open" else []

    register(Shy)(ring)
    assert "sample.grains = 3: not here" in refuse_sample(kind="shy", grains=3)
    body = {"kind": "collision", "projectile": {"kind": "pair"}, "speed": "1 m/s"}
    assert "sample.target.grains = 3: not here" in refuse_sample(
        **body, target={"kind": "shy", "grains": 3}
    )


def test_blocks_that_cannot_be_registered():
    class Nameless(SampleBlock):
        grains: int

    class Mine(SampleBlock):
        kind: Literal["rbd"]

    with pytest.raises(TypeError, match='kind: Literal\\["name'):
        register(Nameless)
    with pytest.raises(ValueError, match="rbd is a kind of this package"):
        register(Mine)
    with pytest.raises(DustError):
        scene(kind="mine")
