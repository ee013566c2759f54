"""Error of the time step, from segments of a run that were repeated at half the step."""

from dataclasses import dataclass

import numpy as np
import scipy
import yaml

RICHARDSON = 4.0 / 3.0  # of the difference between dt and dt/2, for a method of second order
SURE = 0.975  # quantile beyond which an error exceeds the scatter: 95 % two-sided
QUANTITIES = {  # name -> (text, unit); loss_CHANNEL beside these
    "pressure": ("pressure on the top wall", "Pa"),
    "wall_force": ("force on the wall", "N"),
    "stress_xx": ("stress xx", "Pa"),
    "stress_yy": ("stress yy", "Pa"),
    "stress_zz": ("stress zz", "Pa"),
    "filling_factor": ("filling factor between the plates", "1"),
    "body_height": ("height of the first rigid body", "m"),
    "kinetic_energy": ("kinetic energy", "J"),
    "coordination_number": ("coordination number", "1"),
    "losses": ("energy lost", "J"),
    "work": ("work done from outside", "J"),
    "energy_end": ("energy at the end", "J"),
}
HIDDEN = ("coordination_number", "work", "energy_end")  # in the table of a run


@dataclass(frozen=True)
class Estimate:
    """A quantity over all segments, and its error due to the time step [unit]."""

    value: float  #: Mean of the values of the run over the segments.
    error: float  #: Excess of the value at the step of the run.
    scatter: float  #: Standard error of `error`; NaN for a single segment of two levels.
    relative_error: float  #: Error over the mean size of the quantity.
    relative_scatter: float  #: Scatter over the same.
    resolved: bool  #: True if the error exceeds the scatter (95 %).
    unit: str


@dataclass(frozen=True)
class ErrorBar:
    """Error of the time step of a run."""

    estimates: dict  #: Quantity (QUANTITIES, loss_CHANNEL) -> Estimate.
    segments: tuple  #: (first step, steps) of each segment.
    share: float  #: Share of the steps of the run in the segments.
    cost: float | None  #: Run time over that of the run (None if unknown).
    whole: bool  #: True if the whole run was repeated, at a half and a quarter of its step.
    time_step: float  #: Step of the run [s].
    #: Root mean square distance of grains at the end of a segment between dt and dt/2, median [m].
    apart: float
    residual: tuple  #: Largest residual of the ledger in a segment, at dt and dt/2.


def error_bar(run):
    """Error of the time step of a run; None for a run without `--error-bar`."""
    text = run.attrs.get("error_bar", "")
    if not text:
        return None
    data = yaml.safe_load(text)
    segments = data["stretches"]
    names = segments[0]["values"]
    values = {name: np.array([s["values"][name] for s in segments]) for name in names}
    residual = np.abs(values.pop("residual")).max(axis=0)
    whole = len(segments[0]["apart"]) > 1
    estimate = of_levels if whole else of_segments
    units = {name: unit for name, (_, unit) in QUANTITIES.items()}
    return ErrorBar(
        estimates={n: estimate(v, units.get(n, "J")) for n, v in values.items() if v[:, 0].any()},
        segments=tuple((s["step"], s["steps"]) for s in segments),
        share=sum(s["steps"] for s in segments) / data["run_steps"],
        cost=data["cost"],
        whole=whole,
        time_step=data["time_step"],
        apart=float(np.median([s["apart"][0] for s in segments])),
        residual=tuple(float(r) for r in residual),
    )


def of_segments(values, unit="1"):
    """Estimate from values at dt and dt/2 of several segments, (segments, 2).

    The relative error is the sum of the differences over the sum of the sizes, so that segments are
    weighted by their size; its standard error is that of a ratio of means.
    """
    values = np.asarray(values, float)
    n, size = len(values), np.abs(values[:, 0])
    difference = RICHARDSON * (values[:, 0] - values[:, 1])
    relative = difference.sum() / size.sum()
    scatter, resolved = np.nan, False
    if n > 1:
        rest = difference - relative * size
        scatter = np.sqrt(n / (n - 1) * np.sum(rest**2)) / size.sum()
        # the quantile of Student's t; scipy.stats takes long to import
        resolved = abs(relative) > scipy.special.stdtrit(n - 1, SURE) * scatter
    return _estimate(
        values[:, 0].mean(), relative, scatter, size=size.mean(), resolved=resolved, unit=unit
    )


