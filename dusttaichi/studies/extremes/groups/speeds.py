"""Speeds over six decades."""

from dusttaichi.studies.extremes.cell import Cell
from dusttaichi.studies.extremes.groups.scenes import BASE, BOTTOM, scene

SPEEDS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)


def wall_speeds(quick):
    """A cake compressed at speeds over six decades; pairs, and grains and walls, at the same."""
    cells = []
    for speed in SPEEDS[::3] if quick else SPEEDS:
        for damping in ("viscous",) if quick else ("viscous", "viscoelastic"):
            own = {**BASE["interaction"], "damping": damping}
            box = {"kind": "box", "wall_speed": f"{speed} m/s"}
            half = [[-0.5 * speed, 0, 0], [0.5 * speed, 0.05 * speed, 0]]
            things = {
                "cake": (
                    scene(boundary=box, interaction=own),
                    {"kind": "cake", "grains": 60},
                    4_000,
                ),
                "pair": (scene(interaction=own),
                         {"kind": "given", "positions": [[2.0005, 0, 0], [0, 0, 0]],
                          "velocities": half}, 3_000),
                "wall": (scene(boundary=BOTTOM, interaction=own),
                         {"kind": "given", "positions": [[0, 0, 0]],
                          "velocities": [[0.1 * speed, 0, -speed]]}, 3_000),
            }  # fmt: skip
            for what, (blocks, sample, steps) in things.items():
                name = f"{what}, {damping}, {speed:g} m/s"
                place = {"row": f"{what}, {damping}", "column": speed}
                cells.append(Cell("wall speeds", name, blocks, sample, steps, **place))
    return sorted(cells, key=lambda cell: cell.row)
