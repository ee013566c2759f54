"""Kinds of samples, selected by the key `kind`: a YAML block and a generator each."""

import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar, Union

from pydantic import BaseModel, Field

from dusttaichi.physics.registry import Registry
from dusttaichi.scene.fields import AnyScene, Block, CoreHandler, CoreSchema, Faults
from dusttaichi.scene.making import Cost

Maker = TypeVar("Maker", bound=Callable[..., Any])
Reader = TypeVar("Reader", bound=type[BaseModel])


class KindBlock(Block):
    """The YAML block of a kind; its field `kind` is a Literal with the kind's name."""

    if TYPE_CHECKING:
        kind: str

    is_body: ClassVar[bool] = True
    """False where it cannot be a body of another block, such as the target of a collision."""

    @property
    def body_blocks(self) -> Mapping[str, "KindBlock"]:
        """Blocks of the bodies that it is made of, by their paths; none of a single body."""
        return {}

    def cost(self, scene: AnyScene) -> Cost | None:
        """Cost of its sample alone; None where it grows no faster than N log N."""
        return None

    def costs(self, scene: AnyScene, path: str = "sample") -> dict[str, Cost]:
        """Costs of its sample and of its bodies, by their paths."""
        cost, costs_by_path = self.cost(scene), {}
        if cost is not None:
            costs_by_path[f"{path}.kind = {self.kind}"] = cost
        for name, body in self.body_blocks.items():
            costs_by_path |= body.costs(scene, f"{path}.{name}")
        return costs_by_path

    def conflicts(self, scene: AnyScene) -> Faults:
        """Conflicts with the scene's other blocks; the paths are relative to this block."""
        for name, body in self.body_blocks.items():
            for path, text in body.conflicts(scene):
                yield f"{name}.{path}".rstrip("."), text


@dataclass(frozen=True)
class Kind:
    """A kind: its YAML block, and the function that makes a sample from it."""

    block: type[KindBlock]
    make: Callable[..., Any]


class Kinds(Registry[str, Kind]):
    """The Registry of kinds, and the blocks that have a field for any of them.

    package: of the built-in kinds, one per file of the same name, or their module.
    """

    def __init__(self, package: str, word: str) -> None:
        super().__init__(word)
        self.package = package
        self._readers: list[type[BaseModel]] = []

    def register(self, block: type[KindBlock]) -> Callable[[Maker], Maker]:
        """Decorator: the function below makes the samples of this block, under its `kind`.

        A kind that is registered again, as in a notebook, replaces the former one. Raises
        TypeError for a block without a name of its kind, and ValueError for the name of a built-in
        kind.
        """
        item = block.model_fields.get("kind")
        (name,) = (typing.get_args(item.annotation) if item else ()) or (None,)
        if not isinstance(name, str):
            raise TypeError(
                f'{block.__name__}: a field kind: Literal["name of the kind"] is needed'
            )
        is_built_in = block.__module__ in (self.package, f"{self.package}.{name}")
        if name in self.built_in and not is_built_in:
            raise ValueError(f"{name} is a kind of this package; another name is needed")

        def register_kind(make: Maker) -> Maker:
            (self.built_in if is_built_in else self.added)[name] = Kind(block, make)
            self.rebuild_readers()
            return make

        return register_kind

    def restore(self, added: Mapping[str, Kind]) -> None:
        if dict(added) != self.added:  # it takes a tenth of a second
            super().restore(added)
            self.rebuild_readers()

    def rebuild_readers(self) -> None:
        """Update the blocks with a field for any kind."""
        complete = [reader for reader in self._readers if reader.__pydantic_complete__]
        for reader in complete:  # kinds within kinds: none may be built from a former schema
            if "__pydantic_core_schema__" in vars(reader):
                del reader.__pydantic_core_schema__
        for reader in complete:
            reader.model_rebuild(force=True)

    def add_reader(self, model: Reader) -> Reader:
        """Let `rebuild_readers` update a block that has a field for any kind (decorator)."""
        self._readers.append(model)
        return model


@dataclass(frozen=True)
class AnyOf:
    """Marks a field for any registered block, selected by `kind`.

    bodies: only those whose `is_body` is true.
    """

    kinds: Kinds
    bodies: bool = False

    @property
    def blocks(self) -> list[type[KindBlock]]:
        """The blocks in the order of their kinds."""
        blocks = [self.kinds[name].block for name in sorted(self.kinds)]
        return [block for block in blocks if block.is_body or not self.bodies]

    def __get_pydantic_core_schema__(self, source: Any, handler: CoreHandler) -> CoreSchema:
        union: Any = Union[tuple(self.blocks)]  # noqa: UP007
        return handler.generate_schema(Annotated[union, Field(discriminator="kind")])
