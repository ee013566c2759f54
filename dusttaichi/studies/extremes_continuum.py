"""Cells of `dust extremes` in the continuum: speeds over six decades, moduli, unusual bodies."""

from dusttaichi.studies.extremes_cells import Cell

SPEEDS = (1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1000.0)  # m/s
MODULI = (300.0, 30.0, 10.0, 4.5, 2.0, 1.0, 0.3)  # kPa, of dust_g09
FILLINGS = (0.05, 0.1, 0.13, 0.15, 0.3, 0.5, 0.57, 0.579, 0.6)
STEPS = 60  # of the run, each of eight steps of the method at subsonic speeds
# For a block pulled at 1 km/s: its wall is a hundred heights away by then, and moves so far in each
# step of the method that every one needs a search.
STEPS_PULLED_AWAY = 12
BASE = {
    "name": "extremes",
    "method": "continuum",
    "material": "dust_g09",
    "numerics": {"spacing": "0.2 mm", "threads": 1},
    "stop": {"steps": 1},
}
WALL = {"kind": "faces", "bottom": "rigid"}
LYING = {"kind": "faces", "bottom": {"layer": "0.6 mm"}, "periodic": ["x"]}
PRESSED = {"kind": "faces", "bottom": "rigid", "top": "rigid", "periodic": ["x"]}
GRAVITY = {"gravity": "9.81 m/s^2"}
BED = {"kind": "block", "size": ["4 mm", "3 mm"]}
BEAD = {
    "kind": "impact",
    "target": BED,
    "projectile": {"kind": "rigid", "diameter": "1.1 mm", "density": "2540 kg/m^3"},
}
SPHERE = {"kind": "sphere", "diameter": "2 mm"}
PARTICLE = {"kind": "sphere", "diameter": "0.25 mm", "velocity": ["1 m/s", "-1 m/s"]}


def _both(**second):
    return {"kind": "several", "bodies": [SPHERE, SPHERE | second]}


# of a speed: row -> blocks
MOVING = {
    "bead": lambda v: {"sample": BEAD | {"speed": v}, "boundary": LYING, **GRAVITY},
    "block compressed": lambda v: {"sample": BED, "boundary": PRESSED | {"wall_speed": v}},
    "block pulled": lambda v: {"sample": BED, "boundary": PRESSED | {"wall_speed": f"-{v}"}},
    "sphere on a wall": lambda v: {
        "sample": SPHERE | {"velocity": ["0 m/s", f"-{v}"]}, "boundary": WALL},
}  # fmt: skip
# single particles, bodies that touch, overlap or coincide, a fast spin, a collapsing bed
OTHER_BODIES = {
    "one particle": {"sample": PARTICLE},
    "one particle on a wall": {"sample": PARTICLE, "boundary": WALL},
    "two bodies meet": {
        "sample": _both(position=["2.1 mm", "0 mm"], velocity=["-1 m/s", "0 m/s"])},
    "two bodies overlap": {"sample": _both(position=["1 mm", "0 mm"])},
    "two bodies coincide": {"sample": _both()},
    "spin of 1e4 rad/s": {"sample": SPHERE | {"spin": "1e4 rad/s"}},
    "bed too weak for its weight": {
        "sample": BED, "boundary": LYING, **GRAVITY,
        "material": {"base": "dust_g09", "compressive": {"p_m": "0.1 Pa"}, "tensile": {"a": -2.0}}},
    "bead at rest": {"sample": BEAD, "boundary": LYING, **GRAVITY},
}  # fmt: skip


def vary_dust(quick):
    """Beads, spheres and compressed blocks at all speeds; moduli; filling factors; other bodies."""
    every = slice(None, None, 3 if quick else 1)
    rows = [
        (row, f"{speed:g} m/s", make_blocks(f"{speed:g} m/s"))
        for row, make_blocks in MOVING.items()
        for speed in SPEEDS[every]
    ]
    for modulus in MODULI[every]:
        material = {"base": "dust_g09", "bulk_modulus": f"{modulus} kPa"}
        blocks = {"material": material, "sample": BEAD | {"speed": "0.65 m/s"}, "boundary": LYING}
        rows.append(("bulk modulus", f"{modulus:g} kPa", blocks))
    for phi in FILLINGS[every]:
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
