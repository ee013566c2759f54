"""Numbers and figure of a disc between two plates that press it across its axis.

The Brazilian test (Hondros 1959). An elastic disc of diameter D and length L under a force F has
the tension 2 F/(pi D L) in its middle, across the load, whatever its elastic constants are. The
value at the largest force is the strength that the test measures.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi import plots
from dusttaichi.analysis import numbers
from dusttaichi.analysis.numbers.number_registry import (
    Family,
    Observable,
    quiet,
    strength_by_law,
    strength_text,
)
from dusttaichi.analysis.tensile import compute_strength_law
from dusttaichi.analysis.tension import RECORDS
from dusttaichi.errors import DustError
from dusttaichi.plots import style

FALL = 0.2
"""Share by which the force has to fall below its largest value, which then is the strength."""
LASTING = 0.05  #: Deflection over the diameter during which it must not reach that value again.


@dataclass(frozen=True)
class Diametral:
    """A diametral compression in n records, from its first to its last.

    diameter, length [m]: of the cylinder that was cut. filling_factor: of the grains in it.
    strain (n,): decrease of the distance of the plates over the first. stress [Pa] (n,):
    2 F/(pi D L) with the mean force F on the two plates, negative where they pull. mean [Pa] (n,):
    its mean over RECORDS records about each, not a number at both ends. strength [Pa],
    strength_strain: the first largest mean below which the stress has fallen by FALL, for LASTING
    at least, and the strain there. passed: there is one; otherwise `strength` is the largest mean.
    law [Pa]: tensile strength at that filling factor by T19 eq 33, NaN for an unknown material.
    """

    diameter: float
    length: float
    filling_factor: float
    strain: np.ndarray
    stress: np.ndarray
    mean: np.ndarray
    strength: float
    strength_strain: float
    passed: bool
    law: float


def is_diametral(run):
    """True of a Run in which two plates press a lying cylinder (sample.kind: cutout)."""
    return run.boundary == "plates" and run.lies


def measure_diametral(run):
    """Measure a diametral compression. Raises DustError for another Run or one too short."""
    sample = run.sample
    if not is_diametral(run):
        raise DustError(
            f"{run.path} is no diametral compression, which needs a lying cylinder (sample: "
            "{kind: cutout, diameter: ..., length: ...}) between plates (boundary: plates)."
        )
    series = run.series.isel(time=run.series.step.values > 0)
    if len(series.time) < RECORDS:
        raise DustError(
            f"{run.path} has {len(series.time)} records of the force; allowed: {RECORDS} or more."
        )
    diameter, length = sample["diameter"], sample["length"]
    push = series.wall_force.sel(xyz="z")
    force = 0.5 * (push.sel(wall="bottom").values - push.sel(wall="top").values)
    stress = 2.0 * force / (np.pi * diameter * length)
    strain = 1.0 - series.height.values / float(run.series.height[0])
    mean = np.convolve(stress, np.ones(RECORDS) / RECORDS, "valid")
    middle = np.convolve(strain, np.ones(RECORDS) / RECORDS, "valid")
    number, passed = _find_maximum(middle, mean)
    phi = float(_grain_volume(run) / (np.pi / 4.0 * diameter**2 * length))
    return Diametral(
        diameter=diameter,
        length=length,
        filling_factor=phi,
        strain=strain,
        stress=stress,
        mean=np.interp(strain, middle, mean, np.nan, np.nan),
        strength=float(mean[number]),
        strength_strain=float(middle[number]),
        passed=passed,
        law=compute_strength_law(run, phi),
    )


def _find_maximum(strain, mean):
    """Number of the value that is the strength, and whether the values have fallen since.

    It is the first maximum below which they fall by FALL and which they do not reach again within
    LASTING; without one the largest value.
    """
    top = np.maximum.accumulate(mean)
    for number in np.flatnonzero((top > 0.0) & (mean < (1.0 - FALL) * top)):
        after = (strain > strain[number]) & (strain < strain[number] + LASTING)
        if np.all(mean[after] < top[number]):
            return int(np.argmax(mean[:number])), True
    return int(np.argmax(mean)), False


def _grain_volume(run):
    radii = run.tree["snapshots"].to_dataset().radius.values
    return 4.0 / 3.0 * np.pi * np.sum(radii**3)


DIAMETRAL = Family(
    name="diametral",
    title="diametral compression",
    order=32,
    applies=is_diametral,
    measure=measure_diametral,
    numbers=(
        Observable(name="diametral_strength", title="diametral strength", unit="Pa",
                   value="strength", symbol=r"$2F/(\pi D L)$",
                   text=strength_text("diametral_passed", "force has"),
                   literature=strength_by_law("diametral_law", "tensile strength, "),
                   about="2 F/(pi D L) of a lying cylinder between plates, at the largest force F "
                   f"(mean over ten records) before it falls by {FALL:.0%} and stays below",
                   column=("diametral kPa", "{:.3g}", 1e3), trade_rank=2, figure="diametral"),
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
numbers.register(DIAMETRAL)


@plots.figure("Diametral compression", 111.5, name="diametral", applies=is_diametral, together=True)
def draw_diametral(runs, labels=None):
    """Nominal tension 2 F/(pi D L) against the deflection of one Run or several.

    Lines are means over ten records, points the strengths; hollow: the force has not fallen yet.
    With a single run the records themselves too.
    """
    runs, labels = style.label_runs(runs, labels)
    compressions = [measure_diametral(run) for run in runs]
    figure, (axes,) = style.create_figure()
    scale, unit = style.choose_unit(
        max(abs(test.strength) for test in compressions), style.PRESSURES
    )
    for number, (test, label) in enumerate(zip(compressions, labels, strict=True)):
        look = style.run_style(number)
        if len(compressions) == 1:
            style.draw_records(axes, test.strain, test.stress * scale, number)
        text = rf"{label}, $\phi$ = {test.filling_factor:.3g}"
        axes.plot(test.strain, test.mean * scale, label=text, **look)
        axes.plot(
            test.strength_strain,
            test.strength * scale,
            "o",
            color=look["color"],
            markerfacecolor=look["color"] if test.passed else "white",
            zorder=4,
        )
    if not all(test.passed for test in compressions):
        hollow = {"marker": "o", "color": "none", "markeredgecolor": style.GREY}
        axes.plot([], [], label="hollow: at least, the force has not fallen yet", **hollow)
    axes.axhline(0.0, color=style.GREY, linewidth=0.6)
    axes.set_xlabel("deflection over the diameter")
    axes.set_ylabel(rf"$2F/(\pi D L)$ ({unit})")
    style.draw_legend(axes)
    return figure


plots.register(draw_diametral)
