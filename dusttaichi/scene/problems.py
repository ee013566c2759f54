"""Error messages from pydantic's errors: path, value, allowed values, and line number."""

import difflib
import json
import re
import typing
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from dusttaichi.errors import DustError

Path = tuple[str | int, ...]
MOST_LINES, LONGEST = 30, 1000  # lines of a message, characters of one
_FORM = {
    "tuple_type": "a list is needed",
    "dict_type": "a block is needed, a name and a value for each",
    "string_type": "a text is needed",
    "path_type": "a path is needed",
    "bool_type": "true or false is needed",
    "bool_parsing": "true or false is needed",
}


def refusal(title: str, found: list[str]) -> DustError:
    """The error for a scene with these faults, a line each; long ones are shortened."""
    shown = [line if len(line) <= LONGEST else _cut(line) for line in found[:MOST_LINES]]
    if len(found) > MOST_LINES + 1:  # else the last of them says so
        shown.append(_more(found))
    elif len(found) > MOST_LINES:
        shown.append(found[-1])
    return DustError("\n  ".join([f"{title} cannot be used:", *shown]))


def _cut(line: str) -> str:
    """The beginning of a line and its end, with the number of the line in the file."""
    return f"{line[: LONGEST - 100]} ... {line[-95:]}"


def describe(
    root: type[BaseModel], error: ValidationError, data: Any, lines: Mapping[Path, int]
) -> list[str]:
    """One line for each fault, in the order of the file; of very many the first, and a count."""
    found = []
    for item in error.errors(include_url=False):
        path = _path(item["loc"], data, item["type"] == "missing")
        if item["type"] == "problems":
            for below, text in item["ctx"]["found"]:
                keys = tuple(int(k) if k.isdigit() else k for k in below.split(".") if k)
                found.append(((*path, *keys), text))
        else:
            if item["type"] == "union_tag_invalid":
                path = (*path, item["ctx"]["discriminator"].strip("'"))
            found.append((path, item))
    found.sort(key=lambda entry: _line(entry[0], lines) or 0)
    texts = [
        line(path, what if isinstance(what, str) else _text(root, what, data), data, lines)
        for path, what in found[:MOST_LINES]
    ]
    return texts + [_more(found)] * (len(found) > MOST_LINES)


def _more(found: list) -> str:
    return f"and {len(found) - MOST_LINES} more"


def line(path: Path, text: str, data: Any, lines: Mapping[Path, int]) -> str:
    """Line about one fault.

    Example: 'boundary.wall_speed = "1 cm": a speed is needed, for example "1 cm/s" (line 14)'.
    """
    number = _line(path, lines)
    where = f"  (line {number})" if number else ""
    return f"{dotted(path)}{_value(path, data)}: {text}{where}"


def dotted(path: Path) -> str:
    """Text of a path, such as sample.positions[3]."""
    text = ""
    for key in path:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text or "scene"


