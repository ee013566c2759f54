"""Laws that a block chooses by name, those of files that a scene names among them."""

from collections.abc import Callable
from typing import Any, Protocol

from dusttaichi.scene.fields import Block, CoreSchema, JsonHandler, JsonSchema, build_faults_error


class NamedLaws(Protocol):
    """Module of the laws of a subject, by kind and name."""

    @property
    def names(self) -> Callable[[str], tuple[str, ...]]:
        """Names of the laws of a kind."""

    @property
    def block_of(self) -> Callable[[str, str], type[Any] | None]:
        """Block of a registered law; None of a built-in one."""


def validate_law(registry: NamedLaws, kind: str, value: Any, key: str = "law") -> Block | None:
    """Block of a registered law; None for a built-in one, or where none is named.

    key: of the name in the block. Raises an error at it for a name that there is not.
    """
    name = value.get(key) if isinstance(value, dict) else getattr(value, key, None)
    if not isinstance(name, str):
        return None
    if name not in registry.names(kind):
        names = ", ".join(registry.names(kind))
        raise build_faults_error(
            [(key, f"{names} is needed, or the name of a law that is registered")]
        )
    block = registry.block_of(kind, name)
    return None if block is None else block.model_validate(value)


class RegisteredLaws:
    """Mark of a field: adds the blocks of the registered laws of a kind to its JSON Schema."""

    def __init__(self, registry: NamedLaws, kind: str, key: str = "law"):
        self.registry, self.kind, self.key = registry, kind, key

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        built_in_schema, blocks = handler(schema), self.build_schemas()
        return (
            {"anyOf": [*built_in_schema.get("anyOf", [built_in_schema]), *blocks]}
            if blocks
            else built_in_schema
        )

    def build_schemas(self) -> list[JsonSchema]:
        """JSON Schemas of the blocks of the registered laws."""
        names = self.registry.names(self.kind)
        blocks = [(name, self.registry.block_of(self.kind, name)) for name in names]
        return [self._build_schema(name, block) for name, block in blocks if block is not None]

    def block_of(self, value: Any) -> type[Block] | None:
        """Block of the registered law that a value of the YAML names; None for others."""
        name = value.get(self.key) if isinstance(value, dict) else None
        if not isinstance(name, str) or name not in self.registry.names(self.kind):
            return None
        return self.registry.block_of(self.kind, name)

    def _build_schema(self, name: str, block: type[Block]) -> JsonSchema:
        schema = block.model_json_schema()
        if "$defs" in schema:  # a resource of its own, to which its references are relative
            schema["$id"] = f"urn:dusttaichi:{self.kind}:{name}"
        name_schema = {"const": name, "type": "string", "description": "name of the law"}
        schema["properties"] = {**schema["properties"], self.key: name_schema}
        schema["required"] = sorted({*schema.get("required", []), self.key})
        return schema
