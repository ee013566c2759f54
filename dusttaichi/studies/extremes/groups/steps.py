"""Time steps below and above the limit, and runs of many steps."""

from dusttaichi.studies.extremes.cell import Cell
from dusttaichi.studies.extremes.groups.scenes import BASE, BOTTOM, scene

FRACTIONS = (0.01, 0.03, 0.1, 0.2, 0.25, 0.28, 0.3, 0.31, 0.33, 0.36, 0.4, 0.5, 0.7, 1.0, 1.2)
FEW_FRACTIONS = (0.01, 0.2, 0.3, 0.33, 0.5, 1.2)


def time_step(quick):
    """Time steps from a hundredth of the stiffest period to more than it."""
    things = {
        "pair": ({"kind": "chain", "grains": 2}, {"kind": "open"}, 20_000),
        "wall": ({"kind": "given", "positions": [[0, 0, 0]]}, BOTTOM, 20_000),
        "RBD cake": ({"kind": "cake", "grains": 200}, {"kind": "open"}, 4_000),
        "compacted cake": ({"kind": "compacted"}, {"kind": "open"}, 4_000),
    }
    cells = []
    for name, (sample, boundary, steps) in things.items():
        for damping in ("none",) if quick else ("none", "viscoelastic"):
            own = scene(boundary=boundary, interaction={**BASE["interaction"], "damping": damping})
            for n, fraction in enumerate(FEW_FRACTIONS if quick else FRACTIONS):
                cells.append(
                    Cell("time step", f"{name}, damping {damping}, {fraction:g}", own,
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
        own = scene(interaction={"damping": "none"}, numerics={"precision": precision})
        for what, sample in (
            ("pair", {"kind": "chain", "grains": 2, "speed": 0.002, "spin": 1e3}),
            ("chain", {"kind": "chain", "grains": 10, "speed": 0.002, "spin": 1e3}),
        ):
            cells.append(
                Cell("long runs", f"{what}, {precision}, {steps:.0e} steps", own, sample, steps,
                     time_limit=300.0, row=what, column=precision)
            )  # fmt: skip
    return cells
