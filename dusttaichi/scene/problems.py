"""Error messages from pydantic's errors: path, value, allowed values, and line number."""

import json
import typing
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from dusttaichi.errors import DustError
from dusttaichi.scene.blocks import TAGS, Path, blocks_at, dotted, path_in, step
from dusttaichi.scene.suggestions import (
    either,
    guess,
    kind_elsewhere,
    name_elsewhere,
    unknown_key,
)

MOST_LINES, LONGEST = 30, 1000  # lines of a message, characters of one
_FORM = {
    "tuple_type": "a list is needed",
    "dict_type": "a block is needed, a name and a value for each",
    "string_type": "a text is needed",
    "path_type": "a path is needed",
    "bool_type": "true or false is needed",
    "bool_parsing": "true or false is needed",
}
_TEXTS = ("text_needed", "string_type", "path_type")  # errors where a text is needed
_READ_AS = {bool: "true or false", type(None): "nothing"}


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
        path = path_in(item["loc"], data, item["type"] == "missing")
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
        line(path, _fault(root, what, path, data, lines), data, lines)
        for path, what in found[:MOST_LINES]
    ]
    return texts + [_more(found)] * (len(found) > MOST_LINES)


def _fault(
    root: type[BaseModel], what: str | dict, path: Path, data: Any, lines: Mapping[Path, int]
) -> str:
    """Text about a fault: of an error of pydantic, or of a block about one of its keys."""
    if isinstance(what, str):
        return name_elsewhere(root, path, data) + what
    text = _text(root, what, data)
    if what["type"] in _TEXTS and not isinstance(what["input"], (str, list, tuple, dict)):
        kind = _READ_AS.get(type(what["input"]), "a number")
        return f'YAML reads {kind}; put it in quotes, "{_written(path, data, lines)}"; {text}'
    return name_elsewhere(root, path, data) + text if what["type"] == "needed" else text


def _more(found: list) -> str:
    return f"and {len(found) - MOST_LINES} more"


def line(path: Path, text: str, data: Any, lines: Mapping[Path, int]) -> str:
    """Line about one fault.

    Example: 'boundary.wall_speed = "1 cm": a speed is needed, for example "1 cm/s" (line 14)'.
    """
    number = _line(path, lines)
    where = f"  (line {number})" if number else ""
    return f"{dotted(path)}{_value(path, data, lines)}: {text}{where}"


def _line(path: Path, lines: Mapping[Path, int]) -> int | None:
    """Line number of the path, or of the nearest block around it, up to the whole scene."""
    for length in range(len(path), -1, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def _value(path: Path, data: Any, lines: Mapping[Path, int]) -> str:
    text = _written(path, data, lines)
    return f" = {text if len(text) <= 70 else text[:67] + '...'}" if text else ""


def _written(path: Path, data: Any, lines: Mapping[Path, int]) -> str:
    """The value at a path as the file has it; nothing for a block, or for a key without a value."""
    for key in path:
        present, data = step(data, key)
        if not present:
            return ""
    if not path or isinstance(data, Mapping):
        return ""
    as_read = json.dumps(data, ensure_ascii=False, default=str)
    return getattr(lines, "texts", {}).get(path, as_read)


def _text(root: type[BaseModel], item: dict, data: Any) -> str:
    kind, ctx = item["type"], item.get("ctx", {})
    if kind == "missing":
        return f"it is missing{_hint(root, item['loc'], data)}"
    if kind == "extra_forbidden":
        return unknown_key(root, item["loc"], data)
    if kind == "literal_error":
        return f"{guess(item['input'], ctx['expected'])}{either(ctx['expected'])} is needed"
    if kind == "union_tag_invalid":
        tags = ctx["expected_tags"]
        return (
            f"{kind_elsewhere(root, item['loc'], ctx['tag'], tags, data)}{either(tags)} is needed"
        )
    if kind == "union_tag_not_found":
        key = ctx["discriminator"].strip("'")
        blocks = blocks_at(root, item["loc"], data)
        tags = [repr(typing.get_args(b.model_fields[key].annotation)[0]) for b in blocks]
        return f"{key} is missing, {either(', '.join(tags))} is needed"
    if kind in ("model_type", "model_attributes_type"):
        return _block_needed(blocks_at(root, item["loc"], data), item["input"])
    return _FORM.get(kind, item["msg"])


def _block_needed(blocks: list[type[BaseModel]], given: Any) -> str:
    """Advice where a block is needed; `given` may be the kind of one of them."""
    for key in TAGS:
        for block in blocks:
            item = block.model_fields.get(key)
            if item is not None and given in typing.get_args(item.annotation):
                return f"a block is needed, for example {{{key}: {given}}}"
    keys = [name for block in blocks for name in block.fields_in_order()]
    return f"a block is needed, with keys from {', '.join(dict.fromkeys(keys))}"


def _hint(root: type[BaseModel], loc: Path, data: Any) -> str:
    """Hint at the value of a missing key."""
    for block in blocks_at(root, loc[:-1], data):
        item = block.model_fields.get(str(loc[-1]))
        if item is None:
            continue
        for mark in item.metadata:
            if hasattr(mark, "needed"):
                return f"; {mark.needed}"
        if item.description:
            return f" ({item.description})"
    return ""
