"""Assessment of the errors of a trade, and combination of the changes that pay within them."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import TypeVar

from dusttaichi.analysis.observables import (
    CURVE,
    ObservableValues,
    compute_differences,
    measure_scatter,
)
from dusttaichi.errors import DustError
from dusttaichi.method.variants import KINDS, NUMERICAL, Variant
from dusttaichi.scene import Scene
from dusttaichi.studies.study_types import StudyPoint

ATTEMPTS = 2  # levels of a parameter that are tried in a combination
LEAST_ERROR = 1e-6  # denominator of a gain over its error
Result = TypeVar("Result")
# generator of the points of its stages, which returns a result
Stages = Generator[Sequence[StudyPoint], None, Result]


@dataclass(frozen=True, eq=False)
class Row:
    """A Variant with the result of its run; equal to itself alone.

    code: 0, that of a DustError (2: refused, 3: stopped by a guard), or 1: the process was lost.
    status: end of the run, or the reason of the failure. cost [s]: core-seconds of the time steps.
    ratio: of the cost to that of the default. What is not known is not a number.
    """

    variant: Variant
    code: int
    status: str
    cost: float = math.nan
    ratio: float = math.nan
    steps: float = math.nan
    time_step: float = math.nan
    ledger: float = math.nan
    measured: ObservableValues = field(default_factory=lambda: ObservableValues({}))

    @property
    def ok(self) -> bool:
        """True where the run ended regularly."""
        return self.code == 0


@dataclass(frozen=True)
class Judge:
    """Errors against the observables of a converged reference.

    name: of the decisive observable. scatter, convergence: observable -> standard deviation
    between seeds, and difference of the reference from its check (Parameters.check), as errors; nan
    where unknown. tolerance: largest accepted error.
    """

    reference: ObservableValues
    name: str
    scatter: dict[str, float]
    convergence: dict[str, float]
    tolerance: float
    _errors: dict[Row, dict[str, tuple[float, float]]] = field(default_factory=dict, init=False)

    @classmethod
    def from_runs(
        cls,
        reference: ObservableValues,
        check: ObservableValues | None,
        default: ObservableValues,
        seeds: Sequence[ObservableValues],
        *,
        tolerance: float,
        name: str | None = None,
    ) -> Judge:
        """The Judge of the ObservableValues of a reference.

        check: of the check of the reference, or None. seeds: of the default with each seed.
        name: of the observable, by default the first of reference and default that is not 0, such
        as a restitution coefficient of bodies that stick. Raises DustError for an unknown one, and
        where the default cannot be compared.
        """
        names = [n for n in reference.names if n in default.names]
        refuse_unknown(name, names)
        if not names:
            raise DustError(
                "the reference and the unchanged scene have no number in common for a "
                "comparison; give the run a longer time"
            )
        convergence = dict.fromkeys(reference.names, math.nan)
        if check is not None:
            convergence |= {n: e for n, (_, e) in compute_differences(check, reference).items()}
        nonzero = [n for n in names if n == CURVE or reference.values[n] != 0.0]
        name = name or (nonzero or names)[0]
        if not math.isfinite(compute_differences(default, reference)[name][1]):
            raise DustError(
                f"{name} of the default and of its reference cannot be compared; choose another "
                f"--observable ({', '.join(reference.names)})"
            )
        return cls(reference, name, measure_scatter(seeds, reference), convergence, tolerance)

    @property
    def floor(self) -> float:
        """Error that is not significant: the scatter, without seeds the convergence."""
        scatter = self.scatter[self.name]
        return scatter if math.isfinite(scatter) else self.convergence[self.name]

    @property
    def converged(self) -> bool:
        """True where the error of the reference is below a third of the tolerance."""
        return self.convergence[self.name] < self.tolerance / 3.0

    def errors(self, row: Row) -> dict[str, tuple[float, float]]:
        """observable -> (value, error) of a Row, computed once."""
        if row not in self._errors:
            self._errors[row] = compute_differences(row.measured, self.reference)
        return self._errors[row]

    def error(self, row: Row) -> float:
        """Error of the decisive observable."""
        return self.errors(row)[self.name][1]

    def is_free(self, row: Row) -> bool:
        """True where the error is below the floor."""
        return self.error(row) < self.floor

    def accepts(self, row: Row) -> bool:
        """True for a Row within the tolerance or, of a numerical parameter, within the scatter.

        Errors of the numerics below the scatter give another sample of the same distribution; a
        change of the physics or of the sample changes the mean, too, which scatter may only hide.
        """
        if not row.ok:
            return False
        hidden = row.variant.kind == NUMERICAL and self.is_free(row)
        return hidden or self.error(row) <= self.tolerance


# runs Variants, and returns their Rows
RunVariants = Callable[[Sequence[Variant]], Stages[list[Row]]]


@dataclass(frozen=True)
class Trade:
    """Result of a trade.

    rows: default first, then presets (that of the reference last), single changes, combinations.
    seeds: ObservableValues of the default with each seed, its own first. numerical, anything:
    cheapest accepted Row of numerical parameters, and of all, or None. left_out: parameter ->
    reason. noise: of a cost. check: Row that gives the error of the reference, such as that at half
    its step.
    """

    scene: Scene
    judge: Judge
    rows: tuple[Row, ...]
    seeds: tuple[ObservableValues, ...]
    check: Row
    numerical: Row | None
    anything: Row | None
    left_out: dict[str, str]
    noise: float


def refuse_unknown(name: str | None, names: Sequence[str]) -> None:
    """Refuse the name of an observable that is not among these. Raises DustError."""
    if name is not None and name not in names:
        allowed = f"allowed: {', '.join(names)}" if names else "it has none"
        raise DustError(f"--observable {name}: the scene has no such number; {allowed}")


_by_ratio = attrgetter("ratio")


def rank_offers(
    rows: Iterable[Row], judge: Judge, noise: float, largest_error: float | None = None
) -> list[list[Row]]:
    """Rows that are cheaper at an accepted error: a list for each parameter, cheapest first.

    The lists are sorted by the saving of their cheapest level over its error. largest_error: where
    the error of the default is too large, that of a row for combination with an accepted one.
    """
    offers: dict[str, list[Row]] = {}
    for row in sorted((row for row in rows if row.ratio < 1.0 - noise), key=_by_ratio):
        if judge.accepts(row) if largest_error is None else judge.error(row) <= largest_error:
            offers.setdefault(row.variant.parameter, []).append(row)

    def compute_gain(levels: list[Row]) -> float:
        return (1.0 - levels[0].ratio) / max(judge.error(levels[0]), LEAST_ERROR)

    return sorted(offers.values(), key=compute_gain, reverse=True)


def combine_variants(first: Variant, second: Variant) -> Variant:
    """The Variant with the changes of both."""
    combined_kind = max(first.kind, second.kind, key=KINDS.index)
    label = f"{first.label} + {second.label}"
    return Variant(
        label, "combined", label, kind=combined_kind, changes=first.changes | second.changes
    )


def combine_offers(
    start: Row | None, offers: Sequence[Sequence[Row]], run: RunVariants, judge: Judge
) -> Stages[tuple[list[Row], Row | None]]:
    """Stages of combinations; returns (Rows of all of them, last accepted Row).

    start: a Row, None for the default. offers: of `rank_offers`. run: generator of a stage that
    runs Variants and returns their Rows.
    A combination with a level is accepted where it is cheaper than without the level, at an
    accepted error; else the next cheapest level of the parameter is tried.
    """
    accepted, combinations = start, list[Row]()
    for levels in offers:
        for level in levels[:ATTEMPTS]:
            if accepted is None:  # the single change has been run
                accepted = level
                break
            (row,) = yield from run([combine_variants(accepted.variant, level.variant)])
            combinations.append(row)
            if row.ratio < accepted.ratio and judge.accepts(row):
                accepted = row
                break
    return combinations, accepted


def find_cheapest(
    rows: Iterable[Row], judge: Judge, kinds: Sequence[str], noise: float
) -> Row | None:
    """The cheapest accepted Row of these kinds, or None.

    It is the default where that is accepted and none is cheaper by more than the noise of a cost.
    """
    accepted = [
        row
        for row in rows
        if row.variant.kind in kinds and math.isfinite(row.ratio) and judge.accepts(row)
    ]
    default = [row for row in accepted if row.variant.parameter == "default"]
    if default:
        accepted = [row for row in accepted if row.ratio < 1.0 - noise] or default
    return min(accepted, key=_by_ratio, default=None)
