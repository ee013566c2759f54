"""Texts of numbers: with their scatter, in a suitable unit, as CSV."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence

from dusttaichi.scene.dimensions import DIMENSIONS

DECIMALS = 5  # more than these are written as powers of ten
_NUMBER = re.compile(r"(?<![\w.-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w-])")
# SI unit -> (power of ten, unit), largest first
_POWERS = {
    dimension.unit: sorted(
        ((power, unit) for unit, power in dimension.powers.items()), reverse=True
    )
    for dimension in DIMENSIONS.values()
}


TextColumn = tuple[str, Sequence[str]]  # header, and a text for each row


def format_csv(rows: Iterable[Iterable[object]]) -> str:
    """Rows of values as CSV."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def choose_unit(size: float, unit: str | None) -> tuple[int, str]:
    """(power of ten, unit) in which numbers up to `size` [unit, SI] read well."""
    if unit not in _POWERS:
        return 0, "" if unit in (None, "1") else unit
    fitting_units = [(p, text) for p, text in _POWERS[unit] if size * (1 + 1e-9) >= 10.0**p]
    return (fitting_units or [_POWERS[unit][-1] if size else (0, unit)])[0]


def format_quantity(
    value: float, unit: str | None, std: float | None = None, size: float | None = None
) -> str:
    """ "21.9 ± 0.8 kPa": a number [unit] with its scatter, if visible in four digits.

    The unit is a suitable one; with `size` that of numbers up to it, without its name.
    """
    visible = std is not None and math.isfinite(std) and std > 1e-4 * abs(value)
    scatter = std if std is not None and visible else 0.0
    power, name = choose_unit(max(abs(value), scatter) if size is None else size, unit)
    factor = 10.0**power
    mean, spread = value / factor, scatter / factor
    # two digits of the scatter, and as many decimals of the mean
    decimals = 1 - math.floor(math.log10(spread)) if visible else DECIMALS + 1
    if decimals <= DECIMALS:
        numbers = [f"{round(v, decimals) + 0.0:.{max(decimals, 0)}f}" for v in (mean, spread)]
    else:
        is_integer = mean == round(mean) and abs(mean) < 1e9
        # a residual needs no more digits than two
        digits = 4 if abs(mean) >= 1e-4 else 2
        numbers = [f"{mean:.0f}" if is_integer else f"{mean:.{digits}g}", f"{spread:.2g}"]
    text = " ± ".join(numbers if visible else numbers[:1])
    return f"{text} {name if size is None else ''}".rstrip()


def mask_numbers(text: str) -> str:
    """A text with # in place of its numbers."""
    return _NUMBER.sub("#", text)


def merge_with_ranges(texts: Sequence[str]) -> str:
    """One text of several that differ in numbers alone: "0 to 3 points"."""
    fixed_texts = _NUMBER.split(texts[0])
    columns = zip(*map(_NUMBER.findall, texts), strict=True)
    ranges = [
        " to ".join(dict.fromkeys((min(column, key=float), max(column, key=float))))
        for column in columns
    ]
    return "".join(map("".join, zip(fixed_texts, [*ranges, ""], strict=True)))


def typeset(text: str) -> str:
    """The text with powers such as m^2 and s^-1 as superscripts, and with the sign for micro."""
    raised = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    text = re.sub(r"\^(-?\d+)", lambda power: power[1].translate(raised), text)
    return re.sub(r"(?<=[\d ] )u(?=[msNJ]\b)", "µ", text)
