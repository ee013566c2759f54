"""Quantities as people write them ('0.6 um', '20 mJ/m^2', '1 cm/s') to SI floats and back.

Numbers are scaled in decimal arithmetic, so that text -> float -> text -> float gives the same
float: 2.65 g/cm^3 is 2650.0 kg/m^3 and not 2649.9999999999995."""

import math
import operator
import re
from dataclasses import dataclass
from decimal import Decimal, DecimalException
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, cast

from dusttaichi.errors import DustError
from dusttaichi.scene.dimensions import DIMENSIONS
from dusttaichi.scene.fields import (
    BOUNDS,
    CoreSchema,
    JsonHandler,
    JsonSchema,
    Mark,
    build_value_error,
)

if TYPE_CHECKING:
    import pint

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_UNIT = r"[A-Za-zµμΩÅ°].*"
_PER = r"(?:(?:(?<=\s)1\s*)?/\s*)?"  # 20 1/s and 20/s are 20 s^-1, 201/s is not 20 1/s
_INVERSE = re.compile(r"^1?\s*/\s*([A-Za-zµμΩÅ°]+)")
# factors with their powers, and the signs between them; all else is refused
_POWER = r"\s*(?:\^|\*\*)\s*(?:\(\s*[+-]?\d+\s*\)|[+-]?\d+)|[+-]?\d+|[⁺⁻]?[⁰¹²³⁴-⁹]+"
_UNIT_TOKENS = re.compile(rf"[A-Za-zµμΩÅ°_Δ]+(?:{_POWER})?(?!\w|\.\d)|[*·⋅/()]|(?<!\S)1\s*(?=/)")
_QUANTITY = re.compile(
    rf"({_NUMBER}|[+-]?(?:nan|inf|infinity)\b)\s*({_PER}{_UNIT})?", re.IGNORECASE
)


@lru_cache(maxsize=1)
def _registry() -> "pint.UnitRegistry[Decimal]":
    # pint takes half a second to import and set up; only units that are not listed need it
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


@lru_cache(maxsize=1024)
def _parse_unit(unit: str) -> "pint.Unit":
    """pint's unit of a text. Raises ValueError if `unit` is not a unit, and nothing besides."""
    fault = f'"{unit}" is not a unit'
    if foreign := _UNIT_TOKENS.sub(" ", unit).split():  # pint drops some of them in silence
        raise ValueError(f'{fault} ("{foreign[0]}" does not belong in it)')
    registry = _registry()
    try:
        parsed = registry.parse_units(re.sub(r"([A-Za-zµμ])(-?\d)", r"\1^\2", unit))  # kg/m3, m s-1
        numbers = [
            name
            for name in registry.parse_units_as_container(str(parsed))
            if registry.get_root_units(name)[1] == registry.Unit("")
        ]
    except Exception as error:  # pint raises many types for what is not a unit
        raise ValueError(fault) from error
    if numbers:
        raise ValueError(f'{fault} ("{numbers[0]}" is a number)')
    return parsed


@lru_cache(maxsize=1024)
def _find_root_units(unit: str) -> tuple[Decimal, str]:
    """Factor to pint's root units, and these. Raises ValueError if `unit` is not a unit."""
    factor, root = _registry().get_root_units(_parse_unit(unit))
    return Decimal(cast(float, factor)), str(root)


def _find_zero(unit: str) -> Decimal:
    """Value of 0 `unit` in pint's root units: 273.15 of degC, 0 of units without an offset."""
    if str(_parse_unit(unit)).startswith("delta_"):
        raise ValueError(f'"{unit}" is a unit of differences')
    return Decimal(_registry().Quantity(Decimal(0), _parse_unit(unit)).to_root_units().magnitude)


@lru_cache(maxsize=1024)
def _find_scale(unit: str, dimension: str) -> tuple[Decimal, Decimal]:
    """Factor from this unit to SI, and the SI value of its 0. Raises ValueError as `_convert`."""
    definition, unit = DIMENSIONS[dimension], re.sub("[µμ](?=[A-Za-z])", "u", unit)
    if unit in definition.powers:  # most units: without waiting for pint
        return Decimal(1).scaleb(definition.powers[unit]), Decimal(0)
    factor, root = _find_root_units(unit)
    reference, reference_root = _find_root_units(definition.unit)
    if root != reference_root:
        raise ValueError("")
    return factor / reference, _find_zero(unit) / reference


