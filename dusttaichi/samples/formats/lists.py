"""Lists of grains: CSV, tables between white space, text of YADE, with or without names of columns.

Separators are commas, semicolons, tabs or white space, decimals points or commas; a heading is the
line above the first grain, or a comment. The number of grains may come first.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

from numpy.typing import NDArray

from dusttaichi.samples.formats.columns import Units, make_table, state
from dusttaichi.samples.formats.names import (
    NUMBERS,
    find_quantity,
    heading,
    is_complete,
    is_unit,
    names_in,
    words,
)
from dusttaichi.samples.formats.order import guess
from dusttaichi.samples.formats.text import SPACES, Cells, Source, is_integer_column, is_text, parse

COMMENT = ("#", "%", "!", "//")
_LOOKED_AT = 50  # rows that decide how cells are separated
_DECIMAL = re.compile(r"[+-]?\d+(?:,\d+)?(?:[eEdD][+-]?\d+)?")
_COUNT = re.compile(r"\s*(\d+)\s*(?:[=#a-zA-Z].*)?")
ALLOWED = (
    "allowed: a list with the columns {}, below their names or in the order of sample.columns, a "
    "file of LAMMPS, YADE, MercuryDPM or XYZ, or NetCDF"
)


def read(source: Source) -> dict[str, Any]:
    """State of the grains, as columns.state.

    Raises DustError where no grains are found, a row has another number of columns than the others,
    the number of grains in front is another one, or columns without names can be several things.
    """
    source.refuse_snapshot()
    # a comment behind a grain; one above them begins the line
    lines = [re.sub(r"(?<=\S)\s+#.*", "", line) if "#" in line else line for line in source.lines]
    source = replace(source, lines=lines)
    above, rows = _parts(source)
    cells = _cells([source.lines[n] for n in rows[:_LOOKED_AT]])
    units = _units_row(rows, cells, source)
    rows = rows[1:] if units else rows
    values = parse(source, rows, cells)
    names = _names(above, values, rows, cells, source)
    if units and len(units) == len(names):
        names = [f"{name} [{unit}]" if unit else name
                 for name, unit in zip(names, units, strict=True)]  # fmt: skip
    _check_count(above, rows, source)
    _remark_on_titles(above, source)
    # a unit of length alone does not say those of masses
    default = Units(length=source.length, matter=source.length == 1.0)
    return state(make_table(names, values, rows, source, cells), source, default)


def _units_row(rows: list[int], cells: Cells, source: Source) -> list[str] | None:
    """Units in a row of their own below the names, as of Origin: "mm,mm,kg/m"; else None."""
    if source.columns is not None or len(rows) < 2:
        return None
    units = [cell.strip().strip("()[]") for cell in cells.split_line(source.lines[rows[0]])]
    return units if any(units) and all(unit in NUMBERS or is_unit(unit) for unit in units) else None


def _parts(source: Source) -> tuple[list[int], list[int]]:
    """Numbers of the lines above the first grain, and of those of grains."""
    lines = source.lines
    if not any(line.strip() for line in lines):
        raise source.fault(f"the file is empty; {ALLOWED.format(source.contents.columns)}.")
    above: list[int] = []
    rows: list[int] = []
    headed = False
    for n, line in enumerate(lines):
        text = line.strip()
        if not text:
            continue
        if text.startswith(COMMENT):
            above += [] if rows else [n]
        elif rows or headed or _is_row(text):
            rows.append(n)
        else:
            above.append(n)
            headed = _is_heading(text, source)
    if not rows:
        n = next((n for n in above if not lines[n].lstrip().startswith(COMMENT)), above[0])
        noun = source.contents.noun
        text = f"it has no {noun}" if headed else f"{source.quote(n)} begins no list of {noun}"
        raise source.fault(f"{text}; {ALLOWED.format(source.contents.columns)}.")
    return above, rows


def _is_heading(text: str, source: Source) -> bool:
    """True for a line that names two coordinates or more."""
    meanings = [find_quantity(heading(word, source)[0]) for word in words(text)]
    return sum(("position", n) in meanings for n in range(3)) >= 2


def _is_row(text: str) -> bool:
    """True for a line of three numbers or more, and fewer words."""
    forms = (re.split(r"[\s,;]+", text), re.split(r"[\s;]+", text))  # decimals with a comma
    for cells_of_line, cells in zip(forms, (SPACES, Cells(None, True)), strict=True):
        numbers = sum(map(cells.is_number, cells_of_line))
        if numbers >= 3 and 2 * numbers > len(cells_of_line):
            return True
    return False


def _cells(lines: list[str]) -> Cells:
    """Separator of the cells of these rows."""
    if all(";" in line for line in lines):
        cells = [cell for line in lines for cell in Cells(";").split_line(line)]
        return Cells(";", any("," in cell for cell in cells))
    if all("\t" in line.strip() for line in lines):
        table = [Cells("\t").split_line(line) for line in lines]
        if not any(" " in cell or cell.endswith(",") for row in table for cell in row):
            return Cells("\t", any("," in cell for row in table for cell in row))
    if all("," in line for line in lines):
        words_of_lines = [word for line in lines for word in line.split()]
        least = min(len(line.split()) for line in lines)
        if least >= 3 and all(_DECIMAL.fullmatch(word) for word in words_of_lines):
            return Cells(None, True)
        quoted = [cell for line in lines if '"' in line for cell in Cells(",").split_line(line)]
        return Cells(",", any("," in cell for cell in quoted))
    words_of_lines = [word for line in lines for word in line.split()]
    return Cells(None, any("," in word for word in words_of_lines)
                 and all("." not in word for word in words_of_lines))  # fmt: skip


def _names(
    above: list[int], values: list[NDArray[Any]], rows: list[int], cells: Cells, source: Source
) -> list[str]:
    """Names of the columns: of the scene, of a heading, or by their values."""
    width = len(values)
    if source.columns is not None:
        return list(source.columns)
    lines = source.lines
    for n in reversed(above):
        text = lines[n].strip()
        if text.startswith(COMMENT):
            text = text.lstrip("#%!/ ")
            if match := re.search(r"format\s+(\w+)", text):  # of YADE
                names = match[1].split("_")
                return names + [f"column {k + 1}" for k in range(len(names), width)]
            if column_names := names_in(text, width, source):
                return column_names
        elif column_names := _heading(text, values, cells, source) or names_in(text, width, source):
            return column_names
        elif _COUNT.fullmatch(text):
            continue
        elif n == above[-1] or is_complete(words(text), source.contents):
            _refuse_heading(n, width, cells, source)
    _refuse_numbers(values, rows, source)
    return guess(values, source, rows[0])


def _heading(
    text: str, values: list[NDArray[Any]], cells: Cells, source: Source
) -> list[str] | None:
    """Names of a line above the grains; the first column may be an index without a name."""
    width = len(values)
    for column_names in (cells.split_line(text), words(text)):
        if len(column_names) == width and any(
            find_quantity(heading(cell, source)[0]) for cell in column_names[1:]
        ):
            return column_names
        plain = [heading(cell, source)[0] for cell in column_names]
        one_less = len(column_names) == width - 1 and is_complete(plain, source.contents)
        if one_less and _is_index(values[0]):
            return ["id", *column_names]
    return None


def _is_index(values: NDArray[Any]) -> bool:
    if is_text(values):
        return all(re.fullmatch(r"\D*\d+\D*", str(value)) for value in values)
    return (
        is_integer_column(values, 0)
        and values[0] in (0, 1)
        and bool((values[1:] - values[:-1] == 1).all())
    )


def _refuse_heading(n: int, width: int, cells: Cells, source: Source) -> None:
    text = source.lines[n].strip()
    heading_cells = cells.split_line(text)
    comma = " (decimal commas need another separator than a comma)" if cells.split == "," else ""
    if len(heading_cells) == width or is_complete(words(text), source.contents):
        unknown = [cell for cell in heading_cells if not find_quantity(heading(cell, source)[0])]
        description = f"has the columns {', '.join(heading_cells)}"
        if len(heading_cells) != width:
            description += f", {len(heading_cells)}, and the lines below have {width}{comma}"
        elif unknown:
            description += f", of which {', '.join(unknown)} are not known"
        raise source.fault(
            f"its header, {source.quote(n)}, {description}; allowed: a name for each column, such "
            "as "
            f"{source.contents.example}, or sample.columns, which names them in their order."
        )


def _refuse_numbers(values: list[NDArray[Any]], rows: list[int], source: Source) -> None:
    """Refuse numbers of columns above numbers, which pandas writes of a table without names."""
    first = source.lines[rows[0]]
    counts = [v[0] == k for k, v in enumerate(values) if not is_text(v)]
    if len(rows) > 1 and len(counts) > 2 and all(counts) and "." not in first \
            and "." in source.lines[rows[1]]:  # fmt: skip
        raise source.fault(
            f"{source.quote(rows[0])} can be the numbers of the columns or a grain; allowed: names "
            f"of the columns, such as {source.contents.example} (or remove the line)."
        )


def _check_count(above: list[int], rows: list[int], source: Source) -> None:
    """Refuse a number of grains in front of them that is another one."""
    for n in above:
        text = source.lines[n].strip()
        match = _COUNT.fullmatch(text)
        if match and (text.isdigit() or n == above[0]) and int(match[1]) != len(rows):
            raise source.fault(
                f"{source.quote(n)} announces {match[1]} {source.contents.noun}, and {len(rows)} "
                f"lines of {source.contents.noun} follow; allowed: as many."
            )


def _remark_on_titles(above: list[int], source: Source) -> None:
    """Add a remark on lines above the grains that are no comments, names or a number of grains."""
    texts = [source.lines[n].strip() for n in above]
    texts = [t for t in texts if not t.startswith((*COMMENT, "sep=")) and not _COUNT.fullmatch(t)]
    texts = [t for t in texts if not _is_heading(t, source) and source.columns is None]
    if texts:
        source.remarks.append(
            f"what is above the {source.contents.noun} is not read: {'; '.join(texts)[:80]}"
        )