def of_levels(values, unit="1"):
    """Estimate from the values of one run at dt, dt/2 and dt/4, (1, 3).

    The two finer ones are extrapolated to the value without error. Its difference from the
    extrapolation of the two coarser ones is the scatter: small where the quantity converges in
    second order, as large as the error where the trajectories have diverged.
    """
    ((at_dt, half, quarter),) = np.asarray(values, float)
    size = abs(at_dt)
    error = at_dt - (quarter + (quarter - half) / 3.0)
    scatter = abs((at_dt - half) - 4.0 * (half - quarter)) / 3.0
    return _estimate(
        at_dt,
        error / size if size else np.nan,
        scatter / size if size else np.nan,
        size=size,
        resolved=abs(error) > 2.0 * scatter,
        unit=unit,
    )


def _estimate(value, relative, scatter, *, size, resolved, unit):
    return Estimate(
        value=float(value),
        error=float(relative * size),
        scatter=float(scatter * size),
        relative_error=float(relative),
        relative_scatter=float(scatter),
        resolved=bool(resolved),
        unit=unit,
    )


def filling_factor_error(bar, curve):
    """(error, scatter) of the filling factor at a given pressure, from that of the pressure.

    curve: the Curve of the run, whose mean slope over lg P converts one into the other. None
    without a pressure or a curve.
    """
    lg_pressure, phi = curve.monotone()
    if bar is None or "pressure" not in bar.estimates or len(phi) < 3:
        return None
    slope = np.polyfit(lg_pressure, phi, 1)[0] / np.log(10.0)
    pressure = bar.estimates["pressure"]
    return -slope * pressure.relative_error, slope * pressure.relative_scatter


def error_bar_rows(bar, of_filling_factor=None):
    """Rows (what, run, literature) of text for the table of a run; [] where `bar` is None.

    of_filling_factor: result of filling_factor_error.
    """
    if bar is None:
        return []
    dt = 1e9 * bar.time_step
    if bar.whole:
        where = f"the whole run at {dt:.4g}, {dt / 2:.4g} and {dt / 4:.4g} ns"
    else:
        steps = sum(steps for _, steps in bar.segments)
        where = f"{len(bar.segments)} segments, {steps:,} steps ({bar.share:.0%}), at {dt:.4g} "
        where += f"and {dt / 2:.4g} ns"
    cost = "" if bar.cost is None else f"; {bar.cost:.0%} of the run's time"
    rows = [("error bar of the time step", where + cost, "")]
    for name, (text, _) in QUANTITIES.items():
        if name in bar.estimates and name not in HIDDEN:
            rows.append((f"… {text}", estimate_text(bar.estimates[name]), ""))
        if name == "pressure" and of_filling_factor is not None:
            text = "{:+.2g} ± {:.1g}".format(*of_filling_factor)
            rows.append(("… filling factor at a pressure", text, ""))
    residuals = ", ".join(f"{r:.1e}" for r in bar.residual)
    rows.append(("… residual of the ledger", residuals, ""))
    return rows


def estimate_text(estimate):
    """`+0.4 ± 1.2 %: within its scatter`."""
    text = f"{100 * estimate.relative_error:+.2g}"
    if np.isfinite(estimate.relative_scatter):
        text += f" ± {100 * estimate.relative_scatter:.2g}"
    text += " %"
    if not np.isfinite(estimate.relative_scatter):
        return f"{text} (one segment: scatter unknown)"
    return text if estimate.resolved else f"{text} (no more than its scatter)"
