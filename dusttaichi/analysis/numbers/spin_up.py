"""Spin-up: the rotation rate at which an aggregate breaks, and the stress in it then."""

from dusttaichi.analysis.numbers.registry import Family, Observable, quiet, strength_by_law
from dusttaichi.analysis.spin_up import WHOLE, is_spun, spin_up
from dusttaichi.analysis.tensile import strength_law


def _measure(run):
    found = spin_up(run)
    return {
        "spin_rate": float(found.rate[found.top]),
        "spin_stress": float(found.stress[found.top]),
        "spin_phi": found.filling_factor,
        "spin_broken": found.broken is not None,
        "spin_law": strength_law(run, found.filling_factor),
    }


def _rate(value, n):
    text = f"{value:.3g} rad/s"
    whole = f"{WHOLE:.0%} of the mass in one fragment"
    return text if n["spin_broken"] else f"at least {text}: still {whole}"


SPIN_UP = Family(
    name="spin_up",
    title="an aggregate that is spun up",
    place=85,
    applies=is_spun,
    measure=_measure,
    numbers=(
        Observable(name="spin_rate", title="largest rotation rate", unit="rad/s", text=_rate,
                   about="largest rotation rate in a snapshot before the largest fragment has less "
                   f"than {WHOLE:.0%} of the mass", column=("largest rad/s", "{:.3g}", 1),
                   figure="spin_up"),
        Observable(name="spin_stress", title="… stress across a plane through the axis", unit="Pa",
                   literature=strength_by_law("spin_law", "tensile strength, "),
                   about="rho R^2 omega^2 / 4 at that rate",
                   column=("spin stress kPa", "{:.3g}", 1e3), wanted=2, figure="spin_up"),
        quiet("spin_phi", "filling factor of the sphere with the aggregate's radius of gyration",
              column=("phi of sphere", "{:.3g}", 1)),
        quiet("spin_broken", "the aggregate has broken", "", column=("broken", "{!s}", 1)),
        quiet("spin_law", "tensile strength at that filling factor by T19 eq 33", "Pa"),
    ),
)  # fmt: skip
FAMILIES = (SPIN_UP,)
