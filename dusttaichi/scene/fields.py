"""Parts of all blocks of a scene: the frozen base class, plain numbers, on/off switches, files."""

import re
import stat
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeAlias

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    model_validator,
)
from pydantic_core import PydanticCustomError, core_schema

from dusttaichi.errors import DustError
from dusttaichi.scene.blocks import Keys
from dusttaichi.scene.paths import user_path

if TYPE_CHECKING:
    from typing_extensions import Self

    def Field(default: Any = ..., **options: Any) -> Any:
        """Field of pydantic, with a default as in the YAML: a text where the value is a number."""
else:
    from pydantic import Field as Field

Faults = Iterable[tuple[str, str]]  #: Faults of an input, as (dotted path of the key, text).
AnyScene: TypeAlias = Any  #: Scene of any method, whose classes import the blocks.
JsonSchema = dict[str, Any]
CoreSchema = core_schema.CoreSchema
CoreHandler = GetCoreSchemaHandler
JsonHandler = GetJsonSchemaHandler


class Block(Keys):
    """A frozen block of the YAML file; unknown keys are refused, and all of its `faults`."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True, defer_build=True)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: CoreHandler) -> CoreSchema:
        schema = handler(source)
        inner: Any = handler.resolve_ref_schema(schema)
        while inner["type"] != "model-fields":  # within validators of the block
            inner = inner["schema"]
        inner["fields"] = {name: inner["fields"][name] for name in cls.fields_in_order()}
        return schema

    def faults(self) -> Faults:
        """Conflicts between the keys of this block; the paths are relative to it."""
        return ()

    @model_validator(mode="after")
    def _refuse_faults(self) -> "Self":
        type(self).model_rebuild()  # pydantic < 2.14 builds serializers of nested blocks never
        if faults := list(self.faults()):
            raise build_faults_error(faults)
        return self

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):  # private, not of the YAML
            return super().__setattr__(name, value)
        from dusttaichi.scene.keys import find_key_path  # which imports this module

        path = find_key_path(type(self), name)
        raise DustError(
            f"{path}: a scene is immutable; scene.with_value({path!r}, ...) returns a changed one"
        )

    def __hash__(self) -> int:
        values = (getattr(self, name) for name in type(self).model_fields)
        return hash(tuple(frozenset(v.items()) if isinstance(v, dict) else v for v in values))


class NamedBlock(Block):
    """A block that may be written as one of its WORDS, each of which sets some of its numbers."""

    WORDS: ClassVar[dict[str, dict[str, Any]]]
    requirement: ClassVar[str]

    @model_validator(mode="before")
    @classmethod
    def _expand(cls, data: Any) -> Any:
        if isinstance(data, (dict, cls)):
            return data
        if not isinstance(data, str) or data not in cls.WORDS:
            raise build_value_error(cls.requirement)
        return cls.WORDS[data]

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        block = handler.resolve_ref_schema(handler(schema))
        return {"description": cls.__doc__, "anyOf": [{"enum": list(cls.WORDS)}, block]}


# Marks a key with two forms: a value with Tag("plain"), and a block with Tag("block").
PLAIN_OR_BLOCK = Discriminator(
    lambda value: "block" if isinstance(value, (dict, Block)) else "plain"
)


@dataclass(frozen=True)
class NameLike:
    """Marks a name that matches a pattern; text: of the error for other values."""

    pattern: str
    text: str

    def _check(self, value: Any) -> str:
        if not isinstance(value, str):
            raise PydanticCustomError("text_needed", "{text}", {"text": self.text})
        if not re.fullmatch(self.pattern, value):
            raise build_value_error(self.text)
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: CoreHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        return {"type": "string", "pattern": self.pattern}


def in_order_of(names: tuple[str, ...]) -> AfterValidator:
    """Mark of a list of some of these names, which is stored in their order."""
    return AfterValidator(lambda value: tuple(name for name in names if name in value))


class Mark:
    """Mark of a field that `_validate` reads from the YAML and `_serialize` writes for it."""

    if TYPE_CHECKING:

        def _validate(self, value: Any) -> Any:
            """The value in SI."""

        def _serialize(self, value: Any) -> Any:
            """The value as the YAML has it."""

    def __get_pydantic_core_schema__(self, source: Any, handler: CoreHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self._validate,
            serialization=core_schema.plain_serializer_function_ser_schema(
                self._serialize, when_used="json"
            ),
        )


def build_value_error(text: str) -> PydanticCustomError:
    """An error whose text ends the line 'path = value: ...'."""
    return PydanticCustomError("needed", "{text}", {"text": text})


def build_faults_error(faults: list[tuple[str, str]]) -> PydanticCustomError:
    """An error about several keys at once, from the `Faults` of a block."""
    text = "; ".join(f"{path}: {message}" for path, message in faults)
    return PydanticCustomError("problems", "{text}", {"text": text, "found": faults})


# Least and largest size of plain numbers other than 0: all that can be computed with.
LEAST, MOST, MOST_WHOLE = 1e-25, 1e12, 10**15
BOUNDS = {"gt": "above", "ge": "of at least", "lt": "below", "le": "at most"}


@dataclass(frozen=True)
class Number:
    """Marks a field that is a plain number, finite, within bounds; a word may be allowed too.

    pydantic checks the bounds; the error states what is allowed. note: its end.
    """

    whole: bool = False
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None
    word: str | None = None
    note: str = ""

    @property
    def requirement(self) -> str:
        """Allowed values, as the end of an error message."""
        limits = [
            f" {words} {getattr(self, key):.12g}"
            for key, words in BOUNDS.items()
            if getattr(self, key) is not None
        ]
        noun = "a whole number" if self.whole else "a number"
        word = f'"{self.word}" or ' if self.word else ""
        return f"{word}{noun}{' and'.join(limits)} is needed{self.note}"

    def _read(self, value: Any) -> Any:
        # YAML 1.1 readers return 1e-3 as text, NumPy has its own types of numbers, 1e6 is whole.
        if hasattr(value, "item"):
            value = value.item()
        if isinstance(value, str) and value != self.word:
            with suppress(ValueError):
                value = float(value)
        if self.whole and isinstance(value, float) and value.is_integer():
            return int(value)
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: CoreHandler) -> CoreSchema:
        bounds = {key: getattr(self, key) for key in BOUNDS if getattr(self, key) is not None}
        schema: CoreSchema
        if self.whole:
            schema = core_schema.int_schema(strict=True, **bounds)
        else:
            schema = core_schema.float_schema(strict=True, allow_inf_nan=False, **bounds)
        if self.word is not None:
            schema = core_schema.union_schema([core_schema.literal_schema([self.word]), schema])
        checked_schema = core_schema.custom_error_schema(
            core_schema.no_info_before_validator_function(self._read, schema),
            custom_error_type="needed",
            custom_error_message="{text}",
            custom_error_context={"text": self.requirement},
        )
        return core_schema.no_info_after_validator_function(self._check_size, checked_schema)

    def _check_size(self, value: Any) -> Any:
        """The value, if it is of a size that can be computed with."""
        if isinstance(value, str) or not value:
            return value
        if self.whole and abs(value) > MOST_WHOLE:
            raise build_value_error(f"it is too large; at most {MOST_WHOLE:g} can be computed with")
        if not self.whole and not LEAST <= abs(value) <= MOST:
            raise build_value_error(f"it cannot be computed with ({LEAST:g} to {MOST:g} can)")
        return value


@dataclass(frozen=True)
class Switch:
    """Marks an optional block that may be written `off` (None) and, if `on` is set, `on`.

    `auto`: the word auto is allowed too, and remains. YAML 1.1 readers turn off and on into false
    and true, 1.2 readers leave the words. Both count.
    """

    requirement: str
    on: bool = False
    auto: bool = False

    def write_default(self, value: Any) -> str:
        """A default as the YAML has it."""
        return "off" if value is None else value if isinstance(value, str) else "on"

    def _word(self, value: Any, read: Any) -> Any:
        return value if self.auto and value == "auto" else read(value)

    def _read(self, value: Any) -> Any:
        if value is None or value is False or value == "off":
            return None
        if self.on and (value is True or value == "on"):
            return {}
        if isinstance(value, (dict, BaseModel)):
            return value
        raise build_value_error(self.requirement)

    def __get_pydantic_core_schema__(self, source: Any, handler: CoreHandler) -> CoreSchema:
        inner = handler(source)
        words = {None: "off", "auto": "auto"}
        block = core_schema.no_info_before_validator_function(self._read, inner)
        return core_schema.no_info_wrap_validator_function(
            self._word,
            block,
            serialization=core_schema.wrap_serializer_function_ser_schema(
                lambda value, write: (
                    words[value] if value is None or isinstance(value, str) else write(value)
                ),
                schema=inner,
                when_used="json",
            ),
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        block = handler(schema)
        words: list[str | bool] = ["on", True, "off", False] if self.on else ["off", False]
        words += ["auto"] if self.auto else []
        return {"anyOf": [*block.get("anyOf", [block]), {"enum": words}]}


Count = Annotated[int, Number(whole=True, ge=1)]
Seed = Annotated[int, Number(whole=True, ge=0, le=2**32 - 1)]
UserPath = Annotated[Path, AfterValidator(user_path)]


def refuse_unreadable(path: str | Path, max_bytes: float | None = None) -> None:
    """Raise ValueError if `path` is not a regular file of at most `most` bytes.

    It is not opened, because a pipe may block. FileNotFoundError if it does not exist.
    """
    try:
        status = Path(path).stat()
    except FileNotFoundError:
        raise
    except OSError as error:  # a loop of links, a name that is too long
        raise ValueError(f"it cannot be read ({error.strerror})") from None
    if not stat.S_ISREG(status.st_mode):
        raise ValueError(f"it is a {'directory' if Path(path).is_dir() else 'device or a pipe'}")
    if max_bytes is not None and status.st_size > max_bytes:
        raise ValueError(f"it has {status.st_size:,} bytes, {int(max_bytes):,} are allowed")