def split_quantity(text: str) -> tuple[str, str | None] | None:
    """("0.6", "um") of "0.6 um", ("0.6", None) of a number without a unit, None of other texts."""
    match = _QUANTITY.fullmatch(text.strip())
    return match and (match[1], match[2])


def _convert(value: Any, dimension: str) -> float:
    """SI float of a text.

    Raises ValueError with the fault; an empty one where the text has another dimension or no
    number, so that the allowed values suffice as a message.
    """
    if not isinstance(value, str):
        bare = isinstance(value, (int, float)) and not isinstance(value, bool)
        raise ValueError("it has no unit" if bare else "")
    parts_of_text = split_quantity(value)
    if parts_of_text is None:
        comma = split_quantity(value.replace(",", ".", 1))
        raise ValueError("write a decimal point in place of the comma" if comma else "")
    number, unit = parts_of_text
    if unit is None:
        raise ValueError("it has no unit")
    factor, zero = _find_scale(_INVERSE.sub(r"\1^-1", unit.strip()), dimension)
    try:
        si = float(Decimal(number) * factor + zero)
    except DecimalException:  # an exponent beyond what decimal numbers have
        si = math.inf
    if not math.isfinite(si):
        raise ValueError("it is not a finite number")
    return si


def parse(value: Any, dimension: str, label: str = "value") -> float:
    """SI float of a text such as '0.6 um'.

    dimension: a key of DIMENSIONS. label: name of the value in the error.
    Raises DustError for a bare number, another dimension, an unknown unit, nan or inf.
    """
    try:
        return _convert(value, dimension)
    except ValueError as error:
        reason, definition = f"{error}; " if str(error) else "", DIMENSIONS[dimension]
        allowed = f'{definition.name} is needed, for example "{definition.example}"'
        raise DustError(f"{label} = {value!r}: {reason}{allowed}") from None


def _format_mantissa(number: Decimal) -> str:
    """The shorter one of 0.05 and 5e-2."""
    number = number.normalize()
    return min(f"{number:f}", f"{number:e}".replace("e+", "e"), key=len)


def _count_characters(text: str) -> int:
    """Length of the text of a quantity as people read it."""
    number = text.split()[0]
    return len(text) + 2 * ("e" in number or len(number.lstrip("-").split(".")[0]) > 3)


def format(value: float, dimension: str, digits: int | None = None) -> str:
    """Shortest readable text of an SI float, such as '0.6 um'; `parse` gives the same float back.

    A power of ten counts as two characters more: 0.6 um, not 6e-7 m. So do four digits before the
    point: 1.447 nm, not 1447 pm.
    digits: significant digits of a text for people to read, which is then not exact, and has the
    sign for micro in place of the letter on keyboards, 0.6 µm.
    """
    definition = DIMENSIONS[dimension]
    if value == 0:
        return f"0 {definition.unit}"
    number = Decimal(repr(float(value)))
    if not number.is_finite():
        return f"{float(value)} {definition.unit}"
    if digits is not None:
        number = Decimal(f"{number:.{digits - 1}e}")
    texts = [
        f"{_format_mantissa(number.scaleb(-power))} {unit}"
        for unit, power in definition.powers.items()
    ]
    text = min(texts, key=_count_characters)
    return text if digits is None else text.replace(" u", " µ").replace("/u", "/µ")


def format_rate(value: float) -> str:
    """ "8,299", "12.3", "0.41": steps a second, with three digits at least."""
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.3g}"


