"""A disc between two plates that press it across its axis (Brazilian test, Hondros 1959).

An elastic disc of diameter D and length L under a force F has the tension 2 F/(pi D L) in its
middle, across the load, whatever its elastic constants are. The value at the largest force is the
strength that the test measures.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.tensile import strength_law
from dusttaichi.analysis.tension import RECORDS
from dusttaichi.errors import DustError
from dusttaichi.names import LYING

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
    return run.boundary == "plates" and run.sample.get("shape") == LYING


def diametral(run):
    """The Diametral of a Run. Raises DustError where it is none, or too short."""
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
    number, passed = _first_maximum(middle, mean)
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
        law=strength_law(run, phi),
    )


def _first_maximum(strain, mean):
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
