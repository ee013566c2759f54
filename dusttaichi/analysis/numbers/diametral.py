"""Diametral compression of a disc: its strength."""

from dusttaichi.analysis.diametral import FALL, diametral, is_diametral
from dusttaichi.analysis.numbers.registry import Family, Observable, quiet, strength_by_law
from dusttaichi.analysis.tensile import strength_law
from dusttaichi.analysis.texts import quantity_text


def _measure(run):
    found = diametral(run)
    return {
        "diametral_strength": found.strength,
        "diametral_strain": found.strength_strain,
        "diametral_phi": found.filling_factor,
        "diametral_passed": found.passed,
        "diametral_law": strength_law(run, found.filling_factor),
    }


def _strength(value, n):
    text = quantity_text(value, "Pa")
    return text if n["diametral_passed"] else f"at least {text}: the force has not fallen yet"


DIAMETRAL = Family(
    name="diametral",
    title="diametral compression",
    place=32,
    applies=is_diametral,
    measure=_measure,
    numbers=(
        Observable(name="diametral_strength", title="diametral strength", unit="Pa",
                   symbol=r"$2F/(\pi D L)$", text=_strength,
                   literature=strength_by_law("diametral_law", "tensile strength, "),
                   about="2 F/(pi D L) of a lying cylinder between plates, at the largest force F "
                   f"(mean over ten records) before it falls by {FALL:.0%} and stays below",
                   column=("diametral kPa", "{:.3g}", 1e3), wanted=2, figure="diametral"),
        Observable(name="diametral_strain", title="… at a deflection over the diameter",
                   text="{:.3g}", column=("at strain", "{:.3g}", 1)),
        Observable(name="diametral_phi", title="… filling factor of the cylinder", text="{:.3g}",
                   about="volume of the grains over that of the cylinder that was cut",
                   column=("phi", "{:.3g}", 1)),
        quiet("diametral_passed", "the force has fallen since", "",
              column=("maximum passed", "{!s}", 1)),
        quiet("diametral_law", "tensile strength at that filling factor by T19 eq 33", "Pa"),
    ),
)  # fmt: skip
FAMILIES = (DIAMETRAL,)
