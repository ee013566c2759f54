"""Dynamic compression: the plateau of the pressure, the front, the fits that it changes."""

import numpy as np

from dusttaichi.analysis.drive import is_dynamic
from dusttaichi.analysis.dynamic import PLATEAU, dynamic
from dusttaichi.analysis.numbers.registry import (
    ENSEMBLES,
    FILE,
    Family,
    Observable,
    quiet,
    uncertainty,
)
from dusttaichi.analysis.texts import quantity_text

FITS = {"plateau": ("plateau", "bins"), "decades": ("whole", "decades")}


def _measure(run):
    d = dynamic(run, FITS.values())
    found = {
        "plateau": d.plateau,
        "plateau_sigma": d.plateau_sigma,
        "plateau_momentum": d.momentum,
        "front_speed": d.front,
        "front_speed_sigma": d.front_sigma,
        "layer": d.layer,
    }
    for key, which in FITS.items():
        if (fit := d.fits[which]) is not None:
            found |= {f"p_m_{key}": fit.p_m, f"delta_{key}": fit.delta}
    return {name: value for name, value in found.items() if np.isfinite(value)}


def _kpa(value, n=None):
    return f"{value / 1e3:.3g} kPa"


def _momentum(n):
    value = n["plateau_momentum"]
    return "" if value is None else f"{_kpa(value)} (momentum)"


def _front(value, n):
    speed = quantity_text(value, "m/s", n["front_speed_sigma"])
    return f"{speed}, phi {n['layer']:.2g} behind it"


LOW, HIGH = PLATEAU
FAST = Family(
    name="fast wall",
    title="a fast wall",
    place=11,
    applies=lambda run: is_dynamic(run) and run.material is not None,
    measure=_measure,
    numbers=(
        Observable(name="p_m_plateau", title=f"… of the bins up to phi {HIGH:g}", unit="Pa",
                   text=_kpa, about=f"p_m fitted to the bins up to phi {HIGH:g}", sweeps=ENSEMBLES),
        quiet("delta_plateau", "Delta of these bins", sweeps=ENSEMBLES),
        Observable(name="p_m_decades", title="… every decade of pressure alike", unit="Pa",
                   text=_kpa, about="p_m fitted with every decade of pressure alike",
                   sweeps=ENSEMBLES),
        quiet("delta_decades", "Delta of this fit", sweeps=ENSEMBLES),
        Observable(name="plateau", title=f"plateau of the pressure, phi {LOW:g}-{HIGH:g}",
                   unit="Pa", error="plateau_sigma", literature=_momentum, figure="dynamic_speeds"),
        uncertainty("plateau_sigma", "Pa", sweeps=FILE),
        quiet("plateau_momentum", "plateau by the balance of momentum", "Pa", sweeps=ENSEMBLES),
        Observable(name="front_speed", title="compaction front", unit="m/s", text=_front,
                   error="front_speed_sigma", figure="dynamic_speeds"),
        uncertainty("front_speed_sigma", "m/s", sweeps=FILE),
        quiet("layer", "filling factor behind the front"),
    ),
)  # fmt: skip
FAMILIES = (FAST,)
