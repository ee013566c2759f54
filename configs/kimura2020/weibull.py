"""Weibull statistics of strengths: their scatter between samples, and the effect of the size.

A sample fails below a stress s with probability 1 - exp(-(s/s_0)^m), where m is the Weibull modulus
and s_0 the scale (Weibull 1939). If the weakest of independent volumes decides, m is the same for
all sizes and s_0 falls with the number of grains as N^(-1/m).

Named by the scene in this folder under `extensions`.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy

from dusttaichi.analysis import numbers
from dusttaichi.analysis.ensemble_tables import axes_of, point_labels
from dusttaichi.analysis.numbers.number_registry import Statistics
from dusttaichi.analysis.texts import format_quantity
from dusttaichi.analysis.thresholds import CONFIDENCE
from dusttaichi.plots import style

FEWEST = 5
"""Samples at least for a modulus; with fewer its interval spans more than a factor of two."""
DRAWS = 20_000
"""Sets of samples drawn for the intervals, whose ends they give within a per cent or two."""


@dataclass(frozen=True)
class Weibull:
    """Weibull distribution of `count` strengths.

    modulus: m. scale [Pa]: s_0, the strength that exp(-1) of all samples exceed. Both are unbiased
    in the median; low and high are the ends of their intervals of confidence.
    """

    modulus: float
    modulus_low: float
    modulus_high: float
    scale: float
    scale_low: float
    scale_high: float
    count: int

    def failed_fraction(self, stress):
        """Share of the samples that fail below `stress` [Pa]."""
        return -np.expm1(-((np.asarray(stress, float) / self.scale) ** self.modulus))


def fit_weibull(strengths, confidence=CONFIDENCE):
    """Weibull distribution of strengths by maximum likelihood, with exact intervals.

    m_fit/m and m_fit ln(s_fit/s_0) have distributions that do not depend on m and s_0 (Thoman, Bain
    and Antle 1969, Technometrics 11, 445). Their quantiles, from DRAWS sets of n samples, remove
    the bias of few samples and give intervals whose coverage is exact for any n.

    Parameters
    ----------
    strengths : array_like
        Strengths [Pa], (n,).
    confidence : float
        Confidence of the intervals.

    Returns
    -------
    Weibull or None
        None for fewer than FEWEST strengths, for one that is not positive, or where all are equal.
    """
    strengths = np.asarray(strengths, float)
    if len(strengths) < FEWEST or np.any(strengths <= 0) or np.ptp(strengths) == 0:
        return None
    logs = np.log(strengths)
    modulus, log_scale = (values.item() for values in _fit_logs(logs[None]))
    tail = 0.5 * (1.0 - confidence)
    ratio, shift = np.quantile(_compute_pivots(len(logs)), [tail, 0.5, 1.0 - tail], axis=1).T
    high, middle, low = modulus / ratio
    scales = np.exp(log_scale - shift / modulus)
    return Weibull(middle, low, high, scales[1], scales[2], scales[0], len(logs))


@cache
def _compute_pivots(count):
    """m_fit/m and m_fit ln(s_fit/s_0) of DRAWS sets of `count` samples, (2, DRAWS)."""
    draws = np.random.default_rng(0).standard_exponential((DRAWS, count))
    modulus, log_scale = _fit_logs(np.log(draws))  # of m = 1, s_0 = 1
    return np.array([modulus, modulus * log_scale])


def _fit_logs(logs):
    """Moduli and logarithms of the scales of greatest likelihood, (sets,), of logs (sets, n).

    The modulus is the root of sum(s^m ln s)/sum(s^m) - 1/m - mean(ln s), which grows with m.
    Newton's method starts below the root.
    """
    middle, width = logs.mean(axis=1, keepdims=True), logs.std(axis=1, keepdims=True)
    z = (logs - middle) / width

    def means(m):
        weights = np.exp(m[:, None] * z)
        weights /= weights.sum(axis=1, keepdims=True)
        first = (weights * z).sum(axis=1)
        return first, (weights * (z - first[:, None]) ** 2).sum(axis=1)

    start = np.full(len(z), 0.5)
    shape = scipy.optimize.newton(
        lambda m: means(m)[0] - 1.0 / m, start, fprime=lambda m: means(m)[1] + 1.0 / m**2
    )
    scale = scipy.special.logsumexp(shape[:, None] * z, axis=1, b=1.0 / z.shape[1]) / shape
    width, middle = width[:, 0], middle[:, 0]
    return shape / width, middle + width * scale


@dataclass(frozen=True)
class Strengths:
    """Strengths [Pa] (n,) of the samples of one point of a sweep; grains: of each sample.

    label: of the point. fit: their Weibull, or None.
    """

    label: str
    grains: int
    values: np.ndarray
    fit: Weibull | None


def list_strengths(data):
    """A Strengths for each point of a dataset of `analysis.gather`, in order; [] without strengths.

    Runs without a strength are left out.
    """
    if "strength" not in data or "grains" not in data:
        return []
    dims, labels = (*axes_of(data), "replica"), point_labels(data)
    values = data.strength.transpose(*dims).values.reshape(len(labels), -1)
    grains = data.grains.transpose(*dims).values.reshape(len(labels), -1)
    groups = []
    for label, strengths, count in zip(labels, values, grains, strict=True):
        finite = strengths[np.isfinite(strengths)]
        if len(finite):
            groups.append(Strengths(label, round(np.nanmedian(count)), finite, fit_weibull(finite)))
    return groups


@dataclass(frozen=True)
class SizeEffect:
    """Strength = factor * N^exponent [Pa] of samples of N grains, geometric mean of the samples.

    exponent_sigma: 1-sigma uncertainty, from the scatter between samples. weakest_link: -1/m, the
    exponent if the weakest of independent volumes decides; m is that of the pooled scatter of
    ln(strength) about the mean of each size, pi/(sqrt(6) std).
    """

    factor: float
    exponent: float
    exponent_sigma: float
    weakest_link: float

    def strength(self, grains):
        """Geometric mean of the strengths [Pa] of samples of `grains` grains."""
        return self.factor * np.asarray(grains, float) ** self.exponent


def fit_size_effect(groups):
    """The SizeEffect of several Strengths: least squares in the logarithms, each sample once.

    None for a single size, fewer than three samples, or a strength that is not positive.
    """
    sizes = {group.grains for group in groups}
    logs = [group.values for group in groups]
    count = sum(map(len, logs))
    if len(sizes) < 2 or count <= len(groups) or min(map(np.min, logs)) <= 0:
        return None
    logs = [np.log(strengths) for strengths in logs]
    x = np.log(np.repeat([group.grains for group in groups], [len(values) for values in logs]))
    y, away = np.concatenate(logs), x - x.mean()
    exponent = np.sum(away * y) / np.sum(away**2)
    scatter = np.sqrt(
        sum(np.sum((values - values.mean()) ** 2) for values in logs) / (count - len(groups))
    )
    return SizeEffect(
        factor=float(np.exp(y.mean() - exponent * x.mean())),
        exponent=float(exponent),
        exponent_sigma=float(scatter / np.sqrt(np.sum(away**2))),
        weakest_link=float(-scatter * np.sqrt(6.0) / np.pi),
    )


def tabulate_strengths(groups):
    """(columns, lines) about several Strengths, as `Statistics` has them.

    columns: (header, texts), a row for each with a Weibull; [] where there is none. lines:
    sentences on the effect of the size.
    """
    fitted = [group for group in groups if group.fit is not None]
    if not fitted:
        return [], []
    columns = [
        ("point", [group.label or "all" for group in fitted]),
        ("grains", [f"{group.grains:,}" for group in fitted]),
        ("samples", [str(group.fit.count) for group in fitted]),
        ("mean", [format_quantity(g.values.mean(), "Pa", g.values.std(ddof=1)) for g in fitted]),
        ("modulus m", [_format_interval(group.fit, "modulus", 1.0) for group in fitted]),
        ("scale (kPa)", [_format_interval(group.fit, "scale", 1e-3) for group in fitted]),
    ]
    lines = [f"in brackets: {CONFIDENCE:.0%} confidence"]
    if (effect := fit_size_effect(groups)) is not None:
        lines.append(
            f"strength ∝ N^({effect.exponent:.3f} ± {effect.exponent_sigma:.3f}); a weakest link "
            f"with this scatter: N^({effect.weakest_link:.3f})"
        )
    return columns, lines


def _format_interval(fit, name, factor):
    ends = [getattr(fit, f"{name}{end}") * factor for end in ("", "_low", "_high")]
    return "{:.3g} ({:.3g} to {:.3g})".format(*ends)


# -- figure ----------------------------------------------------------------------------------------


@style.apply_style
def draw_strengths(groups):
    """Samples of several Strengths; None where none has a Weibull modulus.

    A Weibull plot, in which a Weibull distribution is a straight line with its modulus as slope;
    and, for several sizes, the strengths against the number of grains with their geometric mean,
    the fitted power law and that of a weakest link.
    """
    if not any(group.fit for group in groups):
        return None
    effect = fit_size_effect(groups)
    figure, panels = style.create_grid(1 if effect is None else 2, 2, 3.2)
    scale, unit = style.choose_unit(max(g.values.max() for g in groups), style.PRESSURES)
    _draw_probabilities(panels[0], groups, scale, unit)
    if effect is not None:
        _draw_sizes(panels[1], groups, effect, (scale, unit))
    return figure


def _draw_probabilities(axes, groups, scale, unit):
    for number, group in enumerate(groups):
        if group.fit is None:
            continue
        colour = style.run_style(number)["color"]
        values = np.sort(group.values)
        # median ranks, which are those of a straight line for a Weibull distribution
        failed = (np.arange(1, len(values) + 1) - 0.3) / (len(values) + 0.4)
        label = f"{group.label or 'all'}: m = {group.fit.modulus:.1f}"
        axes.plot(
            values * scale,
            _compute_ordinate(failed),
            "o",
            markersize=3.5,
            color=colour,
            label=label,
        )
        line = np.geomspace(0.9 * values[0], 1.1 * values[-1], 50)
        axes.plot(
            line * scale,
            _compute_ordinate(group.fit.failed_fraction(line)),
            color=colour,
            linewidth=1.0,
        )
    ticks = np.array([0.02, 0.05, 0.1, 0.2, 0.5, 0.8, 0.95])
    axes.set_yticks(_compute_ordinate(ticks), [f"{tick:g}" for tick in ticks])
    axes.set(xscale="log", xlabel=f"tensile strength ({unit})", ylabel="share of weaker samples")
    axes.set_ylim(*_compute_ordinate(np.array([0.02, 0.98])))
    style.set_few_ticks(axes.xaxis)
    style.draw_legend(axes)


def _compute_ordinate(share):
    return np.log(-np.log1p(-share))


def _draw_sizes(axes, groups, effect, scaling):
    scale, unit = scaling
    colours = [style.run_style(number)["color"] for number in range(len(groups))]
    for group, colour in zip(groups, colours, strict=True):
        grains = np.full(len(group.values), group.grains)
        dots = {"markersize": 2.5, "markeredgewidth": 0, "alpha": 0.4}
        axes.plot(grains, group.values * scale, "o", color=colour, **dots)
        logs = np.log(group.values)
        mean = np.exp(logs.mean()) * scale
        error = mean * logs.std(ddof=1) / np.sqrt(len(logs)) if len(logs) > 1 else 0.0
        axes.errorbar(group.grains, mean, error, fmt="o", ms=5, capsize=2, color=colour)
    ends = np.array([min(g.grains for g in groups), max(g.grains for g in groups)])
    line = np.geomspace(0.8 * ends[0], 1.25 * ends[1], 50)
    text = rf"fit, $\propto N^{{{effect.exponent:.3f}\pm{effect.exponent_sigma:.3f}}}$"
    axes.plot(line, effect.strength(line) * scale, label=text, **style.line_look(style.GREY))
    weakest = effect.strength(ends[0]) * (line / ends[0]) ** effect.weakest_link
    text = rf"weakest link, $\propto N^{{{effect.weakest_link:.2f}}}$"
    dashes = style.line_look(style.BLACK, 1.0, style.DASHED)
    axes.plot(line, weakest * scale, label=text, **dashes)
    axes.set(xscale="log", yscale="log", xlabel="number of grains N")
    axes.set_ylabel(f"tensile strength ({unit})")
    axes.set_xticks(sorted({g.grains for g in groups}), minor=False)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:.0f}")
    axes.xaxis.set_minor_formatter(lambda value, _: "")
    style.set_few_ticks(axes.yaxis)
    style.draw_legend(axes)


WEIBULL = Statistics(
    name="weibull",
    title="Weibull statistics of the tensile strength",
    table=lambda data: tabulate_strengths(list_strengths(data)),
    draw=lambda data: draw_strengths(list_strengths(data)),
)
numbers.register(WEIBULL)
