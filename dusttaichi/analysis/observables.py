"""What a user wants from a run, as numbers that two runs of one scene can be compared by."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.compression import compression_curve
from dusttaichi.analysis.ledger import losses_by_channel
from dusttaichi.analysis.summary import summary
from dusttaichi.names import CHANNELS, EXTRA_CHANNELS

CURVE = "phi_rms"
GRID = 201  # pressures at which two curves are compared


@dataclass(frozen=True)
class Observable:
    """A number of a run. value: from (Run, its summary), None where the run does not have it."""

    name: str
    units: str
    text: str
    value: Callable


def _of_summary(key):
    return lambda run, numbers: numbers.get(key)


def _lost(run, numbers):
    return sum(float(loss[-1]) for loss in losses_by_channel(run.series).values())


def _last(*names):
    """Sum of variables of the series in the last record."""
    return lambda run, numbers: float(
        sum(run.series[name][-1].sum() for name in names if name in run.series)
    )


def _channel(name):
    return lambda run, numbers: float(losses_by_channel(run.series).get(name, [0.0])[-1])


# In the order of what is wanted first; before them all stands the curve of a compression.
WANTED = (
    Observable("p_m", "Pa", "p_m of S12 eq 31 fitted to phi(P)", _of_summary("p_m")),
    Observable("strength", "Pa", "tensile strength", _of_summary("strength")),
    Observable("ratio", "1", "pressure over (E_roll/r^3) phi^3 (T19 eq 9)", _of_summary("ratio")),
    Observable("sound_speed", "m/s", "speed of sound", _of_summary("sound_speed")),
    Observable("restitution", "1", "coefficient of restitution", _of_summary("restitution")),
    Observable(
        "depth", "m", "depth of a bead, g t^2/2 taken away", _of_summary("depth_weightless")
    ),
    Observable(
        "stopping_time", "s", "its stopping time, so too", _of_summary("stopping_time_weightless")
    ),
    Observable("dust_restitution", "1", "restitution of dust", _of_summary("dust_restitution")),
    Observable("growth_efficiency", "1", "growth efficiency", _of_summary("growth_efficiency")),
    Observable("largest_share", "1", "share of the largest fragment", _of_summary("largest_share")),
    Observable("fragments", "1", "fragments", _of_summary("fragments")),
)
# Where a scene has none of these: energies at the end.
ENERGIES = (
    Observable("lost", "J", "energy lost in all channels", _lost),
    *(
        Observable(f"lost_{name}", "J", f"energy lost on {name}", _channel(name))
        for name in (*CHANNELS, *EXTRA_CHANNELS)
    ),
    Observable(
        "kinetic",
        "J",
        "kinetic energy at the end",
        _last("kinetic_translation", "kinetic_rotation"),
    ),
    Observable(
        "potential", "J", "potential energy at the end", _last("potential", "potential_wall")
    ),
)
TEXTS = {CURVE: "rms distance of phi(P) from the reference"} | {
    o.name: o.text for o in (*WANTED, *ENERGIES)
}
UNITS = {CURVE: "1"} | {o.name: o.units for o in (*WANTED, *ENERGIES)}


@dataclass(frozen=True)
class Measured:
    """What one run gave. values: name -> number (SI). curve: (lg P [Pa], phi), each (bins,), of a
    compression under a wall (`Curve.monotone`), or None."""

    values: dict
    curve: tuple | None = None

    @property
    def names(self):
        """Observables that it has, in the order in which they are wanted."""
        return ([CURVE] if self.curve is not None else []) + list(self.values)

    def to_json(self):
        return {"values": self.values, "curve": self.curve and [list(c) for c in self.curve]}

    @classmethod
    def from_json(cls, data):
        curve = data["curve"] and tuple(np.array(c) for c in data["curve"])
        return cls(data["values"], curve)


def measured(run):
    """The Measured of a Run: what it has of WANTED, else of ENERGIES; and its curve."""
    numbers = summary(run)
    curve = compression_curve(run).monotone() if run.compresses else None
    if curve is not None and len(curve[0]) < 2:
        curve = None
    values = _values(WANTED, run, numbers)
    if not values and curve is None and len(run.series.time):
        values = _values(ENERGIES, run, numbers)
    return Measured(values, curve and tuple(c.tolist() for c in curve))


def _values(observables, run, numbers):
    found = {o.name: o.value(run, numbers) for o in observables}
    return {n: float(v) for n, v in found.items() if v is not None and np.isfinite(v)}


def together(curves):
    """Curves (lg P, phi) at GRID common pressures: (lg P, (curves, GRID)); None without any."""
    low, high = max(c[0][0] for c in curves), min(c[0][-1] for c in curves)
    if not high > low:
        return None
    grid = np.linspace(low, high, GRID)
    return grid, np.array([np.interp(grid, *c) for c in curves])


def differences(one, reference):
    """Name -> (value, error) of a Measured beside that of the reference; nan where it lacks it.

    The error of a number is |value - reference value| / |reference value|. Where the reference is
    0 (a pair that sticks: no restitution) it is |value| of a number without a unit; with a unit, 0
    or infinity.
    The value of CURVE is the rms, at GRID even steps of lg P over the pressures that both curves
    reach, of the difference of their filling factors; its error is that over the mean filling
    factor of the reference there. So a tolerance of 5 % is a filling factor wrong by a twentieth.
    """
    out = {}
    for name in reference.names:
        if name == CURVE:
            out[name] = _curves(one, reference)
            continue
        value, right = one.values.get(name, np.nan), reference.values[name]
        out[name] = (value, _relative(abs(value - right), right, UNITS[name]))
    return out


def _curves(one, reference):
    both = None if one.curve is None else together([one.curve, reference.curve])
    if both is None:
        return np.nan, np.nan
    mine, right = both[1]
    rms = float(np.sqrt(np.mean((mine - right) ** 2)))
    return rms, rms / float(right.mean())


def _relative(difference, right, units):
    if right != 0.0:
        return difference / abs(right)
    if units == "1":
        return difference
    return np.inf if difference > 0.0 else difference


def scatter(runs, reference):
    """Name -> standard deviation (n - 1) of Measured of several seeds, as an error of `differences`

    is: over the reference value; of CURVE the root of the mean variance over the pressures that
    all reach, over the mean filling factor there. nan where fewer than two have the number.
    """
    out = {}
    for name in reference.names:
        out[name] = np.nan
        if name == CURVE:
            curves = [run.curve for run in runs if run.curve is not None]
            found = together(curves) if len(curves) > 1 else None
            if found is not None:
                phi = found[1]
                out[name] = float(np.sqrt(phi.var(axis=0, ddof=1).mean()) / phi.mean())
            continue
        values = [run.values[name] for run in runs if name in run.values]
        if len(values) > 1:
            spread = float(np.std(values, ddof=1))
            out[name] = _relative(spread, reference.values[name], UNITS[name])
    return out
