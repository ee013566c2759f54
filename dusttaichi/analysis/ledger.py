"""The energy ledger of a run: its residual, and the losses by channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.results.datasets import read_at
from dusttaichi.results.variables import reference_energy

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.run import Run


KINETIC = ("kinetic_translation", "kinetic_rotation", "sphere_kinetic", "kinetic")
CONTACTS = ("potential", "potential_wall", "potential_sphere")
LOSSES = ("loss", "loss_wall", "loss_sphere")
POTENTIAL = ("gravity_energy", "elastic_energy")  # of a continuum
# of external forces
WORKS = "wall_work face_work push_work gravity_work force_work sphere_work work".split()


@dataclass(frozen=True)
class Ledger:
    """Energies over time [J], each (times,), unless stated otherwise."""

    time: NDArray[np.float64]  #: [s].
    #: Channel -> cumulative loss in contacts of grains, walls and sphere together.
    losses: dict[str, NDArray[np.float64]]
    #: Work of walls, periodic faces, pushes, gravity, a driven sphere and changes of stiffness.
    work: NDArray[np.float64]
    stored: NDArray[np.float64]  #: Kinetic and potential energy less their start.
    residual: NDArray[np.float64]  #: stored - work + losses, as in the result.
    #: Energy that has gone through the system, |work| + initial kinetic + |initial potential| +
    #: losses.
    reference: NDArray[np.float64]
    #: Residual over reference, or over its lower bounds if they are larger, as in the result
    #: (run.ledger.turnover).
    relative: NDArray[np.float64]
    worst: float  #: Largest absolute value of `relative`, a number.
    #: Channel -> share of all losses at the end, or 0; of their absolute values, as a channel may
    #: have gained.
    shares: dict[str, float]


def sum_losses_by_channel(series: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Channel -> energy lost since the start [J], (times,), in contacts of grains and walls."""
    if "loss" not in series:
        return {}
    names = [name for name in LOSSES if name in series]
    zero = np.zeros(series.sizes["time"])
    return {
        str(channel): sum((read_at(series[name], channel=channel) for name in names), zero)
        for channel in series.channel.values
    }


def compute_ledger(run: Run) -> Ledger:
    """Energy ledger of a run, from its start, over all its stages."""
    series = run.whole.series
    zero = np.zeros(len(series.time))

    def total(name: str, over: str) -> NDArray[np.float64]:
        if name not in series:
            return zero
        sums: NDArray[np.float64] = np.nansum(
            series[name].values, axis=series[name].dims.index(over)
        )
        return sums

    losses = sum_losses_by_channel(series)
    lost = sum(losses.values(), zero)
    kinetic = sum((series[n].values for n in KINETIC if n in series), zero)
    potential = sum((total(name, "spring") for name in CONTACTS), zero)
    potential = sum((series[n].values for n in POTENTIAL if n in series), potential)
    work = sum((series[n].values for n in WORKS if n in series), zero)
    energy, residual = kinetic + potential, series.energy_residual.values
    if not len(zero):
        no_shares = dict.fromkeys(losses, 0.0)
        return Ledger(zero, losses, work, zero, residual, zero, zero, 0.0, no_shares)
    reference = reference_energy(work, kinetic[0], potential[0], lost)
    relative = np.where(np.isnan(residual), np.nan, series.energy_residual_relative.values)
    # a residual that is not a number is the worst there is
    size = np.where(np.isnan(relative), np.inf, np.abs(relative))
    ends = {c: v[-1] for c, v in losses.items()}
    size_of_all = sum(abs(v) for v in ends.values())  # rounding of a channel may be a gain
    fractions = {c: float(v / size_of_all) if size_of_all else 0.0 for c, v in ends.items()}
    return Ledger(
        time=series.time.values,
        losses=losses,
        work=work,
        stored=energy - energy[0],
        residual=residual,
        reference=reference,
        relative=relative,
        worst=float(size.max()),
        shares=fractions,
    )


@dataclass(frozen=True)
class Losses:
    """Energy lost since the start of a run or stage against filling factor (T19 Fig 9).

    T19's "normal" is forming and breaking together.
    """

    filling_factor: NDArray[np.float64]  #: (times,).
    by_channel: dict[str, NDArray[np.float64]]  #: Channel -> energy [J], (times,).
    total: NDArray[np.float64]  #: [J], (times,).


def measure_losses(run: Run) -> Losses:
    """Losses by channel of a run, in the first stage that stretches, against filling factor.

    Raises
    ------
    DustError
        The run has no filling factor.
    """
    stage = run.part_that("stretches")
    if "filling_factor" not in stage.series:
        raise DustError(f"{run.path} has no filling factor to draw its losses against.")
    initial_losses = sum_losses_by_channel(stage.start.expand_dims("time"))
    lost = {c: v - initial_losses[c][0] for c, v in sum_losses_by_channel(stage.series).items()}
    phi = stage.series.filling_factor.values
    return Losses(phi, lost, sum(lost.values(), np.zeros(len(phi))))
