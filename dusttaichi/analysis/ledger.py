"""The energy ledger of a run: does it close, and where did the energy go?"""

from dataclasses import dataclass

import numpy as np

from dusttaichi.results.variables import reference_energy

KINETIC = ("kinetic_translation", "kinetic_rotation", "sphere_kinetic", "kinetic")
CONTACTS = ("potential", "potential_wall", "potential_sphere")
LOSSES = ("loss", "loss_wall", "loss_sphere")
POTENTIAL = ("gravity_energy", "elastic_energy")  # of a continuum
# of what acts from outside
WORKS = ("wall_work", "face_work", "push_work", "gravity_work", "sphere_work", "work")
WORKS += ("stiffness_work",)


@dataclass(frozen=True)
class Ledger:
    """Energies over time [J], each (times,), unless said otherwise.

    losses: channel -> cumulative loss in contacts of grains, walls and sphere together.
    work: of walls, periodic faces, pushes, gravity, a driven sphere and changes of stiffness, 0
    without them. stored:
    kinetic and potential energy less their start. residual: stored - work + losses, as the run
    wrote it. reference: the energy that has gone through the system, |work| + initial kinetic +
    |initial potential| + losses.
    relative: residual over reference, or over its lower bounds where they are more, as the run
    wrote it (run.ledger.turnover). worst: its largest absolute value, at `worst_time` [s]. shares:
    channel -> share of all losses at the end (0 where nothing is lost).
    """

    time: np.ndarray
    losses: dict
    work: np.ndarray
    stored: np.ndarray
    residual: np.ndarray
    reference: np.ndarray
    relative: np.ndarray
    worst: float
    worst_time: float
    shares: dict


def losses_by_channel(series):
    """Channel -> energy lost since the start [J], (times,), in contacts of grains and walls."""
    if "loss" not in series:
        return {}
    loss = sum(series[name] for name in LOSSES if name in series)
    return {str(c): loss.sel(channel=c).values for c in series.channel.values}


def ledger(run):
    """The Ledger of a Run, from its start, over all its stages."""
    series = run.whole.series
    zero = np.zeros(len(series.time))

    def total(name, over):
        return series[name].sum(over).values if name in series else zero

    losses = losses_by_channel(series)
    lost = sum(losses.values(), zero)
    kinetic = sum((series[n].values for n in KINETIC if n in series), zero)
    potential = sum((total(name, "spring") for name in CONTACTS), zero)
    potential = sum((series[n].values for n in POTENTIAL if n in series), potential)
    work = sum((series[n].values for n in WORKS if n in series), zero)
    energy, residual = kinetic + potential, series.energy_residual.values
    if not len(zero):
        return Ledger(
            series.time.values,
            losses,
            work,
            zero,
            residual,
            zero,
            zero,
            0.0,
            0.0,
            dict.fromkeys(losses, 0.0),
        )
    reference = reference_energy(work, kinetic[0], potential[0], lost)
    relative = np.where(np.isnan(residual), np.nan, series.energy_residual_relative.values)
    # a residual that is not a number is the worst there is
    size = np.where(np.isnan(relative), np.inf, np.abs(relative))
    worst = int(np.argmax(size))
    shares = {c: float(v[-1] / lost[-1]) if lost[-1] else 0.0 for c, v in losses.items()}
    return Ledger(
        time=series.time.values,
        losses=losses,
        work=work,
        stored=energy - energy[0],
        residual=residual,
        reference=reference,
        relative=relative,
        worst=float(size[worst]),
        worst_time=float(series.time.values[worst]),
        shares=shares,
    )