def _line(path: Path, lines: Mapping[Path, int]) -> int | None:
    """Line number of the path, or of the nearest block around it, up to the whole scene."""
    for length in range(len(path), -1, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def _step(data: Any, key: str | int) -> tuple[bool, Any]:
    if isinstance(data, Mapping) and key in data:
        return True, data[key]
    if isinstance(data, (list, tuple)) and isinstance(key, int) and key < len(data):
        return True, data[key]
    return False, None


def _path(loc: Path, data: Any, missing: bool) -> Path:
    """Path in the file, without the names of union members that pydantic adds to it."""
    path: list[str | int] = []
    for index, key in enumerate(loc):
        present, below = _step(data, key)
        if present:
            path.append(key)
            data = below
        elif missing and index == len(loc) - 1:
            path.append(key)
    return tuple(path)


def _value(path: Path, data: Any) -> str:
    for key in path:
        present, data = _step(data, key)
        if not present:
            return ""
    if not path or isinstance(data, Mapping):
        return ""
    text = json.dumps(data, ensure_ascii=False, default=str)
    return f" = {text if len(text) <= 70 else text[:67] + '...'}"


def _text(root: type[BaseModel], item: dict, data: Any) -> str:
    kind, ctx = item["type"], item.get("ctx", {})
    if kind == "missing":
        return f"it is missing{_hint(root, item['loc'], data)}"
    if kind == "extra_forbidden":
        return _unknown(root, item["loc"], data)
    if kind == "literal_error":
        return f"{_guess(item['input'], ctx['expected'])}{_either(ctx['expected'])} is needed"
    if kind == "union_tag_invalid":
        tags = ctx["expected_tags"]
        return f"{_elsewhere(ctx['tag'], tags)}{_either(tags)} is needed"
    if kind == "union_tag_not_found":
        key = ctx["discriminator"].strip("'")
        blocks = _blocks(root, item["loc"], data)
        tags = [repr(typing.get_args(b.model_fields[key].annotation)[0]) for b in blocks]
        return f"{key} is missing, {_either(', '.join(tags))} is needed"
    if kind in ("model_type", "model_attributes_type"):
        return _block_needed(_blocks(root, item["loc"], data), item["input"])
    return _FORM.get(kind, item["msg"])


def _block_needed(blocks: list[type[BaseModel]], given: Any) -> str:
    """Advice where a block is needed; `given` may be the kind of one of them."""
    for key in ("kind", "model"):
        for block in blocks:
            item = block.model_fields.get(key)
            if item is not None and given in typing.get_args(item.annotation):
                return f"a block is needed, for example {{{key}: {given}}}"
    keys = [name for block in blocks for name in block.fields_in_order()]
    return f"a block is needed, with keys from {', '.join(dict.fromkeys(keys))}"


def _words(expected: str) -> list[str]:
    return re.findall(r"'([^']*)'", expected)


def _guess(given: Any, expected: str) -> str:
    """A question about the intended word, where one is similar."""
    close = difflib.get_close_matches(str(given), _words(expected), 1)
    return f'did you mean "{close[0]}"? ' if close else ""


# kinds of samples of grains -> equivalent ones of the continuum
EQUIVALENT = {
    **dict.fromkeys(("collision", "pair"), ("impact", "several")),
    **dict.fromkeys(("rbd", "pca", "bcca", "lattice", "random_packing"), ("block", "sphere")),
}


def _elsewhere(given: Any, expected: str) -> str:
    """As `_guess`; for a kind of the other method its equivalents here."""
    names = [name for name in EQUIVALENT.get(str(given), ()) if name in _words(expected)]
    if not names:
        return _guess(given, expected)
    quoted = " or ".join(f'"{name}"' for name in names)
    return f'"{given}" is a kind of single grains; use {quoted} here: '


def _either(expected: str) -> str:
    """'a', 'b' -> "a" or "b", with the quotes of the other texts."""
    quoted = [f'"{word}"' for word in _words(expected)]
    return " or ".join([", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)


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


def _blocks(root: type[BaseModel], loc: Path, data: Any) -> list[type[BaseModel]]:
    """The blocks that are allowed at a location of the data.

    A union member's name in it, or the name of a registered law in the data, selects one.
    """
    blocks = [root]
    for key in loc:
        present, value = _step(data, key)
        data = value if present else data  # the names of union members are not in it
        below = [
            member
            for block in blocks
            if key in block.model_fields
            for member in _chosen(block.model_fields[key], data)
        ]
        named = [block for block in blocks if key in _tags(block)]
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


def _tags(block: type[BaseModel]) -> set[str]:
    fields = [block.model_fields[name] for name in ("kind", "model") if name in block.model_fields]
    return {tag for item in fields for tag in typing.get_args(item.annotation)}


def _hint(root: type[BaseModel], loc: Path, data: Any) -> str:
    """Hint at the value of a missing key."""
    for block in _blocks(root, loc[:-1], data):
        item = block.model_fields.get(str(loc[-1]))
        if item is None:
            continue
        for mark in item.metadata:
            if hasattr(mark, "needed"):
                return f"; {mark.needed}"
        if item.description:
            return f" ({item.description})"
    return ""


def _unknown(root: type[BaseModel], loc: Path, data: Any) -> str:
    key, blocks = str(loc[-1]), _blocks(root, loc[:-1], data)
    for block in blocks:
        if key in block.refused:
            return block.refused[key]
    known = [name for block in blocks for name in (*block.extra_keys, *block.fields_in_order())]
    close = difflib.get_close_matches(key, known, 1)
    if close:
        guess = f'did you mean "{close[0]}"? '
    else:
        here = {str(part) for part in loc}  # with the names of the kinds on the way
        homes = [home for home in _homes(root, key) if not set(home.split(".")) <= here]
        guess = f"did you mean {homes[0]}? " if homes else ""
    return f"unknown key; {guess}allowed: {', '.join(dict.fromkeys(known))}"


def _homes(block: type[BaseModel], key: str, path: Path = (), around: tuple = ()) -> list[str]:
    """Paths of all keys of that name in the scene, outside of blocks in themselves.

    around: the blocks that contain this one.
    """
    found, around = [], (*around, block)
    for name, item in block.model_fields.items():
        if name == key and path:
            found.append(dotted((*path, name)))
        for member in choices(item):
            if member not in around:
                found += _homes(member, key, (*path, name), around)
    return found
