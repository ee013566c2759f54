"""Rows of the registry of numbers, and their texts in tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.analysis.texts import format_quantity
from dusttaichi.errors import DustError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from dusttaichi.analysis.run import Run
    from dusttaichi.analysis.texts import TextColumn


AUTO = "auto"
TABLES, ENSEMBLES, FILE = "tables", "ensembles", "file"


@dataclass(frozen=True, kw_only=True)
class MeasuredNumber:
    """A number of a run, in SI, and how it is measured.

    name: its key in `summarise`, in JSON, CSV and datasets. title: its name in the table of a run.
    about: description in a line (default: title). unit: "" of a text or a bool, None of a
    structure. symbol: its formula for matplotlib. value: function from the measurement of the
    family to its value, or the name of an entry or attribute of that (default: `name`); None, or
    not a number, where a run does not have it. error: name of the row with its 1-sigma uncertainty;
    reason_row: name of the row with the reason why it is missing. trade_rank: rank among the
    numbers by which runs of different costs are compared (`dust trade`), 0 for none; trade_name:
    its name there.
    """

    name: str
    title: str
    about: str = ""
    unit: str | None = "1"
    symbol: str = ""
    value: Callable[[Any], Any] | str = ""
    error: str = ""
    reason_row: str = ""
    trade_rank: int = 0
    trade_name: str = ""

    def evaluate(self, measured: Any) -> Any:
        """Its value in the measurement of the family, or None."""
        name = self.value or self.name
        if callable(name):
            value = name(measured)
        else:
            by_key = isinstance(measured, Mapping)
            value = measured.get(name) if by_key else getattr(measured, name)
        return value.item() if isinstance(value, np.generic) else value


@dataclass(frozen=True, kw_only=True)
class Observable(MeasuredNumber):
    """A MeasuredNumber and its presentation: one row of the registry.

    text: in the table of a run: a format, a function of (value, all numbers), AUTO (with unit and
    error), or None for no row. literature: the value beside it, a text or a function of all
    numbers. rows: instead of both, a function of (value, all numbers) to rows of three texts.
    column: in comparisons, (heading, format, size of its unit), AUTO or None. short: its name in
    sweeps (default: `name` with blanks). sweeps: where its mean and scatter are shown, in TABLES of
    sweeps and ensembles, in those of ENSEMBLES only, or only in the FILE. figure: name of the
    figure that shows it. order: of its row in tables (default: the family's).
    """

    text: Any = AUTO
    literature: Any = ""
    rows: Callable[[Any, Mapping[str, Any]], list[tuple[str, str, str]]] | None = None
    column: Any = AUTO
    short: str = ""
    sweeps: str = TABLES
    figure: str = ""
    order: float = 0.0

    @property
    def heading(self) -> str:
        """Its name in tables of several runs."""
        return self.short or self.name.replace("_", " ")

    def table_rows(self, numbers: Mapping[str, Any]) -> list[tuple[str, str, str]]:
        """Its rows (what, run, literature) in the table of a run; numbers: its `summarise`."""
        value = numbers.get(self.name)
        if value is None or self.text is None:
            return []
        if self.rows is not None:
            return self.rows(value, numbers)
        if not is_known(value):
            return []
        literature = self.literature(numbers) if callable(self.literature) else self.literature
        return [(self.title, self._text(value, numbers), literature)]

    def cell(self, value: Any, numbers: Mapping[str, Any]) -> str:
        """Its text in a comparison of runs, "-" without a value."""
        if not is_known(value):
            return "-"
        if self.column == AUTO or isinstance(value, bool):
            return self.plain(value, numbers)
        _, text, size = self.column
        return str(text.format(value if size == 1 else value / size))

    def _text(self, value: Any, numbers: Mapping[str, Any]) -> str:
        if isinstance(self.text, str) and self.text != AUTO:
            return self.text.format(value)
        return str(self.text(value, numbers)) if callable(self.text) else self.plain(value, numbers)

    def plain(self, value: Any, numbers: Mapping[str, Any]) -> str:
        """Its value with unit and uncertainty."""
        if isinstance(value, bool):
            return "yes" if value else "no"
        if not self.unit:
            return str(value)
        if isinstance(value, int):
            return f"{value:,}"
        return format_quantity(value, self.unit, numbers.get(self.error))


@dataclass(frozen=True, kw_only=True)
class Family:
    """Rows of the registry that are measured together.

    name, title: of the family. order: tables show families in ascending order; numbers of
    every run come last, from GENERAL. applies: whether a Run has it. measure: function from a Run
    to the argument of the rows' `value` (default: the Run itself). optional: a DustError of
    `measure` means that the run has none of them. compared: for comparisons of runs only, such as
    the settings of their scenes.
    """

    name: str
    title: str
    order: float
    numbers: tuple[Observable, ...]
    applies: Callable[[Any], bool] = lambda run: True
    measure: Callable[[Any], Any] = lambda run: run
    optional: bool = False
    compared: bool = False

    def evaluate(self, run: Run) -> tuple[dict[str, Any], list[tuple[str, str]]]:
        """(values of a Run by the names of the rows, (title, error) of those not measured)."""
        values: dict[str, Any] = dict.fromkeys(number.name for number in self.numbers)
        failed: list[tuple[str, str]] = []
        try:
            if not self.applies(run):
                return values, failed
            measured = self.measure(run)
        except Exception as error:  # does not affect the other families
            nothing = self.optional and isinstance(error, DustError)
            return values, [] if nothing else [(self.title, reason(error))]
        for number in self.numbers:
            try:
                values[number.name] = number.evaluate(measured)
            except Exception as error:  # nor the other rows
                failed.append((number.title, reason(error)))
        return values, failed


@dataclass(frozen=True, kw_only=True)
class Statistics:
    """A table and a figure of the runs of an ensemble or a sweep together.

    name: of the file of the figure. title: above both. table: function from the dataset of
    `analysis.gather` to (columns, lines): (header, texts) of each column, the first of which names
    the rows, and sentences below; [] of both for nothing to say. draw: function from the dataset to
    a matplotlib Figure, or to None for nothing to show.
    """

    name: str
    title: str
    table: Callable[[xr.Dataset], tuple[list[TextColumn], list[str]]] = lambda data: ([], [])
    draw: Callable[[xr.Dataset], Figure | None] = lambda data: None


GENERAL = 100.0


def quiet(name: str, title: str, unit: str | None = "1", **options: Any) -> Observable:
    """A row that tables of runs do not show, or only as part of another one."""
    options = {"text": None, "column": None} | options
    return Observable(name=name, title=title, unit=unit, **options)


def strength_by_law(name: str, prefix: str = "") -> Callable[[Mapping[str, Any]], str]:
    """Literature beside a strength: the value of the row `name`, its tensile strength by T19."""

    def text(numbers: Mapping[str, Any]) -> str:
        law = numbers.get(name)
        if law is None or not is_known(law):
            return ""
        return f"{format_quantity(law, 'Pa')} ({prefix}T19 eq 33)"

    return text


def strength_text(
    passed: str, subject: str, error: str = ""
) -> Callable[[Any, Mapping[str, Any]], str]:
    """Text of a strength.

    passed: row that is true if the maximum was measured. subject: start of the remark otherwise.
    """

    def text(value: float, numbers: Mapping[str, Any]) -> str:
        strength = format_quantity(value, "Pa", numbers.get(error))
        return strength if numbers[passed] else f"at least {strength}: the {subject} not fallen yet"

    return text


def uncertainty(name: str, unit: str = "1", **options: Any) -> Observable:
    """The row NAME_sigma of the uncertainty of another one, which is shown with it."""
    return quiet(name, f"uncertainty of {name.removesuffix('_sigma')}", unit, **options)


def reason(error: Exception) -> str:
    """Message of an exception, with its type where it is a mistake in the code."""
    return str(error) if isinstance(error, DustError) else f"{type(error).__name__}: {error}"


def is_known(value: Any) -> bool:
    """False for None, what is not a number, and an empty text."""
    return bool(value is not None and value == value and value != "")
