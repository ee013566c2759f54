"""Blocks that a scene allows at a path, and paths at which it has a key."""

import typing
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import BaseModel
from pydantic.fields import FieldInfo

Path = tuple[str | int, ...]
TAGS = ("kind", "model")  # keys that select one of several blocks


class Keys(BaseModel):
    """Model of a block, with the order of its keys and those that it has beside its fields."""

    # Keys that the YAML may hold and that are resolved into fields.
    extra_keys: ClassVar[tuple[str, ...]] = ()
    # Keys that only other blocks have, and what to write instead.
    refused: ClassVar[dict[str, str]] = {}
    # Words in place of a whole block.
    shorthands: ClassVar[tuple[str, ...]] = ()
    # Order of the keys, separated by spaces; without one, inherited keys come first.
    order: ClassVar[str] = ""
    # Inherited keys that come last in every block.
    last: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def fields_in_order(cls) -> dict[str, FieldInfo]:
        """Its fields by name, in the order of the keys."""
        first = (name for name in cls.model_fields if name not in cls.last)
        return {name: cls.model_fields[name] for name in cls.order.split() or [*first, *cls.last]}


def format_path(path: Path) -> str:
    """Text of a path, such as sample.positions[3]."""
    text = ""
    for key in path:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text or "scene"


def get_item(data: Any, key: str | int) -> tuple[bool, Any]:
    """(whether plain data have a key or an index, the value)."""
    if isinstance(data, Mapping) and key in data:
        return True, data[key]
    if isinstance(data, (list, tuple)) and isinstance(key, int) and key < len(data):
        return True, data[key]
    return False, None


def strip_union_members(loc: Path, data: Any, missing: bool = False) -> Path:
    """Path in the data of a location, without the names of union members that pydantic adds.

    missing: keep the last key, which the data do not have.
    """
    path: list[str | int] = []
    for index, key in enumerate(loc):
        present, below = get_item(data, key)
        if present:
            path.append(key)
            data = below
        elif missing and index == len(loc) - 1:
            path.append(key)
    return tuple(path)


def list_blocks(item: FieldInfo) -> list[type[Keys]]:
    """All blocks that are allowed at a key."""
    for mark in item.metadata:
        if hasattr(mark, "blocks"):
            return list(mark.blocks)
    return _list_members(item.annotation)


def _list_members(annotation: Any) -> list[type[Keys]]:
    for mark in getattr(annotation, "__metadata__", ()):  # of an entry of a list
        if hasattr(mark, "blocks"):
            return list(mark.blocks)
    # in Python 3.10 `tuple[float, ...]` is an instance of type
    if typing.get_origin(annotation) is None and isinstance(annotation, type):
        return [annotation] if issubclass(annotation, Keys) else []
    return [block for argument in typing.get_args(annotation) for block in _list_members(argument)]


def find_blocks(root: type[Keys], loc: Path, data: Any) -> list[type[Keys]]:
    """The blocks that are allowed at a location of the data.

    A union member's name in it, or the name of a registered law in the data, selects one.
    """
    blocks = [root]
    for key in loc:
        present, value = get_item(data, key)
        data = value if present else data  # the names of union members are not in it
        inner_blocks = [
            member
            for block in blocks
            if key in block.model_fields
            for member in _select_blocks(block.model_fields[key], data)
        ]
        tagged_blocks = [block for block in blocks if key in list_tags(block)]
        if inner_blocks:
            blocks = inner_blocks
        elif tagged_blocks:
            blocks = tagged_blocks
    return blocks


def _select_blocks(item: FieldInfo, value: Any) -> list[type[Keys]]:
    """Keys of the registered law that a value names, or all allowed blocks."""
    law_blocks = (mark.block_of(value) for mark in item.metadata if hasattr(mark, "block_of"))
    named_blocks = [block for block in law_blocks if block is not None]
    return named_blocks or list_blocks(item)


def list_tags(block: type[Keys]) -> set[str]:
    """Names of a block among several: values of its `kind` or `model`."""
    fields = [block.model_fields[name] for name in TAGS if name in block.model_fields]
    return {tag for item in fields for tag in typing.get_args(item.annotation)}


def find_paths(root: type[Keys], key: str, data: Any) -> list[str]:
    """Paths of all keys of that name below a scene, the least deep first.

    The data select one of several blocks at a path, where they have it. A block within itself is
    omitted.
    """
    paths: list[Path] = []
    queue: list[tuple[type[Keys], Any, Path, tuple[type[Keys], ...]]] = [(root, data, (), (root,))]
    while queue:
        block, block_data, path, ancestors = queue.pop(0)
        for name, item in block.model_fields.items():
            if name == key and path:
                paths.append((*path, name))
            _, value = get_item(block_data, name)
            queue += [
                (member, value, (*path, name), (*ancestors, member))
                for member in _filter_by_tag(list_blocks(item), value)
                if member not in ancestors
            ]
    return list(dict.fromkeys(map(format_path, paths)))


def _filter_by_tag(blocks: list[type[Keys]], value: Any) -> list[type[Keys]]:
    """The block that the tag in a value selects, or all blocks."""
    selected = (
        {str(value[tag]) for tag in TAGS if tag in value} if isinstance(value, dict) else set()
    )
    return [block for block in blocks if selected & list_tags(block)] or blocks
