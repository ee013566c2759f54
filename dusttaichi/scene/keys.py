"""Keys of the YAML with default, allowed values and meaning: the table of keys in the docs.

for key in list_keys():
    print(key.path, key.kinds, key.default, key.allowed, key.meaning)
"""

import json
import typing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo

from dusttaichi import method
from dusttaichi.scene.blocks import TAGS, Keys, list_blocks

_WORDS = {bool: "true or false", str: "a text", Path: "a path", float: "a number"}


@dataclass(frozen=True)
class Key:
    """A key of the YAML.

    path: keys joined by dots, `boundary.wall_speed`; in a list that of every entry, `push.face`.
    kinds: kinds of the innermost block that have this key, (`box`, `plates`), for
    `sample.sizes.median` the law (`lognormal`,); empty where all have it.
    default: as in the YAML; empty where there is none. required: True where the YAML must give it.
    allowed: values and bounds. example: a value as in the YAML, or empty. meaning: description.
    """

    path: str
    kinds: tuple[str, ...]
    default: str
    required: bool
    allowed: str
    example: str
    meaning: str


def find_scene_class(method_name: str) -> type[Keys]:
    """Class of the scenes of a method. Raises KeyError where there is none of that name."""
    return typing.cast(type[Keys], method.load_method(method_name).scene)


def list_keys(method_name: str = method.DEFAULT) -> list[Key]:
    """The keys of a scene of a method, in the order of the blocks.

    A key that differs between the kinds of a block has several rows, each with its kinds. The keys
    of a block that is allowed at several paths (`stop` and `stages.stop`) are listed at the least
    deep one.
    """
    scene = find_scene_class(method_name)
    return _list_below(scene, "", _find_homes(scene))


def _find_homes(scene: type[Keys]) -> dict[type[Keys], str]:
    """Least deep path of every block, the first of several."""
    homes: dict[type[Keys], str] = {}
    queue: list[tuple[type[Keys], str]] = [(scene, "")]
    while queue:
        block, prefix = queue.pop(0)
        for name, item in block.fields_in_order().items():
            new_blocks = [member for member in list_blocks(item) if member not in homes]
            homes.update(dict.fromkeys(new_blocks, prefix + name))
            queue += [(member, f"{prefix}{name}.") for member in new_blocks]
    return homes


def find_key_path(block: type[Keys], name: str) -> str:
    """Path of a key of a block of any method for `Scene.with_value`, such as stages.0.name.

    It is the least deep path of the block; entries of a list are represented by the first.
    """
    for method_name in method.METHODS:
        scene = find_scene_class(method_name)
        homes = _find_homes(scene)
        if block is scene or block in homes:
            return ".".join([*_split_path(scene, homes.get(block, "")), name])
    return name


def _split_path(scene: type[Keys], path: str) -> list[str]:
    """Keys of the path to a block, with a 0 for each list."""
    steps, blocks = [], [scene]
    for key in path.split(".") if path else ():
        item = next(b.fields_in_order()[key] for b in blocks if key in b.fields_in_order())
        is_list = any(
            typing.get_origin(annotation) is tuple for annotation in collect_annotations(item)
        )
        steps += [key, *["0"] * is_list]
        blocks = list_blocks(item)
    return steps


def _list_below(block: type[Keys], prefix: str, homes: dict[type[Keys], str]) -> list[Key]:
    keys: list[Key] = []
    for name, item in block.fields_in_order().items():
        if name in TAGS:
            continue
        path = prefix + name
        keys.append(_build_key(path, item))
        members = [member for member in list_blocks(item) if homes[member] == path]
        tag = next((tag for tag in TAGS if members and tag in members[0].model_fields), None)
        if tag is not None:
            words = ", ".join(_read_tag(member, tag) for member in members)
            keys.append(Key(f"{path}.{tag}", (), "", True, words, "", "selects one of them"))
            keys += _merge_kinds(members, path, tag, homes)
        else:
            for member in members:
                keys += _list_below(member, f"{path}.", homes)
    return keys


def _merge_kinds(
    members: list[type[Keys]], path: str, tag: str, homes: dict[type[Keys], str]
) -> list[Key]:
    """Keys of the blocks of a union; keys that several of them share are listed once."""
    kinds_by_key: dict[Key, tuple[str, ...]] = {}
    for member in members:
        word = _read_tag(member, tag)
        for key in _list_below(member, f"{path}.", homes):
            kinds_by_key[key] = (*kinds_by_key.get(key, ()), word)
    order = {key: n for n, key in reversed(list(enumerate(key.path for key in kinds_by_key)))}
    merged = [replace(key, kinds=key.kinds or words) for key, words in kinds_by_key.items()]
    return sorted(merged, key=lambda key: order[key.path])


def _read_tag(block: type[Keys], tag: str) -> str:
    return str(typing.get_args(block.model_fields[tag].annotation)[0])


def _build_key(path: str, item: FieldInfo) -> Key:
    allowed, _, text = _describe_allowed(item).partition(" is needed")
    text, _, example = text.partition(", for example ")
    return Key(
        path,
        (),
        _write_default(item),
        item.is_required(),
        allowed + text,
        _write_value(item.examples[0]) if item.examples else example.replace('"', ""),
        item.description or "",
    )


def _describe_allowed(item: FieldInfo) -> str:
    """Allowed values of a key, as in an error message about it."""
    annotations = collect_annotations(item)
    text = next(
        (
            annotation.requirement
            for annotation in annotations
            if hasattr(annotation, "requirement")
        ),
        "",
    )
    literals = [
        annotation for annotation in annotations if typing.get_origin(annotation) is typing.Literal
    ]
    words = dict.fromkeys(word for annotation in literals for word in typing.get_args(annotation))
    text = text or ", ".join(map(str, words))
    if list_blocks(item) and "block" not in text:
        text = f"a block or {text}" if text else "a block"
    text = text or " or ".join(
        name for value_type, name in _WORDS.items() if value_type in annotations
    )
    if any(typing.get_origin(annotation) is dict for annotation in annotations):
        return f"a name and for each {text}"
    lists = [
        typing.get_args(annotation)
        for annotation in annotations
        if typing.get_origin(annotation) is tuple
    ]
    if any(entries[1:] == (Ellipsis,) for entries in lists):
        return f"a list, for each entry {text}"
    return f"a list of {len(lists[0])}, each {text}" if lists and "list" not in text else text


def collect_annotations(item: FieldInfo) -> list[Any]:
    """The marks and types of a key, also those inside of a list or an alternative."""
    annotations, queue = [], [*item.metadata, item.annotation]
    while queue:
        annotation = queue.pop(0)
        annotations.append(annotation)
        queue += [*getattr(annotation, "__metadata__", ()), *typing.get_args(annotation)]
    return annotations


def _write_default(item: FieldInfo) -> str:
    """Default as in the YAML."""
    extra = item.json_schema_extra
    if isinstance(extra, dict) and "default" in extra:
        return str(extra["default"])
    if item.is_required() or item.default_factory is not None:
        return ""
    value = item.default
    for mark in item.metadata:
        if hasattr(mark, "write_default"):
            return str(mark.write_default(value))
    if isinstance(value, dict) and value:
        return str(next(iter(value.values())))  # a word in place of a block
    return "" if value is None or value == {} else _write_value(value)


def _write_value(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {_write_value(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_write_value(entry) for entry in value)}]"
    return value if isinstance(value, str) else json.dumps(value, default=str)
