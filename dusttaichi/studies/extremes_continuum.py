"""Cells of `dust extremes` in the continuum: speeds over six decades, moduli, unusual bodies."""

from collections.abc import Callable
from typing import Any

from dusttaichi.studies.extremes_cells import Blocks, Cell

SPEEDS = (1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1000.0)  # m/s
MODULI = (300.0, 30.0, 10.0, 4.5, 2.0, 1.0, 0.3)  # kPa, of dust_g09
FILLINGS = (0.05, 0.1, 0.13, 0.15, 0.3, 0.5, 0.57, 0.579, 0.6)
STEPS = 60  # of the run, each of eight steps of the method at subsonic speeds
# For a block pulled at 1 km/s: its wall is a hundred heights away by then, and moves so far in each
# step of the method that every one needs a search.
STEPS_PULLED_AWAY = 12
BASE: Blocks = {
    "name": "extremes",
    "method": "continuum",
    "material": "dust_g09",
    "numerics": {"spacing": "0.2 mm", "threads": 1},
    "stop": {"steps": 1},
}
WALL = {"kind": "faces", "bottom": "rigid"}
LYING = {"kind": "faces", "bottom": {"layer": "0.6 mm"}, "periodic": ["x"]}
PRESSED: Blocks = {"kind": "faces", "bottom": "rigid", "top": "rigid", "periodic": ["x"]}
GRAVITY = {"gravity": "9.81 m/s^2"}
BED: Blocks = {"kind": "block", "size": ["4 mm", "3 mm"]}
BEAD: Blocks = {
    "kind": "impact",
    "target": BED,
    "projectile": {"kind": "rigid", "diameter": "1.1 mm", "density": "2540 kg/m^3"},
}
SPHERE: Blocks = {"kind": "sphere", "diameter": "2 mm"}
PARTICLE = {"kind": "sphere", "diameter": "0.25 mm", "velocity": ["1 m/s", "-1 m/s"]}


def _place_two(**second: Any) -> Blocks:
    return {"kind": "several", "bodies": [SPHERE, SPHERE | second]}


# of a speed: row -> blocks
MOVING: dict[str, Callable[[str], Blocks]] = {
    "bead": lambda v: {"sample": BEAD | {"speed": v}, "boundary": LYING, **GRAVITY},
    "block compressed": lambda v: {"sample": BED, "boundary": PRESSED | {"wall_speed": v}},
    "block pulled": lambda v: {"sample": BED, "boundary": PRESSED | {"wall_speed": f"-{v}"}},
    "sphere on a wall": lambda v: {
        "sample": SPHERE | {"velocity": ["0 m/s", f"-{v}"]}, "boundary": WALL},
}  # fmt: skip
# single particles, bodies that touch, overlap or coincide, a fast spin, a collapsing bed
OTHER_BODIES: dict[str, Blocks] = {
    "one particle": {"sample": PARTICLE},
    "one particle on a wall": {"sample": PARTICLE, "boundary": WALL},
    "two bodies meet": {
        "sample": _place_two(position=["2.1 mm", "0 mm"], velocity=["-1 m/s", "0 m/s"])},
    "two bodies overlap": {"sample": _place_two(position=["1 mm", "0 mm"])},
    "two bodies coincide": {"sample": _place_two()},
    "spin of 1e4 rad/s": {"sample": SPHERE | {"spin": "1e4 rad/s"}},
    "bed too weak for its weight": {
        "sample": BED, "boundary": LYING, **GRAVITY,
        "material": {"base": "dust_g09", "compressive": {"p_m": "0.1 Pa"}, "tensile": {"a": -2.0}}},
    "bead at rest": {"sample": BEAD, "boundary": LYING, **GRAVITY},
}  # fmt: skip


def vary_dust(quick: bool) -> list[Cell]:
    """Beads, spheres and compressed blocks at all speeds; moduli; filling factors; other bodies."""
    stride = 3 if quick else 1
    rows: list[tuple[str, str, Blocks]] = [
        (row, f"{speed:g} m/s", make_blocks(f"{speed:g} m/s"))
        for row, make_blocks in MOVING.items()
        for speed in SPEEDS[::stride]
    ]
    for modulus in MODULI[::stride]:
        material = {"base": "dust_g09", "bulk_modulus": f"{modulus} kPa"}
        blocks: Blocks = {
            "material": material,
            "sample": BEAD | {"speed": "0.65 m/s"},
            "boundary": LYING,
        }
        rows.append(("bulk modulus", f"{modulus:g} kPa", blocks))
    for phi in FILLINGS[::stride]:
        blocks = {"sample": BED | {"filling_factor": phi}}
        blocks["boundary"] = PRESSED | {"wall_speed": "0.2 m/s"}
        rows.append(("filling factor", f"{phi:g}", blocks))
    rows += [("other bodies", name, blocks) for name, blocks in OTHER_BODIES.items()]
    return [
        Cell("continuum", f"{row}, {column}", BASE | blocks, None,
             STEPS_PULLED_AWAY if (row, column) == ("block pulled", "1000 m/s") else STEPS,
             row=row, column=column)
        for row, column, blocks in rows
    ]  # fmt: skip
