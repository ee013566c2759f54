"""Cells of the map of `dust extremes`: what a cell and its result are, and the groups of grains.

A group is a function of `quick` that returns its cells: time steps, materials, speeds over six
decades, unequal sizes, filling factors, precisions, and contacts about to form or break.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import nan
from typing import Any

Blocks = dict[str, Any]  # of a YAML
Positions = list[list[float]]


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
    scene: Blocks
    sample: Blocks | None = None
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
    def ratio(self) -> float:
        """Estimated over measured limit."""
        return self.estimated / self.measured


BASE: Blocks = {
    "name": "extremes",
    "material": "silicate_s12",
    "interaction": {"rolling": {"modifier": 8}, "sliding": {"modifier": 2.5}, "damping": "viscous"},
    "sample": {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]]},
    "boundary": {"kind": "open"},
    "stop": {"steps": 1},
    "numerics": {"threads": 1},
}
OPEN, UNDAMPED = {"kind": "open"}, {"damping": "none"}
BOTTOM = {"kind": "box", "omit": ["x_min", "x_max", "y_min", "y_max", "top"]}
SMALL = {"base": "silicate_s12", "radius": "0.1 um"}
# positions in radii: of one grain, of two in contact, and of two about to touch
ONE: Positions = [[0, 0, 0]]
NEAR: Positions = [[0, 0, 0], [1.9997, 0, 0]]
APART: Positions = [[2.0005, 0, 0], [0, 0, 0]]
MEETING = {"kind": "meeting", "sticking": 0.7}


def compose_scene(
    *, damping: str | None = None, precision: str | None = None, **blocks: Any
) -> Blocks:
    """The blocks of BASE with others in their place.

    damping: of the interaction of BASE. precision, and the keys of `numerics`, are added.
    """
    scene = BASE | blocks
    if damping is not None:
        scene["interaction"] = BASE["interaction"] | {"damping": damping}
    added = {} if precision is None else {"precision": precision}
    return scene | {"numerics": BASE["numerics"] | blocks.get("numerics", {}) | added}


def of_scene(kind: str, **keys: Any) -> Blocks:
    """Sample of a kind that scenes have."""
    return {"kind": "of scene", "block": {"kind": kind, **keys}}


PAIR, CAKE = of_scene("chain", grains=2, axis="x"), of_scene("rbd", grains=60, seed=1)


def place(positions: Positions, **motion: Any) -> Blocks:
    """Sample of grains at positions [radii]."""
    return {"kind": "given", "positions": positions, **motion}


FRACTIONS = (0.01, 0.03, 0.1, 0.2, 0.25, 0.28, 0.3, 0.31, 0.33, 0.36, 0.4, 0.5, 0.7, 1.0, 1.2)
FEW_FRACTIONS = (0.01, 0.2, 0.3, 0.33, 0.5, 1.2)


def vary_time_step(quick: bool) -> list[Cell]:
    """Time steps from a hundredth of the stiffest period to more than it."""
    bodies = (
        ("pair", PAIR, OPEN, 20_000),
        ("wall", place(ONE), BOTTOM, 20_000),
        ("RBD cake", of_scene("rbd", grains=200, seed=1), OPEN, 4_000),
        ("compacted cake", {"kind": "compacted"}, OPEN, 4_000),
    )
    fractions = FEW_FRACTIONS if quick else FRACTIONS
    dampings = ("none",) if quick else ("none", "viscoelastic")
    return [
        Cell("time step", f"{body}, damping {damping}, {fraction:g}",
             compose_scene(boundary=boundary, damping=damping),
             sample | {"speed": 0.005, "spin": 5e3}, steps // 4 if quick else steps,
             fraction=fraction, limit=fraction == fractions[0],
             row=f"{body}, {damping}", column=fraction)
        for (body, sample, boundary, steps), damping, fraction in product(
            bodies, dampings, fractions)
    ]  # fmt: skip


def run_long(quick: bool) -> list[Cell]:
    """Many steps, for drifts."""
    steps = 200_000 if quick else 10_000_000
    return [
        Cell("long runs", f"{body}, {precision}, {steps:.0e} steps",
             compose_scene(interaction=UNDAMPED, precision=precision),
             of_scene("chain", grains=grains, axis="x") | {"speed": 0.002, "spin": 1e3}, steps,
             time_limit=300.0, row=body, column=precision)
        for precision in (("f64",) if quick else ("f64", "mixed"))
        for body, grains in (("pair", 2), ("chain", 10))
    ]  # fmt: skip


SPEEDS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)


def vary_speed(quick: bool) -> list[Cell]:
    """A cake compressed at speeds over six decades; pairs, and grains and walls, at the same."""
    bodies: dict[str, Callable[[float], tuple[Blocks, Blocks, int]]] = {
        "cake": lambda v: ({"kind": "box", "wall_speed": f"{v} m/s"}, CAKE, 4_000),
        "pair": lambda v: (
            OPEN, place(APART, velocities=[[-0.5 * v, 0, 0], [0.5 * v, 0.05 * v, 0]]), 3_000),
        "wall": lambda v: (BOTTOM, place(ONE, velocities=[[0.1 * v, 0, -v]]), 3_000),
    }  # fmt: skip
    dampings = ("viscous",) if quick else ("viscoelastic", "viscous")
    cells = []
    for body, damping, speed in product(bodies, dampings, SPEEDS[::3] if quick else SPEEDS):
        (boundary, sample, steps), row = bodies[body](speed), f"{body}, {damping}"
        blocks = compose_scene(boundary=boundary, damping=damping)
        name = f"{row}, {speed:g} m/s"
        cells.append(Cell("wall speeds", name, blocks, sample, steps, row=row, column=speed))
    return cells


RATIOS = (1, 3, 10, 30, 100, 300, 1000)


def vary_size_ratio(quick: bool) -> list[Cell]:
    """A large grain and small ones of 0.1 um: one colliding, six or up to forty on it."""
    blocks = compose_scene(material=SMALL, interaction=UNDAMPED)
    arrangements: dict[str, Callable[[int], Blocks]] = {
        "coat": lambda ratio: {"around": min(40, 2 * (1 + ratio) ** 2), "speed": 0.01},
        "flying": lambda ratio: {"speed_in": 0.3},
        "six": lambda ratio: {"around": 6, "speed": 0.01},
    }
    return [
        Cell("size ratios", f"{row}, 1:{ratio}", blocks,
             {"kind": "polydisperse", "ratio": ratio} | arrange(ratio), 3_000,
             limit=row != "flying", row=row, column=ratio)
        for row, arrange in arrangements.items()
        for ratio in (RATIOS[::3] if quick else RATIOS)
    ]  # fmt: skip


def vary_filling_factor(quick: bool) -> list[Cell]:
    """Filling factors from a gas to the densest packing, in a periodic cell."""
    gas = {"kind": "gas", "grains": 60}
    samples: dict[float, Blocks] = {
        phi: gas | {"filling_factor": phi} for phi in (1e-4, 1e-3, 0.01, 0.05, 0.15)
    }
    samples[0.3] = gas | {"filling_factor": 0.25}
    for phi in (0.5, 0.6):
        samples[phi] = of_scene("random_packing", grains=200, filling_factor=phi)
    samples[0.74] = of_scene("lattice", structure="fcc", cells=[4, 4, 4])
    motions = (("slow", 0.001, None), ("fast", 1.0, None), ("shrinking", 0.01, "-1e4 s^-1"))
    return [
        Cell("filling factors", f"{motion}, {phi:g}",
             compose_scene(boundary={"kind": "periodic"} | ({"strain_rate": rate} if rate else {})),
             sample | {"speed": speed}, 1_500, row=motion, column=phi, kernels=f"{phi}")
        for phi, sample in list(samples.items())[:: 4 if quick else 1]
        for motion, speed, rate in motions
    ]  # fmt: skip


def vary_precision(quick: bool) -> list[Cell]:
    """Scenes of the other groups in every precision."""
    pressed = {"boundary": {"kind": "box", "wall_speed": "1 m/s"}}
    unequal = {"kind": "polydisperse", "ratio": 10, "around": 6, "speed": 0.01}
    setups: tuple[tuple[str, Blocks, Blocks, int], ...] = (
        ("pair, meeting", {}, MEETING, 5_000),
        ("pair, 10 m/s", {}, place(APART, velocities=[[-10, 0, 0], [0, 1, 0]]), 3_000),
        ("cake, warm", {}, CAKE | {"speed": 0.003}, 3_000),
        ("cake, pressed", pressed, CAKE, 3_000),
        ("pair, spinning", {}, place(NEAR, spins=[[1e7, 0, 1e7], [0, 0, 0]]), 5_000),
        ("polydisperse", {"material": SMALL}, unequal, 3_000),
        ("ice, meeting", {"material": "ice_t19"}, MEETING, 5_000),
    )
    return [
        Cell("precisions", f"{row}, {precision}", compose_scene(**blocks, precision=precision),
             sample, steps, row=row, column=precision)
        for row, blocks, sample, steps in setups[:: 3 if quick else 1]
        for precision in ("f64", "mixed", "f32")
    ]  # fmt: skip


# -- materials -----------------------------------------------------------------------------------

CORNERS: dict[str, tuple[str | float, str | float]] = {
    "gamma": ("1e-4 J/m^2", "1 J/m^2"),
    "E": ("1e6 Pa", "1e12 Pa"),
    "r": ("10 nm", "1 mm"),
    "rho": ("100 kg/m^3", "2e4 kg/m^3"),
    "xi_crit": ("0.01 nm", "1 um"),
    "nu": (0, 0.49),
}
KEYS = ("surface_energy", "young_modulus", "radius", "density", "critical_rolling", "poisson_ratio")
MIDDLE = ("20 mJ/m^2", "54 GPa", "0.6 um", "2.65 g/cm^3", "2 nm", 0.17)
BODIES: dict[str, tuple[Blocks, Blocks]] = {
    "pair": (OPEN, MEETING),
    "wall": (BOTTOM, {"kind": "cluster", "grains": 4}),
}


def vary_materials(quick: bool) -> list[Cell]:
    """All corners of the six numbers: colliding grains, and a few grains on a wall."""
    cells = []
    for body, values in product(BODIES, list(product(*CORNERS.values()))[:: 13 if quick else 1]):
        texts = [f"{key} {value}" for key, value in zip(CORNERS, values, strict=True)]
        row, column = ", ".join(texts[:3]), ", ".join(texts[3:])
        cells.append(
            _make_material_cell(
                "materials", body, values, f"{row}, {column}", row=f"{body}: {row}", column=column
            )
        )
    return cells  # fmt: skip


def vary_number(quick: bool) -> list[Cell]:
    """Each of the six numbers at its ends, the others of silicate."""
    cells = []
    for n, (key, ends) in enumerate(CORNERS.items()):
        for end, body in product(ends[1 if quick else 0 :], BODIES):
            values, name = (*MIDDLE[:n], end, *MIDDLE[n + 1 :]), f"{key} {end}"
            cells.append(
                _make_material_cell("one number", body, values, name, row=body, column=name)
            )
    material = dict(zip(KEYS, (*MIDDLE[:5], 0), strict=True))
    for damping in ("viscoelastic", "viscous", "scaled"):
        blocks = compose_scene(material=material, interaction={"damping": damping})
        name = f"nu 0, {damping}"
        cells.append(Cell("one number", name, blocks, MEETING, 2_000, kernels=damping, row="pair",
                          column=name))  # fmt: skip
    return sorted(cells, key=lambda cell: cell.kernels)


def _make_material_cell(
    group: str, body: str, values: Sequence[str | float], name: str, **position: Any
) -> Cell:
    boundary, sample = BODIES[body]
    material = dict(zip(KEYS, values, strict=True))
    blocks = compose_scene(material=material, boundary=boundary, interaction=UNDAMPED)
    return Cell(group, f"{body}, {name}", blocks, sample, 2_000, limit=body == "wall",
                kernels=body, **position)  # fmt: skip


# -- special states ------------------------------------------------------------------------------

FAST = 1e9  # rad/s
TOUCHING: Positions = [[0, 0, 0], [2, 0, 0]]  # in radii
TIMED = {"numerics": {"time_step": "0.1 ns"}}
WITHOUT_EFFECTS = dict.fromkeys(("rolling", "sliding", "twisting"), "off")
FLOOR = {"boundary": BOTTOM}
CLUSTER, PULLED = {"kind": "cluster", "grains": 13}, {"kind": "pulled", "grains": 10}


def _place_two(distance: str) -> Blocks:
    """Blocks of a sample of two grains, which most scenes refuse."""
    positions = [["0 m"] * 3, [distance, "0 m", "0 m"]]
    return {"sample": {"kind": "explicit", "positions": positions}}


SPECIAL_STATES: dict[str, tuple[Blocks, Blocks | None]] = {  # name -> blocks of the scene, sample
    "one grain, auto": ({}, place(ONE)),
    "one grain at rest": (TIMED, place(ONE)),
    "one grain flying": (TIMED, place(ONE, velocities=[[1, 2, 3]])),
    "one grain spinning": (TIMED, place(ONE, spins=[[FAST, 0, 0]])),
    "two grains at rest": ({}, place([[0, 0, 0], [3, 0, 0]])),
    "two grains, bound": ({}, PAIR),
    "touching exactly, at rest": ({}, place(TOUCHING)),
    "touching exactly, approaching": (
        {}, place(TOUCHING, velocities=[[1e-3, 0, 0], [0, 0, 0]])),
    "touching exactly, leaving": ({}, place(TOUCHING, velocities=[[-1e-3, 0, 0], [0, 0, 0]])),
    "touching exactly, sliding past": ({}, place(TOUCHING, velocities=[[0, 0.1, 0], [0, 0, 0]])),
    "coinciding": (_place_two("0 m"), None),
    "nearly coinciding": (_place_two("1e-15 m"), None),
    "overlapping by half": (_place_two("0.6 um"), None),
    "overlapping by 9 %": (_place_two("1.092 um"), None),
    "at pull-off, two": ({}, {"kind": "pulled", "grains": 2}),
    "at pull-off, ten": ({}, PULLED),
    "at pull-off, ten, hot": ({}, PULLED | {"speed": 0.01}),
    "spin 1e9, pair rolling": ({}, place(NEAR, spins=[[0, 0, FAST], [0, 0, -FAST]])),
    "spin 1e9, pair sliding": ({}, place(NEAR, spins=[[0, 0, FAST], [0, 0, FAST]])),
    "spin 1e9, pair twisting": ({}, place(NEAR, spins=[[FAST, 0, 0], [-FAST, 0, 0]])),
    "spin 1e9, one of two": ({}, place(NEAR, spins=[[FAST, FAST, FAST], [0, 0, 0]])),
    "spin 1e9, on a wall": (FLOOR, place(ONE, spins=[[0, FAST, 0]])),
    "spin 1e9, upright on a wall": (FLOOR, place(ONE, spins=[[0, 0, FAST]])),
    "spin 1e9, cluster": ({}, CLUSTER | {"spin": FAST}),
    "cluster at rest": ({}, CLUSTER),
    "no effects, pair": ({"interaction": WITHOUT_EFFECTS | UNDAMPED},
                         {"kind": "meeting", "sticking": 0.5}),
}  # fmt: skip


def try_special_states(quick: bool) -> list[Cell]:
    """Single grains, contacts about to form or break, coinciding grains, fast spins."""
    return [
        Cell("special states", name, compose_scene(**blocks), sample, 3_000, kernels="special",
             row=name)
        for name, (blocks, sample) in SPECIAL_STATES.items()
    ]  # fmt: skip