@dataclass(frozen=True)
class Quantity(Mark):
    """Marks a pydantic field that is written with a unit and stored as an SI float.

    gt, ge, lt, le: bounds in SI. word: a word allowed in place of the number ("auto", "fit"), or
    several. count: length of a list of quantities, stored as a tuple; with `spread` one applies to
    all of them, with `mixed` the word is allowed in the list. bare_unit: "um" means "1 um".
    """

    dimension: str
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None
    word: str | tuple[str, ...] | None = None
    count: int | None = None
    spread: bool = False
    mixed: bool = False
    bare_unit: bool = False
    example: str | None = None

    @property
    def unit(self) -> str:
        """SI unit of the stored value."""
        return DIMENSIONS[self.dimension].unit

    @property
    def words(self) -> tuple[str, ...]:
        """The words allowed in place of the number."""
        return (self.word,) if isinstance(self.word, str) else self.word or ()

    @property
    def requirement(self) -> str:
        """Allowed values, as the end of an error message."""
        definition = DIMENSIONS[self.dimension]
        limits = [
            f" {words} {format(getattr(self, key), self.dimension) if getattr(self, key) else 0}"
            for key, words in BOUNDS.items()
            if getattr(self, key) is not None
        ]
        noun = f"a list of {self.count} {definition.plural}" if self.count else definition.name
        noun = f"{definition.name} or {noun}" if self.spread else noun
        word = "".join(f'"{word}" or ' for word in self.words)
        example = ", ".join(f'"{text}"' for text in self._example_texts)
        example = f"[{example}]" if self.count else example
        return f"{word}{noun}{' and'.join(limits)} is needed, for example {example}"

    @property
    def _example_texts(self) -> list[str]:
        """An allowed value, or list of them: a vector of any sign is along the last axis."""
        example = self.example or DIMENSIONS[self.dimension].example
        if not self.count:
            return [example]
        is_vector = self.gt is None and self.ge is None and not self.words
        other = f"0 {example.split(' ', 1)[1]}" if is_vector else example
        return [other] * (self.count - 1) + [example]

    def _read_number(self, value: Any) -> float:
        if self.bare_unit and isinstance(value, str) and value[:1].isalpha():
            value = f"1 {value}"
        si = _convert(value, self.dimension)
        definition, unit = DIMENSIONS[self.dimension], self.unit
        if si and not definition.least <= abs(si) <= definition.most:
            smallest, largest = f"{definition.least:g} {unit}", f"{definition.most:g} {unit}"
            raise ValueError(f"it cannot be computed with, {smallest} to {largest} can")
        bounds = ((getattr(operator, key), getattr(self, key)) for key in BOUNDS)
        if not all(bound is None or compare(si, bound) for compare, bound in bounds):
            raise ValueError("")
        return si

    def _validate(self, value: Any) -> float | str | tuple[float, ...]:
        if isinstance(value, str) and value in self.words:
            return value
        try:
            if self.spread and isinstance(value, str):
                return (self._read_number(value),) * (self.count or 1)
            if self.count is None:
                return self._read_number(value)
            if not isinstance(value, (list, tuple)) or len(value) != self.count:
                raise ValueError("")
            words = self.words if self.mixed else ()
            return tuple(item if item in words else self._read_number(item) for item in value)
        except ValueError as error:
            reason = f"{error}; " if str(error) else ""
            raise build_value_error(reason + self.requirement) from None

    def _serialize(self, value: Any) -> Any:
        if isinstance(value, str):
            return value
        if isinstance(value, tuple):
            return [self._serialize(item) for item in value]
        return format(value, self.dimension)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: JsonHandler) -> JsonSchema:
        number = f"({_NUMBER})?" if self.bare_unit else _NUMBER
        per = r"(?:1?\s*/\s*)?" if self.dimension == "rate" else ""
        value_schema: JsonSchema = {
            "type": "string",
            "pattern": rf"^\s*{number}\s*{per}{_UNIT}$",
            "examples": self._example_texts[-1:],
        }
        if self.count:
            words = [{"const": word} for word in self.words] if self.mixed else []
            value_schema = {
                "type": "array",
                "items": {"anyOf": [*words, value_schema]} if words else value_schema,
                "minItems": self.count,
                "maxItems": self.count,
                "examples": [self._example_texts],
            }
        alternatives: list[Any] = [{"const": word} for word in self.words]
        alternatives += [value_schema["items"]] if self.spread else []
        return {"anyOf": [*alternatives, value_schema]} if alternatives else value_schema


Density = Annotated[float, Quantity("density", gt=0)]
Vector = tuple[float, float, float]
