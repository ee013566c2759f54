"""Continuum: materials at their limits, speeds over six decades, unusual bodies."""

from dusttaichi.studies.extremes.results import Cell

GROUP = "continuum"
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
LYING = {"kind": "faces", "bottom": {"layer": "0.6 mm"}, "periodic": ["x"]}
PRESSED = {"kind": "faces", "bottom": "rigid", "top": "rigid", "periodic": ["x"]}
BED = {"kind": "block", "size": ["4 mm", "3 mm"]}
BEAD = {"kind": "rigid", "diameter": "1.1 mm", "density": "2540 kg/m^3"}
SPHERE = {"kind": "sphere", "diameter": "2 mm"}


def continuum(quick):
    """Beads, spheres and compressed blocks at all speeds; moduli; filling factors; other bodies."""
    rows = _speeds(quick) + _moduli(quick) + _fillings(quick) + _odd()
    return [
        Cell(GROUP, f"{row}, {column}", BASE | blocks, None,
             STEPS_PULLED_AWAY if (row, column) == ("block pulled", "1000 m/s") else STEPS,
             row=row, column=column)
        for row, column, blocks in rows
    ]  # fmt: skip


def _speeds(quick):
    found = []
    for speed in SPEEDS[::3] if quick else SPEEDS:
        text = f"{speed:g} m/s"
        pulled = PRESSED | {"wall_speed": f"-{text}"}
        bead = {"kind": "impact", "target": BED, "projectile": BEAD, "speed": text}
        down = ["0 m/s", f"-{text}"]
        found += [
            ("bead", text, {"sample": bead, "boundary": LYING, "gravity": "9.81 m/s^2"}),
            ("sphere on a wall", text, {"sample": SPHERE | {"velocity": down},
                                        "boundary": {"kind": "faces", "bottom": "rigid"}}),
            ("block compressed", text, {"sample": BED, "boundary": PRESSED | {"wall_speed": text}}),
            ("block pulled", text, {"sample": BED, "boundary": pulled}),
        ]  # fmt: skip
    return sorted(found, key=lambda one: one[0])


def _moduli(quick):
    bead = {"kind": "impact", "target": BED, "projectile": BEAD, "speed": "0.65 m/s"}
    found = []
    for modulus in MODULI[::3] if quick else MODULI:
        material = {"base": "dust_g09", "bulk_modulus": f"{modulus} kPa"}
        blocks = {"material": material, "sample": bead, "boundary": LYING}
        found.append(("bulk modulus", f"{modulus:g} kPa", blocks))
    return found


def _fillings(quick):
    found = []
    for phi in FILLINGS[::3] if quick else FILLINGS:
        sample = BED | {"filling_factor": phi}
        boundary = PRESSED | {"wall_speed": "0.2 m/s"}
        found.append(("filling factor", f"{phi:g}", {"sample": sample, "boundary": boundary}))
    return found


def _odd():
    """Single particles, bodies that touch, overlap or coincide, a fast spin, a collapsing bed."""
    one = {"kind": "sphere", "diameter": "0.25 mm"}
    wall = {"kind": "faces", "bottom": "rigid"}
    fast = {"velocity": ["1 m/s", "-1 m/s"]}
    near = {"position": ["2.1 mm", "0 mm"], "velocity": ["-1 m/s", "0 m/s"]}

    def both(second):
        return {"kind": "several", "bodies": [SPHERE, SPHERE | second]}

    weak = {"base": "dust_g09", "compressive": {"p_m": "0.1 Pa"}, "tensile": {"a": -2.0}}
    things = {
        "one particle": {"sample": one | fast},
        "one particle on a wall": {"sample": one | fast, "boundary": wall},
        "two bodies meet": {"sample": both(near)},
        "two bodies overlap": {"sample": both({"position": ["1 mm", "0 mm"]})},
        "two bodies coincide": {"sample": both({})},
        "spin of 1e4 rad/s": {"sample": SPHERE | {"spin": "1e4 rad/s"}},
        "bed too weak for its weight": {"sample": BED, "boundary": LYING, "material": weak,
                                        "gravity": "9.81 m/s^2"},
        "bead at rest": {"sample": {"kind": "impact", "target": BED, "projectile": BEAD},
                             "boundary": LYING, "gravity": "9.81 m/s^2"},
    }  # fmt: skip
    return [("other bodies", name, blocks) for name, blocks in things.items()]
