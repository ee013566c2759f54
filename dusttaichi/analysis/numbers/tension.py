"""Strength of a stretched sample."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dusttaichi.analysis.numbers.number_registry import (
    Family,
    Observable,
    quiet,
    strength_by_law,
    strength_text,
    uncertainty,
)
from dusttaichi.analysis.tensile import measure_tensile_strength
from dusttaichi.analysis.tension import explain_missing_strength

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


def _measure(run: Run) -> dict[str, Any]:
    problem = explain_missing_strength(run)
    return {"strength_problem": problem} if problem else vars(measure_tensile_strength(run))


def _format_strength_location(value: float, n: Mapping[str, Any]) -> str:
    return f"{value:.3g} from {n['phi_init']:.3g} (strain {n['strength_strain']:.2f})"


TENSION = Family(
    name="tension",
    title="stretching",
    order=30,
    applies=lambda run: run.stretches or explain_missing_strength(run) is not None,
    measure=_measure,
    numbers=(
        Observable(name="strength_problem", title="tensile strength", unit="",
                   about="why there is no tensile strength",
                   column=("no strength", "{}", 1)),
        quiet("phi_init", "filling factor at the start", symbol=r"$\phi_{\rm init}$",
              column=("phi_init", "{:.3g}", 1)),
        Observable(name="strength", title="tensile strength", unit="Pa", error="strength_sigma",
                   reason_row="strength_problem",
                   text=strength_text("strength_passed", "stress had", "strength_sigma"),
                   literature=strength_by_law("strength_law"),
                   column=("strength kPa", "{:.3g}", 1e3), trade_rank=2, figure="tensile"),
        uncertainty("strength_sigma", "Pa", column=("± kPa", "{:.2g}", 1e3)),
        Observable(name="strength_phi", title="… at filling factor", text=_format_strength_location,
                   literature=lambda n: f"{0.5 * n['phi_init']:.3g} (T19: half)",
                   about="filling factor at the largest stress",
                   column=("strength at phi", "{:.3g}", 1)),
        quiet("strength_strain", "strain at the largest stress"),
        quiet("strength_law", "strength by T19 eq 33", "Pa", value="law", short="T19 eq 33",
              column=("T19 eq 33 kPa", "{:.3g}", 1e3)),
        quiet("strength_passed", "the stress has fallen since", "", value="passed",
              column=("maximum passed", "{!s}", 1)),
    ),
)  # fmt: skip
FAMILIES = (TENSION,)
