"""Shear and triaxial tests: strength of the last one, and line of friction through all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from dusttaichi.analysis.friction import fit_friction
from dusttaichi.analysis.loads import (
    is_triaxial,
    measure_shear_tests,
    measure_triaxial_tests,
)
from dusttaichi.analysis.numbers.number_registry import AUTO, Family, Observable, quiet, uncertainty
from dusttaichi.analysis.texts import format_quantity

if TYPE_CHECKING:
    from dusttaichi.analysis.loads import StrengthTest
    from dusttaichi.analysis.run import Run


def _build_measurement(
    prefix: str, measure_tests: Callable[[Run], Sequence[StrengthTest]], attribute_prefix: str
) -> Callable[[Run], dict[str, float]]:
    """Measurement of one kind of test.

    measure_tests: function from a Run to all of them; attribute_prefix: of Friction.
    """

    def measure(run: Run) -> dict[str, float]:
        tests = measure_tests(run)
        # under another load than the prescribed one (`missed_loads`) there is no strength to give
        names = () if tests[-1].missed else ("strength", "strength_sigma", "load", "density")
        numbers = {f"{prefix}_{name}": getattr(tests[-1], name) for name in names}
        line = fit_friction(tests)
        for name in ("angle", "angle_sigma", "cohesion") if line else ():
            numbers[f"{prefix}_{name}"] = getattr(line, attribute_prefix + name)
        return numbers

    return measure


def _list_test_numbers(prefix: str, strength: str, load: str) -> tuple[Observable, ...]:
    """Rows of one kind of test; strength, load: names of the stresses."""

    def under(value: float, n: Mapping[str, Any]) -> str:
        text = format_quantity(value, "Pa", n[f"{prefix}_strength_sigma"])
        load, phi = format_quantity(n[f"{prefix}_load"], "Pa"), n[f"{prefix}_density"]
        return f"{text} (under {load}, filling factor {phi:.3g})"

    def degrees(value: float, n: Mapping[str, Any]) -> str:
        sigma = n[f"{prefix}_angle_sigma"]
        return f"{value:.3g}{f' ± {sigma:.2g}' if sigma == sigma else ''}°"

    return (
        Observable(name=f"{prefix}_strength", title=strength, unit="Pa", text=under,
                   error=f"{prefix}_strength_sigma", figure=prefix),
        uncertainty(f"{prefix}_strength_sigma", "Pa"),
        quiet(f"{prefix}_load", load, "Pa", column=AUTO),
        quiet(f"{prefix}_density", f"filling factor at the {strength}"),
        Observable(name=f"{prefix}_angle", title="friction angle", unit="degree", text=degrees,
                   error=f"{prefix}_angle_sigma", figure=prefix),
        uncertainty(f"{prefix}_angle_sigma", "degree"),
        Observable(name=f"{prefix}_cohesion", title="cohesion of the line of friction", unit="Pa",
                   figure=prefix),
    )  # fmt: skip


SHEAR = Family(
    name="shear",
    title="shear",
    order=50,
    applies=lambda run: run.sheared,
    optional=True,  # no stage has three records so far
    measure=_build_measurement("shear", measure_shear_tests, ""),
    numbers=_list_test_numbers("shear", "shear strength of the last stage", "normal stress at it"),
)
TRIAXIAL = Family(
    name="triaxial",
    title="triaxial test",
    order=55,
    applies=is_triaxial,
    optional=True,
    measure=_build_measurement("triaxial", measure_triaxial_tests, "triaxial_"),
    numbers=_list_test_numbers(
        "triaxial", "deviator of the last triaxial test", "confining stress at it"
    ),
)
FAMILIES = (SHEAR, TRIAXIAL)
