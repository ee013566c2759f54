"""The few numbers that tell how a run went, and the table that shows them."""

from dusttaichi.analysis.compression import compression_curve, fit_compression, rms_from_law
from dusttaichi.analysis.ledger import ledger
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import S12_STATIC


def summary(run, law=S12_STATIC):
    """The numbers of a Run as a dict (SI units; None where the run does not have them).

    name, status, grains, contacts, contacts_per_grain, coordination_number, steps, time,
    wall_time, steps_per_second, filling_factor, pressure (top wall), height: at the end;
    ledger_worst (relative), ledger_shares (channel -> share of the losses);
    p_m, p_m_sigma, delta, delta_sigma and law_p_m, law_delta, law_name beside them;
    rms, rms_mean (signed), rms_p_low, rms_p_high, rms_covered: distance from the law over
    1-100 kPa, see `rms_from_law`; fit_problem: why there is no fit, or None.
    """
    series = run.series
    numbers = {"name": run.name, "status": run.status, "grains": run.grains}
    last = series.isel(time=-1) if len(series.time) else None

    def final(name):
        return float(last[name]) if last is not None and name in series else None

    contacts, steps, wall_time = final("contact_count"), final("step"), final("wall_clock")
    numbers |= {
        "contacts": None if contacts is None else int(contacts),
        "contacts_per_grain": None if contacts is None or not run.grains else contacts / run.grains,
        "coordination_number": final("coordination_number"),
        "steps": None if steps is None else int(steps),
        "time": final("time"),
        "wall_time": wall_time,
        "steps_per_second": steps / wall_time if steps and wall_time else None,
        "filling_factor": final("filling_factor"),
        "height": final("height"),
        "pressure": float(last.pressure.sel(wall="top"))
        if last is not None and "pressure" in series else None,
    }  # fmt: skip
    energies = ledger(run)
    numbers |= {"ledger_worst": energies.worst, "ledger_shares": energies.shares}
    return numbers | _compression(run, law)


_COMPRESSION = (
    "p_m", "p_m_sigma", "delta", "delta_sigma", "law_p_m", "law_delta", "law_name",
    "rms", "rms_mean", "rms_p_low", "rms_p_high", "rms_covered", "fit_problem",
)  # fmt: skip


def _compression(run, law):
    numbers = dict.fromkeys(_COMPRESSION)
    if not run.compresses:
        return numbers
    curve = compression_curve(run)
    deviation = rms_from_law(curve, law)
    numbers |= {
        "law_p_m": law.p_m, "law_delta": law.delta, "law_name": law.name,
        "rms": deviation.rms, "rms_mean": deviation.mean, "rms_p_low": deviation.p_low,
        "rms_p_high": deviation.p_high, "rms_covered": deviation.covered,
    }  # fmt: skip
    try:
        fit = fit_compression(curve)
    except DustError as error:
        return numbers | {"fit_problem": str(error)}
    if fit.p_m_sigma > fit.p_m or fit.delta_sigma > fit.delta:
        return numbers | {"fit_problem": "the curve is too short or too rough to fix p_m and Delta"}
    return numbers | {
        "p_m": fit.p_m, "p_m_sigma": fit.p_m_sigma,
        "delta": fit.delta, "delta_sigma": fit.delta_sigma,
    }  # fmt: skip


def _duration(seconds):
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {seconds:02d} s"


def table(numbers):
    """Rows (what, run, laboratory) of text for a summary, in the order to print them.

    What the run does not have is left out.
    """
    n, rows = numbers, []

    def row(what, value, text, laboratory=""):
        if value is not None:
            rows.append((what, text(value), laboratory))

    row("status", n["status"], str)
    if n["p_m"] is not None:
        kpa, sigma = n["p_m"] / 1e3, n["p_m_sigma"] / 1e3
        laboratory = f"{n['law_p_m'] / 1e3:.3f} kPa"
        row("p_m", kpa, lambda v: f"{v:.2f} ± {sigma:.2f} kPa", laboratory)
        sigma_delta, laboratory = n["delta_sigma"], f"{n['law_delta']:.3f}"
        row("Delta", n["delta"], lambda v: f"{v:.3f} ± {sigma_delta:.3f}", laboratory)
    row("fit", n["fit_problem"], str)
    if n["rms"] is not None:
        within = "no pressure between 1 and 100 kPa reached"
        if n["rms_covered"]:
            within = f"{n['rms']:.3f} ({n['rms_p_low'] / 1e3:.3g}-{n['rms_p_high'] / 1e3:.3g} kPa)"
        law = n["law_name"].split(" (")[0] or "the law"
        row(f"rms of the filling factor from {law}", within, str, "0.02 (scatter)")
    row("filling factor", n["filling_factor"], "{:.4f}".format)
    row("pressure on the top wall", n["pressure"], lambda v: f"{v / 1e3:.4g} kPa")
    row("worst residual of the energy ledger", n["ledger_worst"], "{:.1e}".format)
    row("grains", n["grains"], "{:,}".format)
    row("contacts", n["contacts"], "{:,}".format)
    row("contacts per grain", n["contacts_per_grain"], "{:.2f}".format)
    row("steps", n["steps"], "{:,}".format)
    row("simulated time", n["time"], lambda v: f"{v * 1e6:.5g} us")
    row("wall time", n["wall_time"], _duration)
    row("steps per second", n["steps_per_second"], "{:,.0f}".format)
    return rows
