"""Scenes of the other groups in every precision."""

from dusttaichi.studies.extremes.cell import Cell
from dusttaichi.studies.extremes.groups.scenes import scene


def precisions(quick):
    """Scenes of the other groups in every precision."""
    things = {
        "pair, meeting": (scene(), {"kind": "meeting", "sticking": 0.7}, 5_000),
        "pair, 10 m/s": (
            scene(),
            {
                "kind": "given",
                "positions": [[2.0005, 0, 0], [0, 0, 0]],
                "velocities": [[-10, 0, 0], [0, 1, 0]],
            },
            3_000,
        ),
        "cake, warm": (scene(), {"kind": "cake", "grains": 60, "speed": 0.003}, 3_000),
        "cake, pressed": (
            scene(boundary={"kind": "box", "wall_speed": "1 m/s"}),
            {"kind": "cake", "grains": 60},
            3_000,
        ),
        "pair, spinning": (
            scene(),
            {
                "kind": "given",
                "positions": [[0, 0, 0], [1.9997, 0, 0]],
                "spins": [[1e7, 0, 1e7], [0, 0, 0]],
            },
            5_000,
        ),
        "polydisperse": (
            scene(material={"base": "silicate_s12", "radius": "0.1 um"}),
            {"kind": "polydisperse", "ratio": 10, "around": 6, "speed": 0.01},
            3_000,
        ),
        "ice, meeting": (scene(material="ice_t19"), {"kind": "meeting", "sticking": 0.7}, 5_000),
    }
    cells = []
    for what, (blocks, sample, steps) in list(things.items())[:: 3 if quick else 1]:
        for precision in ("f64", "mixed", "f32"):
            own = {**blocks, "numerics": {**blocks["numerics"], "precision": precision}}
            name = f"{what}, {precision}"
            cells.append(Cell("precisions", name, own, sample, steps, row=what, column=precision))
    return cells
