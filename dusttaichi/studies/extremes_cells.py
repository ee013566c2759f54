"""Cells of the map of `dust extremes`: what a cell and its result are, and groups of grains.

A group is a function of `quick` that returns its cells: time steps, speeds over six decades,
unequal sizes, filling factors, precisions, and contacts about to form or break.
"""

from dataclasses import dataclass
from math import nan


@dataclass(frozen=True)
class Cell:
    """One point of the map, as plain numbers and texts for another process.

    scene: the blocks of its YAML. sample: a kind of `extremes_samples` with its numbers, in place
    of the scene's. fraction: time step over the stiffest period of the contacts of the sample, also
    one that a scene would refuse. limit: measure the largest stable step, too. row, column: in the
    figure of the group. time_limit [s]: a longer cell counts as WRONG. kernels: name shared by
    cells with the same compiled kernels, by default that of the row.
    """

    group: str
    name: str
    scene: dict
    sample: dict | None = None
    steps: int = 1000
    fraction: float | None = None
    limit: bool = False
    time_limit: float = 120.0
    row: str = ""
    column: str | float = ""
    kernels: str = ""


@dataclass(frozen=True)
class CellResult:
    """Verdict on a cell, with its reason.

    residual: largest of the ledger at any check, relative to run.ledger.turnover. steps: computed.
    dt, estimated, measured [s]: time step and largest stable one, nan where not requested. seconds:
    wall time.
    """

    verdict: str
    reason: str = ""
    residual: float = nan
    steps: int = 0
    dt: float = nan
    estimated: float = nan
    measured: float = nan
    seconds: float = nan

    @property
    def ratio(self):
        """Estimated over measured limit."""
        return self.estimated / self.measured


BASE = {
    "name": "extremes",
    "material": "silicate_s12",
    "interaction": {"rolling": {"modifier": 8}, "sliding": {"modifier": 2.5}, "damping": "viscous"},
    "sample": {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]]},
    "boundary": {"kind": "open"},
    "stop": {"steps": 1},
    "numerics": {"threads": 1},
}
BOTTOM = {"kind": "box", "omit": ["x_min", "x_max", "y_min", "y_max", "top"]}
PERIODIC = {"kind": "periodic"}
SMALL = {"base": "silicate_s12", "radius": "0.1 um"}
# positions in radii: of one grain, of two in contact, and of two about to touch
ONE, NEAR, APART = [[0, 0, 0]], [[0, 0, 0], [1.9997, 0, 0]], [[2.0005, 0, 0], [0, 0, 0]]


def scene(**blocks):
    """The blocks of BASE with others in their place; keys of `numerics` are added."""
    merged = {**BASE, **blocks}
    merged["numerics"] = {**BASE["numerics"], **blocks.get("numerics", {})}
    return merged


def given(positions, **motion):
    """Sample of grains at positions [radii]."""
    return {"kind": "given", "positions": positions, **motion}


FRACTIONS = (0.01, 0.03, 0.1, 0.2, 0.25, 0.28, 0.3, 0.31, 0.33, 0.36, 0.4, 0.5, 0.7, 1.0, 1.2)
FEW_FRACTIONS = (0.01, 0.2, 0.3, 0.33, 0.5, 1.2)


def time_step(quick):
    """Time steps from a hundredth of the stiffest period to more than it."""
    setups = {
        "pair": ({"kind": "chain", "grains": 2}, {"kind": "open"}, 20_000),
        "wall": (given(ONE), BOTTOM, 20_000),
        "RBD cake": ({"kind": "cake", "grains": 200}, {"kind": "open"}, 4_000),
        "compacted cake": ({"kind": "compacted"}, {"kind": "open"}, 4_000),
    }
    cells = []
    for name, (sample, boundary, steps) in setups.items():
        for damping in ("none",) if quick else ("none", "viscoelastic"):
            blocks = scene(
                boundary=boundary, interaction={**BASE["interaction"], "damping": damping}
            )
            for n, fraction in enumerate(FEW_FRACTIONS if quick else FRACTIONS):
                cells.append(
                    Cell("time step", f"{name}, damping {damping}, {fraction:g}", blocks,
                         {**sample, "speed": 0.005, "spin": 5e3}, steps // 4 if quick else steps,
                         fraction=fraction, limit=n == 0,
                         row=f"{name}, {damping}", column=fraction)
                )  # fmt: skip
    return cells


