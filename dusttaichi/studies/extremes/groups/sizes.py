"""Grains of very different sizes, and filling factors from a gas to the densest packing."""

from dusttaichi.studies.extremes.cell import Cell
from dusttaichi.studies.extremes.groups.scenes import PERIODIC, scene

RATIOS = (1, 3, 10, 30, 100, 300, 1000)


def size_ratios(quick):
    """A large grain and small ones of 0.1 um: one colliding, six or up to forty on it."""
    cells = []
    material = {"base": "silicate_s12", "radius": "0.1 um"}
    for ratio in RATIOS[::3] if quick else RATIOS:
        own = scene(material=material, interaction={"damping": "none"})
        for what, sample, limit in (
            ("flying", {"kind": "polydisperse", "ratio": ratio, "speed_in": 0.3}, False),
            ("six", {"kind": "polydisperse", "ratio": ratio, "around": 6, "speed": 0.01}, True),
            ("coat", {"kind": "polydisperse", "ratio": ratio,
                      "around": min(40, 2 * (1 + ratio) ** 2), "speed": 0.01}, True),
        ):  # fmt: skip
            cells.append(
                Cell("size ratios", f"{what}, 1:{ratio}", own, sample, 3_000, limit=limit,
                     row=what, column=ratio)
            )  # fmt: skip
    return sorted(cells, key=lambda cell: cell.row)


def filling_factors(quick):
    """Filling factors from a gas to the densest packing, in a periodic cell."""
    things = {
        phi: {"kind": "gas", "grains": 60, "filling_factor": phi}
        for phi in (1e-4, 1e-3, 0.01, 0.05, 0.15)
    }
    things[0.3] = {"kind": "gas", "grains": 60, "filling_factor": 0.25}
    things[0.5] = {"kind": "packed_", "grains": 200, "filling_factor": 0.5}
    things[0.6] = {"kind": "packed_", "grains": 200, "filling_factor": 0.6}
    things[0.74] = {"kind": "lattice_", "structure": "fcc", "cells": [4, 4, 4]}
    cells = []
    for n, (phi, sample) in enumerate(things.items()):
        if quick and n % 4:
            continue
        own = dict(sample)
        if own["kind"].endswith("_"):
            block = {"packed_": "random_packing", "lattice_": "lattice"}[own.pop("kind")]
            own = {"kind": "packed", "block": {"kind": block, **own}}
        for what, speed, drive in (
            ("slow", 0.001, {}),
            ("fast", 1.0, {}),
            ("shrinking", 0.01, {"strain_rate": "-1e4 s^-1"}),
        ):
            cells.append(
                Cell("filling factors", f"{what}, {phi:g}", scene(boundary={**PERIODIC, **drive}),
                     {**own, "speed": speed}, 1_500, row=what, column=phi, kernels=f"{phi}")
            )  # fmt: skip
    return cells
