"""Keys of the YAML with default, allowed values and meaning: the table of keys in the docs.

for key in rows():
    print(key.path, key.kinds, key.default, key.allowed, key.meaning)
"""

import json
import typing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from dusttaichi import method
from dusttaichi.scene.blocks import TAGS, choices

_WORDS = {bool: "true or false", str: "a text", Path: "a path", float: "a number"}


@dataclass(frozen=True)
class Key:
    """A key of the YAML.

    path: keys joined by dots, `boundary.wall_speed`; in a list that of every entry, `push.face`.
    kinds: kinds of the innermost block that have this key, (`box`, `plates`), for
    `sample.sizes.median` the law (`lognormal`,); empty where all have it.
    default: as in the YAML; empty where there is none. needed: True where the YAML must give it.
    allowed: values and bounds. example: a value as in the YAML, or empty. meaning: description.
    """

    path: str
    kinds: tuple[str, ...]
    default: str
    needed: bool
    allowed: str
    example: str
    meaning: str


def rows(of: str = method.DEFAULT) -> list[Key]:
    """The keys of a scene of a method, in the order of the blocks.

    A key that differs between the kinds of a block has several rows, each with its kinds. The keys
    of a block that is allowed at several places (`stop` and `stages.stop`) are listed at the least
    deep of them.
    """
    scene = method.named(of).scene
    return _below(scene, "", _homes(scene))


def _homes(scene: type[BaseModel]) -> dict[type[BaseModel], str]:
    """Path of the least deep place of every block, the first of several."""
    homes: dict[type[BaseModel], str] = {}
    todo: list[tuple[type[BaseModel], str]] = [(scene, "")]
    while todo:
        block, prefix = todo.pop(0)
        for name, item in block.fields_in_order().items():
            new = [member for member in choices(item) if member not in homes]
            homes.update(dict.fromkeys(new, prefix + name))
            todo += [(member, f"{prefix}{name}.") for member in new]
    return homes


def path_of(block: type[BaseModel], name: str) -> str:
    """Path of a key of a block of any method for `Scene.with_value`, such as stages.0.name.

    That of the least deep place of the block; entries of a list are represented by the first.
    """
    for of in method.METHODS:
        scene = method.named(of).scene
        homes = _homes(scene)
        if block is scene or block in homes:
            return ".".join([*_steps(scene, homes.get(block, "")), name])
    return name


def _steps(scene: type[BaseModel], path: str) -> list[str]:
    """Keys of the path to a block, with a 0 for each list."""
    steps, blocks = [], [scene]
    for key in path.split(".") if path else ():
        item = next(b.fields_in_order()[key] for b in blocks if key in b.fields_in_order())
        listed = any(typing.get_origin(part) is tuple for part in parts_of(item))
        steps += [key, *["0"] * listed]
        blocks = choices(item)
    return steps


def _below(block: type[BaseModel], prefix: str, homes: dict) -> list[Key]:
    found: list[Key] = []
    for name, item in block.fields_in_order().items():
        if name in TAGS:
            continue
        path = prefix + name
        found.append(_key(path, item))
        members = [member for member in choices(item) if homes[member] == path]
        tag = next((tag for tag in TAGS if members and tag in members[0].model_fields), None)
        if tag is not None:
            words = ", ".join(_word(member, tag) for member in members)
            found.append(Key(f"{path}.{tag}", (), "", True, words, "", "selects one of them"))
            found += _of_kinds(members, path, tag, homes)
        else:
            for member in members:
                found += _below(member, f"{path}.", homes)
    return found


def _of_kinds(members: list, path: str, tag: str, homes: dict) -> list[Key]:
    """Keys of the blocks of a union; keys that several of them share are listed once."""
    kinds: dict[Key, tuple[str, ...]] = {}
    for member in members:
        word = _word(member, tag)
        for key in _below(member, f"{path}.", homes):
            kinds[key] = (*kinds.get(key, ()), word)
    order = {key: n for n, key in reversed(list(enumerate(key.path for key in kinds)))}
    merged = [replace(key, kinds=key.kinds or words) for key, words in kinds.items()]
    return sorted(merged, key=lambda key: order[key.path])


def _word(block: type[BaseModel], tag: str) -> str:
    return typing.get_args(block.model_fields[tag].annotation)[0]


def _key(path: str, item: FieldInfo) -> Key:
    allowed, _, rest = _allowed(item).partition(" is needed")
    rest, _, example = rest.partition(", for example ")
    return Key(
        path,
        (),
        _default(item),
        item.is_required(),
        allowed + rest,
        _written(item.examples[0]) if item.examples else example.replace('"', ""),
        item.description or "",
    )


def _allowed(item: FieldInfo) -> str:
    """Allowed values of a key, as in an error message about it."""
    parts = parts_of(item)
    said = next((part.needed for part in parts if hasattr(part, "needed")), "")
    literals = [part for part in parts if typing.get_origin(part) is typing.Literal]
    words = dict.fromkeys(word for part in literals for word in typing.get_args(part))
    said = said or ", ".join(map(str, words))
    if choices(item) and "block" not in said:
        said = f"a block or {said}" if said else "a block"
    said = said or " or ".join(name for kind, name in _WORDS.items() if kind in parts)
    if any(typing.get_origin(part) is dict for part in parts):
        return f"a name and for each {said}"
    lists = [typing.get_args(part) for part in parts if typing.get_origin(part) is tuple]
    if any(entries[1:] == (Ellipsis,) for entries in lists):
        return f"a list, for each entry {said}"
    return f"a list of {len(lists[0])}, each {said}" if lists and "list" not in said else said


def parts_of(item: FieldInfo) -> list[Any]:
    """The marks and types of a key, also those inside of a list or an alternative."""
    found, todo = [], [*item.metadata, item.annotation]
    while todo:
        part = todo.pop(0)
        found.append(part)
        todo += [*getattr(part, "__metadata__", ()), *typing.get_args(part)]
    return found


def _default(item: FieldInfo) -> str:
    """Default as in the YAML."""
    shown = (item.json_schema_extra or {}).get("default")
    if shown is not None:
        return shown
    if item.is_required() or item.default_factory is not None:
        return ""
    value = item.default
    if any(hasattr(mark, "written") for mark in item.metadata):
        return next(mark.written(value) for mark in item.metadata if hasattr(mark, "written"))
    if isinstance(value, dict) and value:
        return next(iter(value.values()))  # a word in place of a block
    return "" if value is None or value == {} else _written(value)


def _written(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {_written(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_written(entry) for entry in value)}]"
    return value if isinstance(value, str) else json.dumps(value, default=str)