def long_runs(quick):
    """Many steps, for drifts."""
    steps = 200_000 if quick else 10_000_000
    cells = []
    for precision in ("f64",) if quick else ("f64", "mixed"):
        blocks = scene(interaction={"damping": "none"}, numerics={"precision": precision})
        for body, sample in (
            ("pair", {"kind": "chain", "grains": 2, "speed": 0.002, "spin": 1e3}),
            ("chain", {"kind": "chain", "grains": 10, "speed": 0.002, "spin": 1e3}),
        ):
            cells.append(
                Cell("long runs", f"{body}, {precision}, {steps:.0e} steps", blocks, sample, steps,
                     time_limit=300.0, row=body, column=precision)
            )  # fmt: skip
    return cells


SPEEDS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)


def wall_speeds(quick):
    """A cake compressed at speeds over six decades; pairs, and grains and walls, at the same."""
    cells = []
    for speed in SPEEDS[::3] if quick else SPEEDS:
        for damping in ("viscous",) if quick else ("viscous", "viscoelastic"):
            interaction = {**BASE["interaction"], "damping": damping}
            box = {"kind": "box", "wall_speed": f"{speed} m/s"}
            half = [[-0.5 * speed, 0, 0], [0.5 * speed, 0.05 * speed, 0]]
            setups = {
                "cake": (box, {"kind": "cake", "grains": 60}, 4_000),
                "pair": (BASE["boundary"], given(APART, velocities=half), 3_000),
                "wall": (BOTTOM, given(ONE, velocities=[[0.1 * speed, 0, -speed]]), 3_000),
            }
            for body, (boundary, sample, steps) in setups.items():
                blocks = scene(boundary=boundary, interaction=interaction)
                name = f"{body}, {damping}, {speed:g} m/s"
                position_in_figure = {"row": f"{body}, {damping}", "column": speed}
                cells.append(Cell("wall speeds", name, blocks, sample, steps, **position_in_figure))
    return sorted(cells, key=lambda cell: cell.row)


RATIOS = (1, 3, 10, 30, 100, 300, 1000)


def size_ratios(quick):
    """A large grain and small ones of 0.1 um: one colliding, six or up to forty on it."""
    cells = []
    for ratio in RATIOS[::3] if quick else RATIOS:
        blocks = scene(material=SMALL, interaction={"damping": "none"})
        for arrangement, sample, limit in (
            ("flying", {"kind": "polydisperse", "ratio": ratio, "speed_in": 0.3}, False),
            ("six", {"kind": "polydisperse", "ratio": ratio, "around": 6, "speed": 0.01}, True),
            ("coat", {"kind": "polydisperse", "ratio": ratio,
                      "around": min(40, 2 * (1 + ratio) ** 2), "speed": 0.01}, True),
        ):  # fmt: skip
            cells.append(
                Cell("size ratios", f"{arrangement}, 1:{ratio}", blocks, sample, 3_000, limit=limit,
                     row=arrangement, column=ratio)
            )  # fmt: skip
    return sorted(cells, key=lambda cell: cell.row)


def filling_factors(quick):
    """Filling factors from a gas to the densest packing, in a periodic cell."""
    samples = {
        phi: {"kind": "gas", "grains": 60, "filling_factor": phi}
        for phi in (1e-4, 1e-3, 0.01, 0.05, 0.15)
    }
    samples[0.3] = {"kind": "gas", "grains": 60, "filling_factor": 0.25}
    dense = {0.74: {"kind": "lattice", "structure": "fcc", "cells": [4, 4, 4]}}
    for phi in (0.5, 0.6):
        dense[phi] = {"kind": "random_packing", "grains": 200, "filling_factor": phi}
    samples |= {phi: {"kind": "packed", "block": dense[phi]} for phi in sorted(dense)}
    cells = []
    for n, (phi, sample) in enumerate(samples.items()):
        if quick and n % 4:
            continue
        for motion, speed, drive in (
            ("slow", 0.001, {}),
            ("fast", 1.0, {}),
            ("shrinking", 0.01, {"strain_rate": "-1e4 s^-1"}),
        ):
            cells.append(
                Cell("filling factors", f"{motion}, {phi:g}", scene(boundary={**PERIODIC, **drive}),
                     {**sample, "speed": speed}, 1_500, row=motion, column=phi, kernels=f"{phi}")
            )  # fmt: skip
    return cells


