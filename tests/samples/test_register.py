"""Kinds of samples that are not of this package: known to the YAML once they are registered."""

import runpy
from typing import Annotated, Literal

import numpy as np
import pytest
from bodies import R, made, refused, scene
from pydantic import Field
from scenes import EXAMPLES

from dusttaichi.errors import DustError
from dusttaichi.samples import Sample, SampleBlock, register, registry
from dusttaichi.scene import from_yaml, json_schema
from dusttaichi.scene.fields import Count, Number
from dusttaichi.scene.keys import rows

EXAMPLE = EXAMPLES / "hollow_sphere.py"


@pytest.fixture(autouse=True)
def leave_no_kind_behind():
    yield
    registry.GRAINS.added.clear()
    registry.GRAINS.follow()


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
    said = runpy.run_path(str(EXAMPLE), run_name="__main__")
    sample, spec = said["sample"], said["scene"].sample
    distance = np.linalg.norm(sample.positions, axis=1)
    assert (distance + R <= spec.outer).all() and (distance - R >= spec.inner).all()
    # RBD fills 0.15 of its bulk; whole grains leave a third of so thin a shell empty
    shell = 4 / 3 * np.pi * (spec.outer**3 - spec.inner**3)
    assert 0.07 < len(sample) * 4 / 3 * np.pi * R**3 / shell < 0.15
    assert sample.info["kind"] == "hollow_sphere" and sample.info["grains"] == len(sample)
    text = said["scene"].to_yaml()
    assert "outer: 8 um" in text and from_yaml(text) == said["scene"]


def test_a_registered_kind_is_known_everywhere():
    assert "RingSample" not in json_schema()["$defs"]
    register(RingSample)(ring)
    sample = made("ring", grains=12)
    assert sample.info["coordination"] == 2 and sample.info["kind"] == "ring"
    assert "RingSample" in json_schema()["$defs"]
    assert {key.path for key in rows() if key.kinds == ("ring",)} >= {"sample.spread"}
    assert "sample.grains = 0: a whole number of at least 1" in refused(kind="ring", grains=0)
    assert 'did you mean "spread"?' in refused(kind="ring", grains=3, spred=2)
    assert '"ring" or "space_filling" is needed' in refused(kind="rings")


def test_a_registered_kind_can_collide():
    register(RingSample)(ring)
    body = {"kind": "ring", "grains": 6}
    spec = {"kind": "collision", "projectile": {"kind": "chain", "grains": 2}, "speed": "1 m/s"}
    sample = made(**spec, target=body)
    assert len(sample) == 8 and sample.info["target"]["kind"] == "ring"
    assert "sample.target.grains" in refused(
        **{**spec, "target": {**body, "grains": 0}, "speed": "1 m/s"}
    )


def test_what_does_not_go_with_other_blocks():
    class Shy(RingSample):
        kind: Literal["shy"]

        def conflicts(self, scene):
            return [("grains", "not here")] if scene.boundary.kind == "open" else []

    register(Shy)(ring)
    assert "sample.grains = 3: not here" in refused(kind="shy", grains=3)
    body = {"kind": "collision", "projectile": {"kind": "pair"}, "speed": "1 m/s"}
    assert "sample.target.grains = 3: not here" in refused(
        **body, target={"kind": "shy", "grains": 3}
    )


def test_a_kind_can_be_registered_again():
    register(RingSample)(ring)
    register(RingSample)(lambda spec, materials: Sample.at_rest(np.zeros((1, 3))))
    assert len(made("ring", grains=5)) == 1


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
