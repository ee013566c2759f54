"""Strengths: of stretched samples, and of discs between plates."""

from dusttaichi.analysis.diametral import FALL, diametral, is_diametral
from dusttaichi.analysis.numbers.registry import (
    Family,
    Observable,
    quiet,
    strength_by_law,
    uncertainty,
)
from dusttaichi.analysis.tensile import tensile
from dusttaichi.analysis.tension import missing_strength
from dusttaichi.analysis.texts import quantity_text


def _measure(run):
    problem = missing_strength(run)
    return {"strength_problem": problem} if problem else vars(tensile(run))


def _strength(passed, whole, error=""):
    """Text of a strength; passed: row that is true if the `whole` maximum was measured."""

    def text(value, n):
        strength = quantity_text(value, "Pa", n.get(error))
        return strength if n[passed] else f"at least {strength}: the {whole} not fallen yet"

    return text


def _where(value, n):
    return f"{value:.3g} from {n['phi_init']:.3g} (strain {n['strength_strain']:.2f})"


TENSION = Family(
    name="tension",
    title="stretching",
    place=30,
    applies=lambda run: run.stretches or missing_strength(run) is not None,
    measure=_measure,
    numbers=(
        Observable(name="strength_problem", title="tensile strength", unit="",
                   about="why there is no tensile strength",
                   column=("no strength", "{}", 1)),
        quiet("phi_init", "filling factor at the start", symbol=r"$\phi_{\rm init}$",
              column=("phi_init", "{:.3g}", 1)),
        Observable(name="strength", title="tensile strength", unit="Pa", error="strength_sigma",
                   why="strength_problem",
                   text=_strength("strength_passed", "stress had", "strength_sigma"),
                   literature=strength_by_law("strength_law"),
                   column=("strength kPa", "{:.3g}", 1e3), wanted=2, figure="tensile"),
        uncertainty("strength_sigma", "Pa", column=("± kPa", "{:.2g}", 1e3)),
        Observable(name="strength_phi", title="… at filling factor", text=_where,
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
DIAMETRAL = Family(
    name="diametral",
    title="diametral compression",
    place=32,
    applies=is_diametral,
    measure=diametral,
    numbers=(
        Observable(name="diametral_strength", title="diametral strength", unit="Pa",
                   value="strength", symbol=r"$2F/(\pi D L)$",
                   text=_strength("diametral_passed", "force has"),
                   literature=strength_by_law("diametral_law", "tensile strength, "),
                   about="2 F/(pi D L) of a lying cylinder between plates, at the largest force F "
                   f"(mean over ten records) before it falls by {FALL:.0%} and stays below",
                   column=("diametral kPa", "{:.3g}", 1e3), wanted=2, figure="diametral"),
        Observable(name="diametral_strain", title="… at a deflection over the diameter",
                   value="strength_strain",
                   text="{:.3g}", column=("at strain", "{:.3g}", 1)),
        Observable(name="diametral_phi", title="… filling factor of the cylinder", text="{:.3g}",
                   value="filling_factor",
                   about="volume of the grains over that of the cylinder that was cut",
                   column=("phi", "{:.3g}", 1)),
        quiet("diametral_passed", "the force has fallen since", "", value="passed",
              column=("maximum passed", "{!s}", 1)),
        quiet("diametral_law", "tensile strength at that filling factor by T19 eq 33", "Pa",
              value="law"),
    ),
)  # fmt: skip
FAMILIES = (TENSION, DIAMETRAL)
