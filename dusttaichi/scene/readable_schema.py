"""JSON Schema with readable errors in editors: `if` and `then` in place of alternatives.

For `oneOf` and `anyOf` a validator reports only "not valid under any of the given schemas". With
`if` and `then` it checks the intended alternative and reports its errors: the one of that `kind`
(pydantic names the key in `discriminator`, which validators do not know), of that method, a block
rather than a word.
"""

from typing import Any

NOTHING = {"type": "null"}


def make_readable(schema: dict[str, Any], blocks: dict[str, Any]) -> Any:
    """The schema with alternatives selected by `if` and `then`. blocks: its `$defs`."""
    if isinstance(schema, list):
        return [make_readable(item, blocks) for item in schema]
    if not isinstance(schema, dict):
        return schema
    readable_parts = {key: make_readable(item, blocks) for key, item in schema.items()}
    if "discriminator" in readable_parts and "oneOf" in readable_parts:
        discriminator = readable_parts.pop("discriminator")
        readable_parts.pop("oneOf")
        options = {
            name: {"$ref": reference} for name, reference in discriminator["mapping"].items()
        }
        return {**readable_parts, **select_by_key(discriminator["propertyName"], options)}
    for word in ("anyOf", "oneOf"):
        if word in readable_parts:
            alternatives = readable_parts.pop(word)
            return {**readable_parts, **_select_by_type(word, alternatives, blocks)}
    return readable_parts


def select_by_key(key: str, options: dict[str, Any], default: str | None = None) -> dict[str, Any]:
    """One of several blocks, selected by the value of a key; default: without the key."""
    conditions = [
        {"if": _match_key(key, [name]), "then": block}
        for name, block in options.items()
        if name != default
    ]
    out = {"type": "object", "properties": {key: {"enum": list(options)}}}
    if default is None:
        return {**out, "required": [key], "allOf": conditions}
    other_names = [name for name in options if name != default]
    default_condition = {"if": _match_key(key, other_names), "else": options[default]}
    return {**out, "allOf": [*conditions, default_condition]}


def _match_key(key: str, values: list[str]) -> dict[str, Any]:
    return {"properties": {key: {"enum": values}}, "required": [key]}


def _select_by_type(word: str, alternatives: list[Any], blocks: dict[str, Any]) -> dict[str, Any]:
    """Alternatives of which one or two are blocks, selected by the type of the value."""
    block_schemas = [schema for schema in alternatives if _is_block(schema, blocks)]
    value_schemas = [schema for schema in alternatives if schema not in block_schemas]
    with_base = [schema for schema in block_schemas if "base" in schema.get("required", ())]
    block: dict[str, Any]
    if len(block_schemas) == 1:
        block = block_schemas[0]
    elif len(block_schemas) == 2 and len(with_base) == 1:
        remaining = block_schemas[0] if block_schemas[1] is with_base[0] else block_schemas[1]
        block = {"if": {"required": ["base"]}, "then": with_base[0], "else": remaining}
    elif not block_schemas and len(alternatives) > 1 and NOTHING in alternatives:
        remaining = [schema for schema in alternatives if schema != NOTHING]
        return {
            "if": NOTHING,
            "then": {},
            "else": remaining[0] if len(remaining) == 1 else {word: remaining},
        }
    else:
        return {word: alternatives}
    if not value_schemas:
        return block
    remaining = value_schemas[0] if len(value_schemas) == 1 else {"anyOf": value_schemas}
    return {"if": {"type": "object"}, "then": block, "else": remaining}


def _is_block(schema: dict[str, Any], blocks: dict[str, Any]) -> bool:
    if "$ref" in schema:
        schema = blocks.get(schema["$ref"].rsplit("/", 1)[-1], {})
    return bool(schema.get("type") == "object")
