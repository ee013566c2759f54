"""The registry of numbers: each module of this package holds families of rows.

A row (`Observable`) declares a number, its measurement and its presentation. The table of a run,
comparisons, sweeps, the report, JSON and the tables of the documentation follow from it. A further
family is a module with `FAMILIES`, an extension that calls `register`, or `observables` of a
Method.
"""

import pkgutil
from functools import cache
from importlib import import_module

from dusttaichi import method
from dusttaichi.analysis.numbers.number_registry import (
    AUTO,
    GENERAL,
    Family,
    Observable,
    Statistics,
    is_known,
    reason,
)
from dusttaichi.results.shown import NUMBERS, STATISTICS

__all__ = ["AUTO", "GENERAL", "Family", "Observable", "Statistics", "families", "index_observables",
           "is_known", "list_in_table_order", "reason", "register", "statistics"]  # fmt: skip


def register(row: Family | Statistics) -> None:
    """Add a Family, or Statistics of several runs, to those that this process measures.

    A file that calls it takes effect where it is among the `extensions` of a scene. Raises
    ValueError for the name of another one.
    """
    if isinstance(row, Statistics):
        STATISTICS.add(row.name, row)
        return
    used_names = index_observables().keys() & {number.name for number in row.numbers}
    if used_names and NUMBERS.get(row.name) != row:
        raise ValueError(
            f"there is a number {', '.join(sorted(used_names))}; another name is needed"
        )
    NUMBERS.replace(row.name, row)


def statistics() -> list[Statistics]:
    """The registered statistics of the runs of an ensemble or a sweep."""
    return list(STATISTICS.values())


def families(run_method: method.Method | None = None) -> list[Family]:
    """The families of runs of a method (default: of all methods) in the order of tables."""
    method_families = method.list_rows("observables", run_method)
    every_family = [*_import_families(), *NUMBERS.values(), *method_families]
    return sorted(every_family, key=lambda family: family.order)


def list_in_table_order(run_method: method.Method | None = None) -> list[tuple[float, Observable]]:
    """(place, row) of all rows of `families` in the order of tables."""
    rows = [
        (row.order or family.order, row)
        for family in families(run_method)
        for row in family.numbers
    ]
    return sorted(rows, key=lambda pair: pair[0])


def index_observables() -> dict[str, Observable]:
    """Every Observable by its name."""
    return {number.name: number for family in families() for number in family.numbers}


@cache
def _import_families() -> tuple[Family, ...]:
    modules = (
        import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)
    )
    return tuple(family for imported in modules for family in getattr(imported, "FAMILIES", ()))