def precisions(quick):
    """Scenes of the other groups in every precision."""
    pressed = {"kind": "box", "wall_speed": "1 m/s"}
    unequal = {"kind": "polydisperse", "ratio": 10, "around": 6, "speed": 0.01}
    setups = {
        "pair, meeting": (scene(), {"kind": "meeting", "sticking": 0.7}, 5_000),
        "pair, 10 m/s": (scene(), given(APART, velocities=[[-10, 0, 0], [0, 1, 0]]), 3_000),
        "cake, warm": (scene(), {"kind": "cake", "grains": 60, "speed": 0.003}, 3_000),
        "cake, pressed": (scene(boundary=pressed), {"kind": "cake", "grains": 60}, 3_000),
        "pair, spinning": (scene(), given(NEAR, spins=[[1e7, 0, 1e7], [0, 0, 0]]), 5_000),
        "polydisperse": (scene(material=SMALL), unequal, 3_000),
        "ice, meeting": (scene(material="ice_t19"), {"kind": "meeting", "sticking": 0.7}, 5_000),
    }
    cells = []
    for setup, (blocks, sample, steps) in list(setups.items())[:: 3 if quick else 1]:
        for precision in ("f64", "mixed", "f32"):
            blocks_with_precision = {
                **blocks,
                "numerics": {**blocks["numerics"], "precision": precision},
            }
            name = f"{setup}, {precision}"
            cells.append(
                Cell(
                    "precisions",
                    name,
                    blocks_with_precision,
                    sample,
                    steps,
                    row=setup,
                    column=precision,
                )
            )
    return cells


FAST = 1e9  # rad/s
TOUCHING = [[0, 0, 0], [2, 0, 0]]  # in radii
ORIGIN = ["0 m"] * 3


def special(quick):
    """Single grains, contacts about to form or break, coinciding grains, fast spins."""
    setups = _single() | _touching() | _overlapping() | _pulled() | _spinning()
    cluster = {"kind": "cluster", "grains": 13}
    effects = dict.fromkeys(("rolling", "sliding", "twisting"), "off")
    setups["cluster at rest"] = scene(), cluster
    setups["no effects, pair"] = (
        scene(interaction={**effects, "damping": "none"}),
        {"kind": "meeting", "sticking": 0.5},
    )
    return [
        Cell("special states", name, blocks, sample, 3_000, kernels="special", row=name)
        for name, (blocks, sample) in setups.items()
    ]


def _single():
    """Grains without contacts, and two bound ones: name -> (scene, sample)."""
    timed = scene(numerics={"time_step": "0.1 ns"})
    return {
        "one grain, auto": (scene(), given(ONE)),
        "one grain at rest": (timed, given(ONE)),
        "one grain flying": (timed, given(ONE, velocities=[[1, 2, 3]])),
        "one grain spinning": (timed, given(ONE, spins=[[FAST, 0, 0]])),
        "two grains at rest": (scene(), given([[0, 0, 0], [3, 0, 0]])),
        "two grains, bound": (scene(), {"kind": "chain", "grains": 2}),
    }


def _touching():
    """Two grains at the distance of first contact."""
    setups = {"touching exactly, at rest": (scene(), given(TOUCHING))}
    for motion, velocity in (
        ("approaching", [1e-3, 0, 0]),
        ("leaving", [-1e-3, 0, 0]),
        ("sliding past", [0, 0.1, 0]),
    ):
        sample = given(TOUCHING, velocities=[velocity, [0, 0, 0]])
        setups[f"touching exactly, {motion}"] = scene(), sample
    return setups


def _overlapping():
    """Two grains with too large an overlap: the scene refuses most of them."""
    setups = {}
    for name, second in (
        ("coinciding", "0 m"),
        ("nearly coinciding", "1e-15 m"),
        ("overlapping by half", "0.6 um"),
        ("overlapping by 9 %", "1.092 um"),
    ):
        positions = [ORIGIN, [second, "0 m", "0 m"]]
        setups[name] = scene(sample={"kind": "explicit", "positions": positions}), None
    return setups


def _pulled():
    """Chains at pull-off."""
    chain = {"kind": "pulled", "grains": 10}
    return {
        "at pull-off, two": (scene(), {"kind": "pulled", "grains": 2}),
        "at pull-off, ten": (scene(), chain),
        "at pull-off, ten, hot": (scene(), chain | {"speed": 0.01}),
    }


def _spinning():
    """Grains in contact with spins at which every spring slips."""
    setups = {}
    for name, spins in (
        ("pair rolling", [[0, 0, FAST], [0, 0, -FAST]]),
        ("pair sliding", [[0, 0, FAST], [0, 0, FAST]]),
        ("pair twisting", [[FAST, 0, 0], [-FAST, 0, 0]]),
        ("one of two", [[FAST, FAST, FAST], [0, 0, 0]]),
    ):
        setups[f"spin 1e9, {name}"] = scene(), given(NEAR, spins=spins)
    floor = scene(boundary=BOTTOM)
    setups["spin 1e9, on a wall"] = floor, given(ONE, spins=[[0, FAST, 0]])
    setups["spin 1e9, upright on a wall"] = floor, given(ONE, spins=[[0, 0, FAST]])
    setups["spin 1e9, cluster"] = scene(), {"kind": "cluster", "grains": 13, "spin": FAST}
    return setups
