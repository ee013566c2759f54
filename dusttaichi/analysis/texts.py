"""Texts of numbers: with their scatter, in a suitable unit, as CSV."""

import csv
import io
import math
import re

from dusttaichi.scene import quantities

DECIMALS = 5  # more than these are written as powers of ten
_NUMBER = re.compile(r"(?<![\w.-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w-])")
# SI unit -> (power of ten, unit), largest first
_POWERS = {
    dimension.unit: sorted(
        ((power, unit) for unit, power in dimension.powers.items()), reverse=True
    )
    for dimension in quantities.DIMENSIONS.values()
}


def format_csv(rows):
    """Rows of values as CSV."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def choose_unit(size, unit):
    """(power of ten, unit) in which numbers up to `size` [unit, SI] read well."""
    if unit not in _POWERS:
        return 0, "" if unit in (None, "1") else unit
    fitting_units = [(p, text) for p, text in _POWERS[unit] if size * (1 + 1e-9) >= 10.0**p]
    return (fitting_units or [_POWERS[unit][-1] if size else (0, unit)])[0]


def format_quantity(value, unit, std=None, size=None):
    """ "21.9 ± 0.8 kPa": a number [unit] with its scatter, if visible in four digits.

    The unit is a suitable one; with `size` that of numbers up to it, without its name.
    """
    named = size is None
    scatters = std is not None and math.isfinite(std) and std > 1e-4 * abs(value)
    size = max(abs(value), std if scatters else 0.0) if named else size
    power, name = choose_unit(size, unit)
    factor = 10.0**power
    mean, std = value / factor, std / factor if scatters else 0.0
    # two digits of the scatter, and as many decimals of the mean
    decimals = 1 - math.floor(math.log10(std)) if scatters else math.inf
    if decimals <= DECIMALS:
        mean, std = (f"{round(v, decimals) + 0.0:.{max(decimals, 0)}f}" for v in (mean, std))
    else:
        is_integer = mean == round(mean) and abs(mean) < 1e9
        # a residual needs no more digits than two
        mean = f"{mean:.0f}" if is_integer else f"{mean:.{4 if abs(mean) >= 1e-4 else 2}g}"
        std = f"{std:.2g}"
    return f"{mean}{f' ± {std}' if scatters else ''} {name if named else ''}".rstrip()


def mask_numbers(text):
    """A text with # in place of its numbers."""
    return _NUMBER.sub("#", text)


def merge_with_ranges(texts):
    """One text of several that differ in numbers alone: "0 to 3 points"."""
    fixed_texts = _NUMBER.split(texts[0])
    columns = zip(*map(_NUMBER.findall, texts), strict=True)
    ranges = [
        " to ".join(dict.fromkeys((min(column, key=float), max(column, key=float))))
        for column in columns
    ]
    return "".join(map("".join, zip(fixed_texts, [*ranges, ""], strict=True)))


def typeset(text):
    """The text with powers such as m^2 and s^-1 as superscripts, and with the sign for micro."""
    raised = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    text = re.sub(r"\^(-?\d+)", lambda power: power[1].translate(raised), text)
    return re.sub(r"(?<=[\d ] )u(?=[msNJ]\b)", "µ", text)
