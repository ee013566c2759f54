"""Error messages from pydantic's errors: path, value, allowed values, and line number."""

import json
import typing
from collections.abc import Mapping, Sized
from typing import Any

from pydantic import ValidationError

from dusttaichi.errors import DustError
from dusttaichi.scene.blocks import (
    TAGS,
    Keys,
    Path,
    find_blocks,
    format_path,
    get_item,
    strip_union_members,
)
from dusttaichi.scene.suggestions import (
    describe_unknown_key,
    join_alternatives,
    suggest_kind,
    suggest_method,
    suggest_value,
)

Error = Mapping[str, Any]  # an error of pydantic
MOST_LINES, LONGEST = 30, 1000  # lines of a message, characters of one
_FORM = {
    "tuple_type": "a list is needed, in [ ] or with a dash before each entry",
    "dict_type": "a block is needed, a name and a value for each",
    "string_type": "a text is needed",
    "path_type": "a path is needed",
    "bool_type": "true or false is needed",
    "bool_parsing": "true or false is needed",
}
_TEXTS = ("text_needed", "string_type", "path_type")  # errors where a text is needed
_READ_AS = {bool: "true or false", type(None): "nothing"}


def build_refusal(title: str, problem_lines: list[str]) -> DustError:
    """The error for a scene with a line for each of its faults; long lines are shortened."""
    shown_lines = [
        line if len(line) <= LONGEST else _shorten(line) for line in problem_lines[:MOST_LINES]
    ]
    if len(problem_lines) > MOST_LINES + 1:  # otherwise the last line is such a count
        shown_lines.append(_count_more(problem_lines))
    elif len(problem_lines) > MOST_LINES:
        shown_lines.append(problem_lines[-1])
    return DustError("\n  ".join([f"{title} cannot be used:", *shown_lines]))


def _shorten(line: str) -> str:
    """The beginning of a line and its end, with the number of the line in the file."""
    return f"{line[: LONGEST - 100]} ... {line[-95:]}"


def describe(
    root: type[Keys], error: ValidationError, data: Any, lines: Mapping[Path, int]
) -> list[str]:
    """One line for each fault, in the order of the file; of many the first ones and a count."""
    faults_by_path = []
    for item in error.errors(include_url=False):
        path = strip_union_members(item["loc"], data, item["type"] == "missing")
        if item["type"] == "problems":
            for below, text in item["ctx"]["found"]:
                keys = tuple(int(k) if k.isdigit() else k for k in below.split(".") if k)
                faults_by_path.append(((*path, *keys), text))
        else:
            if item["type"] == "union_tag_invalid":
                path = (*path, item["ctx"]["discriminator"].strip("'"))
            faults_by_path.append((path, item))
    faults_by_path.sort(key=lambda entry: _find_line(entry[0], lines) or 0)
    texts = [
        format_line(path, _describe_fault(root, fault, path, data, lines), data, lines)
        for path, fault in faults_by_path[:MOST_LINES]
    ]
    return texts + [_count_more(faults_by_path)] * (len(faults_by_path) > MOST_LINES)


def _describe_fault(
    root: type[Keys], fault: str | Error, path: Path, data: Any, lines: Mapping[Path, int]
) -> str:
    """Text about a fault: an error of pydantic (a dict), or the text of a block about a key."""
    if isinstance(fault, str):
        return suggest_method(root, path, data) + fault
    text = _describe_error(root, fault, data)
    if fault["type"] in _TEXTS and not isinstance(fault["input"], (str, list, tuple, dict)):
        read_type = _READ_AS.get(type(fault["input"]), "a number")
        return (
            f'YAML reads {read_type}; put it in quotes, "{_write_value(path, data, lines)}"; {text}'
        )
    return suggest_method(root, path, data) + text if fault["type"] == "needed" else text


def _count_more(problem_lines: Sized) -> str:
    return f"and {len(problem_lines) - MOST_LINES} more"


def format_line(path: Path, text: str, data: Any, lines: Mapping[Path, int]) -> str:
    """Line about one fault.

    Example: 'boundary.wall_speed = "1 cm": a speed is needed, for example "1 cm/s" (line 14)'.
    """
    number = _find_line(path, lines)
    location = f"  (line {number})" if number else ""
    return f"{format_path(path)}{_format_value(path, data, lines)}: {text}{location}"


def _find_line(path: Path, lines: Mapping[Path, int]) -> int | None:
    """Line number of the path, or of the nearest block around it, up to the whole scene."""
    for length in range(len(path), -1, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def _format_value(path: Path, data: Any, lines: Mapping[Path, int]) -> str:
    text = _write_value(path, data, lines)
    return f" = {text if len(text) <= 70 else text[:67] + '...'}" if text else ""


def _write_value(path: Path, data: Any, lines: Mapping[Path, int]) -> str:
    """The value at a path as written in the file; "" for a block or a key without a value."""
    for key in path:
        present, data = get_item(data, key)
        if not present:
            return ""
    if not path or isinstance(data, Mapping):
        return ""
    as_read = json.dumps(data, ensure_ascii=False, default=str)
    texts: Mapping[Path, str] = getattr(lines, "texts", {})
    return texts.get(path, as_read)


def _describe_error(root: type[Keys], item: Error, data: Any) -> str:
    error_type, ctx = item["type"], item.get("ctx", {})
    if error_type == "missing":
        return f"it is missing{_hint_at_value(root, item['loc'], data)}"
    if error_type == "extra_forbidden":
        return describe_unknown_key(root, item["loc"], data)
    if error_type == "literal_error":
        expected = ctx["expected"]
        return f"{suggest_value(item['input'], expected)}{join_alternatives(expected)} is needed"
    if error_type == "union_tag_invalid":
        tags = ctx["expected_tags"]
        suggestion = suggest_kind(root, item["loc"], ctx["tag"], tags, data)
        return f"{suggestion}{join_alternatives(tags)} is needed"
    if error_type == "union_tag_not_found":
        key = ctx["discriminator"].strip("'")
        blocks = find_blocks(root, item["loc"], data)
        tags = [repr(typing.get_args(b.model_fields[key].annotation)[0]) for b in blocks]
        return f"{key} is missing, {join_alternatives(', '.join(tags))} is needed"
    if error_type in ("model_type", "model_attributes_type"):
        return _advise_block(find_blocks(root, item["loc"], data), item["input"])
    return _FORM.get(error_type, str(item["msg"]))


def _advise_block(blocks: list[type[Keys]], value: Any) -> str:
    """Advice where a block is needed; `value` may be the kind of one of them."""
    for key in TAGS:
        for block in blocks:
            item = block.model_fields.get(key)
            if item is not None and value in typing.get_args(item.annotation):
                return f"a block is needed, for example {{{key}: {value}}}"
    keys = [name for block in blocks for name in block.fields_in_order()]
    return f"a block is needed, with keys from {', '.join(dict.fromkeys(keys))}"


def _hint_at_value(root: type[Keys], loc: Path, data: Any) -> str:
    """Hint at the value of a missing key."""
    for block in find_blocks(root, loc[:-1], data):
        item = block.model_fields.get(str(loc[-1]))
        if item is None:
            continue
        for mark in item.metadata:
            if hasattr(mark, "requirement"):
                return f"; {mark.requirement}"
        if item.description:
            return f" ({item.description})"
    return ""
