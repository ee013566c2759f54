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
