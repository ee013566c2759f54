"""Where the energy went while a sample was stretched or pressed (T19 Fig 9)."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.ledger import losses_by_channel
from dusttaichi.errors import DustError


@dataclass(frozen=True)
class Losses:
    """Energy lost since the start of a run or stage against filling factor.

    filling_factor (times,). by_channel: channel -> energy [J], (times,). total [J], (times,).
    T19's "normal" is forming and breaking together.
    """

    filling_factor: np.ndarray
    by_channel: dict
    total: np.ndarray


def losses_against_filling_factor(run, stage=None):
    """The Losses of a Run. stage: name or number (default: the first that stretches).

    Raises DustError where there is no filling factor.
    """
    part = run.part_that("stretches", stage)
    if "filling_factor" not in part.series:
        raise DustError(f"{run.path} has no filling factor to draw its losses against.")
    before = losses_by_channel(part.start.expand_dims("time"))
    lost = {c: v - before[c][0] for c, v in losses_by_channel(part.series).items()}
    phi = part.series.filling_factor.values
    return Losses(phi, lost, sum(lost.values(), np.zeros(len(phi))))


@dataclass(frozen=True)
class LossShares:
    """Share of each channel in the energy lost while the filling factor grows through a bin.

    filling_factor (bins,): middle of the bin in its logarithm. by_channel: channel -> share,
    (bins,). lost [J] (bins,): by all channels.
    """

    filling_factor: np.ndarray
    by_channel: dict
    lost: np.ndarray


def loss_shares(run, stage=None, decades=0.1):
    """The LossShares of a Run. stage: name or number (default: the first in which the cell shrinks
    along all axes alike). decades: width of the bins in lg(filling factor).

    Raises DustError where the filling factor does not grow through a bin at least.
    """
    part = run.part_that("shrinks", stage)
    losses = losses_by_channel(part.series)
    phi = part.series.filling_factor.values if "filling_factor" in part.series else np.zeros(0)
    rising = np.maximum.accumulate(phi)
    first = np.ceil(np.log10(rising[0]) / decades - 1e-9) if len(phi) else 0.0
    last = np.floor(np.log10(rising[-1]) / decades + 1e-9) if len(phi) else 0.0
    if not losses or last <= first:
        raise DustError(f"{run.path} is not compressed far enough to show where its energy went.")
    edges = np.arange(first, last + 1) * decades
    lost = {c: np.diff(np.interp(edges, np.log10(rising), v)) for c, v in losses.items()}
    total = sum(lost.values())
    known = total > 0.0
    shares = {c: v[known] / total[known] for c, v in lost.items()}
    return LossShares(10 ** (0.5 * (edges[1:] + edges[:-1]))[known], shares, total[known])
