"""The kinds of samples that a scene may ask for with `sample.kind`: those of this package, and own.

A kind is a YAML block and a function that makes the sample:

    class Cube(SampleBlock):
        kind: Literal["cube"]
        edge: Annotated[float, Quantity("length", gt=0)] = Field(description="edge of the cube")

    @register(Cube)
    def make(spec, materials):
        return Sample.at_rest(...)

From there on the YAML may say `sample: {kind: cube, edge: 20 um}`, in this process. Each file of
this package that makes a kind of sample registers it in this way.
"""

from __future__ import annotations

import typing
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar, Union

from pydantic import BaseModel, Field

from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample, describe
from dusttaichi.scene.fields import Block

Make = Callable[["SampleBlock", Materials], Sample]


class SampleBlock(Block):
    """The YAML block of a kind of sample; its field `kind` is a Literal with the kind's name."""

    flies: ClassVar[bool] = False
    """True where bodies fly at each other, so that kinetic energy decides what happens."""
    is_body: ClassVar[bool] = True
    """False where it cannot be the target or projectile of a collision."""

    def conflicts(self, scene) -> list[tuple[str, str]]:
        """What does not go with the scene's other blocks, as (dotted path below this, text)."""
        return []

    def least_room(self, radius: float) -> tuple[tuple[float, float, float], int]:
        """Edges (x, y, z) [m] of what a box must hold at least, and its number of grains.

        radius [m]: of the scene's material. What is not known before the sample is made is 0.
        """
        return (0.0, 0.0, 0.0), getattr(self, "grains", None) or 0


@dataclass(frozen=True)
class Kind:
    """A kind of sample: its YAML block, and what makes a Sample of one."""

    block: type[SampleBlock]
    make: Make


KINDS: dict[str, Kind] = {}
_readers: list[type[BaseModel]] = []


def register(block: type[SampleBlock]) -> Callable[[Make], Make]:
    """Decorator: the function below makes the samples of this block, under its `kind`.

    The function is called with the block, its quantities in SI, and the scene's Materials
    (radius and equilibrium distance of its grains, and what else they may be made of); it returns
    a Sample, or raises DustError. A kind that is registered again replaces the one before,
    as it happens in a notebook. Raises TypeError for a block without a name of its kind, and
    ValueError for the name of a kind of this package.
    """
    item = block.model_fields.get("kind")
    (name,) = (typing.get_args(item.annotation) if item else ()) or (None,)
    if not isinstance(name, str):
        raise TypeError(f'{block.__name__}: a field kind: Literal["name of the kind"] is needed')
    own = name in KINDS and KINDS[name].block.__module__ == f"{__package__}.{name}"
    if own and block.__module__ != f"{__package__}.{name}":
        raise ValueError(f"{name} is a kind of this package; another name is needed")

    def known(make: Make) -> Make:
        KINDS[name] = Kind(block, make)
        follow()
        return make

    return known


def follow() -> None:
    """Let the blocks with a field AnySample or AnyBody know the kinds of now."""
    for reader in _readers:
        if reader.__pydantic_complete__:
            reader.model_rebuild(force=True)


def reads_samples(model: type[BaseModel]) -> type[BaseModel]:
    """Decorator of a block with a field AnySample or AnyBody: it follows what is registered."""
    _readers.append(model)
    return model


@dataclass(frozen=True)
class _Registered:
    """Marks a field that may be any block that is registered, told apart by `kind`."""

    bodies: bool = False

    @property
    def blocks(self) -> list[type[SampleBlock]]:
        """The blocks in the order of their kinds."""
        found = [KINDS[name].block for name in sorted(KINDS)]
        return [block for block in found if block.is_body or not self.bodies]

    def __get_pydantic_core_schema__(self, source, handler):
        union = Union[tuple(self.blocks)]  # noqa: UP007
        return handler.generate_schema(Annotated[union, Field(discriminator="kind")])


AnySample = Annotated[SampleBlock, _Registered()]
AnyBody = Annotated[SampleBlock, _Registered(bodies=True)]


def made(spec: SampleBlock, materials: Materials) -> Sample:
    """The sample of a block; its info says what it is and what it is like."""
    sample = KINDS[spec.kind].make(spec, materials)
    sample.info.setdefault("kind", spec.kind)
    sample.info.setdefault("grains", len(sample))
    # Grains that overlap at the start are in contact.
    touch = 2 * materials.radius if sample.radii is None else None
    sample.info.update(describe(sample, materials.radii_of(sample), touch))
    return sample
