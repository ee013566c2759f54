"""A cell compressed from all sides, after Tatsuuma et al. 2023: pressure, and where energy is lost.

Named by the scenes in this folder under `extensions`; after arXiv:2306.09259.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi import plots
from dusttaichi.analysis import measure_isotropic_compression, numbers
from dusttaichi.analysis.isotropic import register
from dusttaichi.analysis.ledger import sum_losses_by_channel
from dusttaichi.analysis.numbers.compression import build_ratio_text, list_ratio_numbers
from dusttaichi.analysis.numbers.number_registry import Family, Observable, quiet
from dusttaichi.errors import DustError
from dusttaichi.physics.laws import rolling_energy
from dusttaichi.plots import style

CLOSEST_PACKING = 0.74  #: Filling factor at which equal spheres cannot be packed closer.
DENSE = 0.105  #: Smallest filling factor of the comparison: no bin of runs to 0.1.


def compressive_strength(phi, surface_energy, radius, critical_rolling):
    """Pressure [Pa] at `phi` up to dense packing, (E_roll/r^3) (1/phi - 1/0.74)^-3.

    `physics.laws.isotropic_pressure` where phi is small. Infinite from 0.74 on.
    """
    scale = rolling_energy(surface_energy, radius, critical_rolling) / radius**3
    with np.errstate(divide="ignore"):
        room = 1.0 / np.asarray(phi, dtype=float) - 1.0 / CLOSEST_PACKING
        return scale * np.maximum(room, 0.0) ** -3.0


def dense_ratio(run, low=DENSE, high=1.0):
    """Ratio of the pressure of a Run to this law, between two filling factors."""
    return measure_isotropic_compression(run, law=compressive_strength).ratio_between(low, high)


DENSE_COMPRESSION = Family(
    name="dense compression",
    title="compression from all sides up to dense packing",
    order=40.5,
    applies=lambda run: run.shrinks,
    measure=lambda run: list_ratio_numbers("dense_ratio", dense_ratio(run)),
    numbers=(
        Observable(name="dense_ratio", title="… over (E_roll/r^3)(1/phi - 1/0.74)^-3",
                   text=build_ratio_text("dense_ratio"), literature="1 (Tatsuuma et al. 2023)",
                   column=("P/Tatsuuma 2023", "{:.2f}", 1), short="pressure over Tatsuuma 2023",
                   figure="isotropic",
                   about="pressure over the law of Tatsuuma et al. 2023"),
        quiet("dense_ratio_scatter", "its scatter, in decades", short="Tatsuuma 2023: scatter"),
        quiet("dense_ratio_low", "smallest filling factor of the comparison",
              short="Tatsuuma 2023: from phi"),
        quiet("dense_ratio_high", "largest filling factor of the comparison",
              short="Tatsuuma 2023: to phi"),
    ),
)  # fmt: skip
numbers.register(DENSE_COMPRESSION)
register(r"$(E_{\rm roll}/r^3)(1/\phi-1/0.74)^{-3}$, Tatsuuma+ 2023", compressive_strength)


# -- losses --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LossShares:
    """Share of each channel in the losses while the filling factor grows through a bin."""

    filling_factor: np.ndarray  #: Middle of the bin in its logarithm, (bins,).
    by_channel: dict  #: Channel -> share, (bins,).
    lost: np.ndarray  #: By all channels [J], (bins,).


def loss_shares(run, decades=0.1):
    """Share of each channel in the losses of a cell in the first stage that compresses it evenly.

    Parameters
    ----------
    run : Run
    decades : float
        Width of the bins in lg(filling factor).

    Raises
    ------
    DustError
        The filling factor grows through less than one bin.
    """
    stage = run.part_that("shrinks")
    losses = sum_losses_by_channel(stage.series)
    phi = stage.series.filling_factor.values if "filling_factor" in stage.series else np.zeros(0)
    rising = np.maximum.accumulate(phi)
    first = np.ceil(np.log10(rising[0]) / decades - 1e-9) if len(phi) else 0.0
    last = np.floor(np.log10(rising[-1]) / decades + 1e-9) if len(phi) else 0.0
    if not losses or last <= first:
        raise DustError(f"{run.path} is not compressed enough for shares of its losses.")
    edges = np.arange(first, last + 1) * decades
    lost = {c: np.diff(np.interp(edges, np.log10(rising), v)) for c, v in losses.items()}
    total = sum(lost.values())
    is_lossy = total > 0.0
    shares = {c: v[is_lossy] / total[is_lossy] for c, v in lost.items()}
    return LossShares(10 ** (0.5 * (edges[1:] + edges[:-1]))[is_lossy], shares, total[is_lossy])


@plots.figure(
    "Share of each channel in the losses",
    55,
    name="loss_shares",
    applies=lambda run: run.shrinks,
    optional=True,
)
def draw_loss_shares(run):
    """Share of each channel in the losses of a run per tenth of a decade of the filling factor.

    In the paper rolling prevails below 0.1, sliding and twisting above.
    """
    result = loss_shares(run)
    figure, (axes,) = style.create_figure()
    for name, share in result.by_channel.items():
        if np.any(share):
            colour = style.CHANNEL_COLOURS.get(name, style.GREY)
            axes.plot(result.filling_factor, share, color=colour, label=name)
    style.set_logarithmic(axes, "x")
    axes.set(xlabel=r"filling factor $\phi$", ylabel="share of the energy lost", ylim=(0.0, None))
    style.draw_legend(axes)
    return figure


plots.register(draw_loss_shares)
