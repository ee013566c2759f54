"""Rows of the registry of numbers, and their formatting in tables."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dusttaichi.analysis.texts import quantity_text
from dusttaichi.errors import DustError

AUTO = "auto"
TABLES, ENSEMBLES, FILE = "tables", "ensembles", "file"


@dataclass(frozen=True, kw_only=True)
class Observable:
    """A number of a run, in SI: one row of the registry.

    name: its key in `summary`, in JSON, CSV and datasets. title: its name in the table of a run.
    unit: "" of a text or of yes and no, None of what has parts. symbol: its formula, as matplotlib
    writes it. value: from what the family has measured to it (default: the entry or attribute of
    its name); None, or not a number, where a run does not have it. error: name of the row that is
    its 1-sigma uncertainty; why: name of the row, a text, that says why there is none.

    text: how the table of a run shows it: a format, a function of (value, all numbers), AUTO (with
    unit and error), or None, not at all. literature: the value beside it, a text or a function of
    all numbers. rows: in place of both, a function of (value, all numbers) to rows of three texts.
    column: in comparisons, (heading, format, size of its unit), AUTO or None. short: its name in
    sweeps (default: `name` with blanks). sweeps: where its mean and scatter are shown, in TABLES
    of sweeps and ensembles, in those of ENSEMBLES only, or only in the FILE.
    wanted: rank among the numbers that runs at different costs are compared by (`dust trade`),
    0: not among them; trade_name: its name there. about: what it is, in a line (default: title).
    figure: name of the figure that shows it. place: of its row in tables (default: the family's).
    """

    name: str
    title: str
    unit: str | None = "1"
    symbol: str = ""
    value: Callable[[Any], Any] | None = None
    error: str = ""
    why: str = ""
    text: Any = AUTO
    literature: Any = ""
    rows: Callable | None = None
    column: Any = AUTO
    short: str = ""
    sweeps: str = TABLES
    wanted: int = 0
    trade_name: str = ""
    about: str = ""
    figure: str = ""
    place: float = 0.0

    @property
    def heading(self) -> str:
        """Its name in tables of several runs."""
        return self.short or self.name.replace("_", " ")

    def of(self, measured: Any) -> Any:
        """Its value in what the family has measured; None without."""
        if self.value is not None:
            found = self.value(measured)
        elif isinstance(measured, Mapping):
            found = measured.get(self.name)
        else:
            found = getattr(measured, self.name)
        return found.item() if isinstance(found, np.generic) else found

    def table_rows(self, numbers: Mapping) -> list[tuple[str, str, str]]:
        """Its rows (what, run, literature) of the table of a run; numbers: its `summary`."""
        value = numbers.get(self.name)
        if value is None or self.text is None:
            return []
        if self.rows is not None:
            return self.rows(value, numbers)
        beside = self.literature(numbers) if callable(self.literature) else self.literature
        return [(self.title, self._said(value, numbers), beside)]

    def cell(self, value: Any, numbers: Mapping) -> str:
        """Its text in a comparison of runs, "-" where there is none."""
        if not is_known(value):
            return "-"
        if isinstance(value, bool):
            return "yes" if value else "no"
        if self.column == AUTO:
            return self.plain(value, numbers)
        _, text, size = self.column
        return text.format(value if size == 1 else value / size)

    def _said(self, value, numbers):
        if isinstance(self.text, str) and self.text != AUTO:
            return self.text.format(value)
        return self.text(value, numbers) if callable(self.text) else self.plain(value, numbers)

    def plain(self, value: Any, numbers: Mapping) -> str:
        """Its value with unit and uncertainty."""
        if isinstance(value, bool):
            return "yes" if value else "no"
        if not self.unit:
            return str(value)
        if isinstance(value, int):
            return f"{value:,}"
        return quantity_text(value, self.unit, numbers.get(self.error))


@dataclass(frozen=True, kw_only=True)
class Family:
    """Rows of the registry that are measured together.

    name, title: what it is about. place: families are shown in the order of their places; what
    every run has comes last, from GENERAL on. applies: whether a Run has it. measure: from a Run
    to what the `value` of each row takes (default: the Run itself). compared: for comparisons of
    runs only, such as what their scenes say.
    """

    name: str
    title: str
    place: float
    numbers: tuple[Observable, ...]
    applies: Callable[[Any], bool] = lambda run: True
    measure: Callable[[Any], Any] = lambda run: run
    compared: bool = False

    def of(self, run) -> tuple[dict[str, Any], list[tuple[str, str]]]:
        """Values of a Run by the names of the rows, None where it does not have them; and (title,
        why) of what could not be measured."""
        found, failed = dict.fromkeys(number.name for number in self.numbers), []
        try:
            if not self.applies(run):
                return found, failed
            measured = self.measure(run)
        except Exception as error:  # whatever is wrong here, the other families are measured
            return found, [(self.title, reason(error))]
        for number in self.numbers:
            try:
                found[number.name] = number.of(measured)
            except Exception as error:  # nor the other rows
                failed.append((number.title, reason(error)))
        return found, failed


GENERAL = 100.0


def quiet(name: str, title: str, unit: str | None = "1", **more: Any) -> Observable:
    """A row that tables of runs do not show, or only within that of another one."""
    more = {"text": None, "column": None} | more
    return Observable(name=name, title=title, unit=unit, **more)


def uncertainty(name: str, unit: str = "1", **more: Any) -> Observable:
    """The row of the uncertainty of another one, NAME_sigma, which is shown with that."""
    return quiet(name, f"uncertainty of {name.removesuffix('_sigma')}", unit, **more)


def reason(error: Exception) -> str:
    """Message of an exception, with its type where it is a mistake in the code."""
    return str(error) if isinstance(error, DustError) else f"{type(error).__name__}: {error}"


def is_known(value: Any) -> bool:
    """False for None, what is not a number, and an empty text."""
    return value is not None and value == value and value != ""
