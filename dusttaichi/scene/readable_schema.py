"""JSON Schema with readable errors in editors: `if` and `then` in place of alternatives.

For `oneOf` and `anyOf` a validator reports only "not valid under any of the given schemas". With
`if` and `then` it checks the intended alternative and reports its errors: the one of that `kind`
(pydantic names the key in `discriminator`, which validators do not know), of that method, a block
rather than a word.
"""

from typing import Any

NOTHING = {"type": "null"}


def readable(schema: dict[str, Any], blocks: dict[str, Any]) -> Any:
    """The schema with alternatives selected by `if` and `then`. blocks: its `$defs`."""
    if isinstance(schema, list):
        return [readable(part, blocks) for part in schema]
    if not isinstance(schema, dict):
        return schema
    found = {key: readable(part, blocks) for key, part in schema.items()}
    if "discriminator" in found and "oneOf" in found:
        mark = found.pop("discriminator")
        found.pop("oneOf")
        options = {name: {"$ref": place} for name, place in mark["mapping"].items()}
        return {**found, **by_key(mark["propertyName"], options)}
    for word in ("anyOf", "oneOf"):
        if word in found:
            parts = found.pop(word)
            return {**found, **_by_type(word, parts, blocks)}
    return found


def by_key(key: str, options: dict[str, Any], default: str | None = None) -> dict[str, Any]:
    """One of several blocks, selected by the value of a key; default: without the key."""
    chosen = [
        {"if": _has(key, [name]), "then": part} for name, part in options.items() if name != default
    ]
    out = {"type": "object", "properties": {key: {"enum": list(options)}}}
    if default is None:
        return {**out, "required": [key], "allOf": chosen}
    others = [name for name in options if name != default]
    rest = {"if": _has(key, others), "else": options[default]}
    return {**out, "allOf": [*chosen, rest]}


def _has(key, values):
    return {"properties": {key: {"enum": values}}, "required": [key]}


def _by_type(word, parts, blocks):
    """Alternatives of which one or two are blocks, selected by the type of the value."""
    own = [part for part in parts if _is_block(part, blocks)]
    others = [part for part in parts if part not in own]
    based = [part for part in own if "base" in part.get("required", ())]
    if len(own) == 1:
        block = own[0]
    elif len(own) == 2 and len(based) == 1:
        rest = own[0] if own[1] is based[0] else own[1]
        block = {"if": {"required": ["base"]}, "then": based[0], "else": rest}
    elif not own and len(parts) > 1 and NOTHING in parts:
        rest = [part for part in parts if part != NOTHING]
        return {"if": NOTHING, "then": {}, "else": rest[0] if len(rest) == 1 else {word: rest}}
    else:
        return {word: parts}
    if not others:
        return block
    rest = others[0] if len(others) == 1 else {"anyOf": others}
    return {"if": {"type": "object"}, "then": block, "else": rest}


def _is_block(part, blocks):
    if "$ref" in part:
        part = blocks.get(part["$ref"].rsplit("/", 1)[-1], {})
    return part.get("type") == "object"
