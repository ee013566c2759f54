"""A collision of two bodies between the first and the last snapshot."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from dusttaichi.analysis.fragments import (
    find_fragments,
    measure_compaction,
    measure_growth_efficiency,
)
from dusttaichi.analysis.numbers.number_registry import FILE, Family, Observable, quiet
from dusttaichi.analysis.outcome import NOT_MET, PAGE, PASSED, determine_outcome, has_settled
from dusttaichi.analysis.restitution import measure_restitution
from dusttaichi.errors import DustError

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


def _measure(run: Run) -> dict[str, Any]:
    bodies, fragments = run.bodies(), find_fragments(run)
    numbers = {
        "speed": run.sample["speed"],
        "outcome": determine_outcome(run, fragments, bodies),
        "settled": has_settled(run),
        "fragments": len(fragments),
        "largest_share": float(fragments.mass[0] / fragments.mass.sum()),
    }
    if numbers["outcome"] in (NOT_MET, PASSED):
        return numbers
    numbers["growth_efficiency"] = measure_growth_efficiency(run, bodies=bodies)
    if min(len(body) for body in bodies) > 2:  # R_g of one or two grains gives no volume
        numbers["compaction"] = measure_compaction(run).ratio
    if numbers["outcome"] in ("sticking", "growth", "bouncing"):  # fragments have no normal
        with suppress(DustError):  # bodies that pass each other
            numbers["restitution"] = measure_restitution(run, bodies=bodies).coefficient
    return numbers


def _format_outcome(value: str, n: Mapping[str, Any]) -> str:
    if value == NOT_MET:
        return "the bodies have not met yet: let the run continue"
    if value == PASSED:
        return "the bodies passed each other without touching"
    largest_fragment = f"{100.0 * n['largest_share']:.1f} % of the mass in the largest"
    return (
        f"{value}, {n['fragments']} fragments, {largest_fragment}" if n["fragments"] > 1 else value
    )


def _format_outcome_rows(value: str, n: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    return [("outcome", _format_outcome(value, n), ""), ("definition of outcomes", PAGE, "")]


def _format_settled(value: bool, n: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    text = "fragments still change between the last two snapshots: let the run continue"
    return [] if value else [("note", text, "")]


COLLISION = Family(
    name="collision",
    title="collision of two bodies",
    order=60,
    applies=lambda run: run.collides,
    measure=_measure,
    numbers=(
        quiet("speed", "speed of the impact", "m/s", sweeps=FILE,
              column=("speed m/s", "{:.3g}", 1)),
        Observable(name="outcome", title="outcome", unit="", rows=_format_outcome_rows,
                   column=("outcome", "{}", 1), figure="collision"),
        Observable(name="settled", title="fragments no longer change", unit="",
                   rows=_format_settled, column=None),
        quiet("fragments", "fragments", column=("fragments", "{}", 1), trade_rank=11,
              figure="fragments"),
        quiet("largest_share", "share of the largest fragment",
              column=("largest fragment", "{:.3f}", 1), trade_rank=10, figure="fragments"),
        Observable(name="growth_efficiency", title="growth efficiency", text="{:.3f}",
                   column=("growth efficiency", "{:.3f}", 1), trade_rank=9),
        Observable(name="compaction", title="compaction of the largest fragment", text="{:.3f}",
                   column=("compaction", "{:.3f}", 1)),
        Observable(name="restitution", title="coefficient of restitution", text="{:.4f}",
                   column=("restitution", "{:.3f}", 1), trade_rank=5),
    ),
)  # fmt: skip
FAMILIES = (COLLISION,)
