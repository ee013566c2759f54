"""Unloading: the modulus of the last stage that unloads."""

import numpy as np

from dusttaichi.analysis.cycles import releases
from dusttaichi.analysis.numbers.registry import AUTO, Family, Observable, quiet, uncertainty
from dusttaichi.analysis.texts import quantity_text


def _measure(run):
    """The last Release with enough records for a modulus."""
    known = [release for release in releases(run) if np.isfinite(release.modulus)]
    names = {"release_modulus": "modulus", "release_sigma": "modulus_sigma"}
    names |= {"release_pressure": "pressure", "release_phi": "filling_factor"}
    return {key: getattr(known[-1], name) for key, name in names.items()} if known else {}


def _modulus(value, n):
    text, pressure = quantity_text(value, "Pa", n["release_sigma"]), n["release_pressure"]
    return f"{text} (from {quantity_text(pressure, 'Pa')}, filling factor {n['release_phi']:.3g})"


UNLOADING = Family(
    name="unloading",
    title="unloading",
    place=20,
    applies=lambda run: run.unloads,
    measure=_measure,
    numbers=(
        Observable(name="release_modulus", title="modulus where it is let go", unit="Pa",
                   error="release_sigma", text=_modulus, figure="cycles"),
        uncertainty("release_sigma", "Pa"),
        quiet("release_pressure", "pressure where unloading begins", "Pa", column=AUTO),
        quiet("release_phi", "filling factor where unloading begins"),
    ),
)  # fmt: skip
FAMILIES = (UNLOADING,)
