"""Blocks that a scene allows at a path, and paths at which it has a key."""

import typing
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

Path = tuple[str | int, ...]
TAGS = ("kind", "model")  # keys that select one of several blocks


def dotted(path: Path) -> str:
    """Text of a path, such as sample.positions[3]."""
    text = ""
    for key in path:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text or "scene"


def step(data: Any, key: str | int) -> tuple[bool, Any]:
    """(whether plain data have a key or an index, the value)."""
    if isinstance(data, Mapping) and key in data:
        return True, data[key]
    if isinstance(data, (list, tuple)) and isinstance(key, int) and key < len(data):
        return True, data[key]
    return False, None


def path_in(loc: Path, data: Any, missing: bool = False) -> Path:
    """Path in the data of a location, without the names of union members that pydantic adds.

    missing: keep the last key, which the data do not have.
    """
    path: list[str | int] = []
    for index, key in enumerate(loc):
        present, below = step(data, key)
        if present:
            path.append(key)
            data = below
        elif missing and index == len(loc) - 1:
            path.append(key)
    return tuple(path)


def choices(item: FieldInfo) -> list[type[BaseModel]]:
    """All blocks that are allowed at a key."""
    for mark in item.metadata:
        if hasattr(mark, "blocks"):
            return mark.blocks
    return _members(item.annotation)


def _members(annotation: Any) -> list[type[BaseModel]]:
    for mark in getattr(annotation, "__metadata__", ()):  # of an entry of a list
        if hasattr(mark, "blocks"):
            return mark.blocks
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [block for part in typing.get_args(annotation) for block in _members(part)]


def blocks_at(root: type[BaseModel], loc: Path, data: Any) -> list[type[BaseModel]]:
    """The blocks that are allowed at a location of the data.

    A union member's name in it, or the name of a registered law in the data, selects one.
    """
    blocks = [root]
    for key in loc:
        present, value = step(data, key)
        data = value if present else data  # the names of union members are not in it
        below = [
            member
            for block in blocks
            if key in block.model_fields
            for member in _chosen(block.model_fields[key], data)
        ]
        named = [block for block in blocks if key in tags(block)]
        if below:
            blocks = below
        elif named:
            blocks = named
    return blocks


def _chosen(item: FieldInfo, value: Any) -> list[type[BaseModel]]:
    """Block of the registered law that a value names, or all allowed blocks."""
    found = (mark.block_of(value) for mark in item.metadata if hasattr(mark, "block_of"))
    named = [block for block in found if block is not None]
    return named or choices(item)


def tags(block: type[BaseModel]) -> set[str]:
    """Names of a block among several: values of its `kind` or `model`."""
    fields = [block.model_fields[name] for name in TAGS if name in block.model_fields]
    return {tag for item in fields for tag in typing.get_args(item.annotation)}


def paths_of(root: type[BaseModel], key: str, data: Any) -> list[str]:
    """Paths of all keys of that name below a scene, the least deep first.

    The data select one of several blocks at a path, where they have it. Blocks in themselves are
    left out.
    """
    found: list[Path] = []
    todo: list[tuple] = [(root, data, (), (root,))]
    while todo:
        block, here, path, around = todo.pop(0)
        for name, item in block.model_fields.items():
            if name == key and path:
                found.append((*path, name))
            _, value = step(here, name)
            todo += [
                (member, value, (*path, name), (*around, member))
                for member in _of_data(choices(item), value)
                if member not in around
            ]
    return list(dict.fromkeys(map(dotted, found)))


def _of_data(blocks: list[type[BaseModel]], value: Any) -> list[type[BaseModel]]:
    """The block that the tag in a value selects, or all blocks."""
    given = {str(value[tag]) for tag in TAGS if tag in value} if isinstance(value, dict) else set()
    return [block for block in blocks if given & tags(block)] or blocks
