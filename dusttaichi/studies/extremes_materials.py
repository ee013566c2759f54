"""Cells of `dust extremes`: materials with numbers at the ends of their ranges; the continuum.

Cells of the continuum also have speeds over six decades and unusual bodies.
"""

from itertools import product

from dusttaichi.studies.extremes_cells import BOTTOM, Cell, scene

CORNERS = {
    "gamma": ("1e-4 J/m^2", "1 J/m^2"),
    "E": ("1e6 Pa", "1e12 Pa"),
    "r": ("10 nm", "1 mm"),
    "rho": ("100 kg/m^3", "2e4 kg/m^3"),
    "xi_crit": ("0.01 nm", "1 um"),
    "nu": (0, 0.49),
}
KEYS = ("surface_energy", "young_modulus", "radius", "density", "critical_rolling", "poisson_ratio")
MIDDLE = ("20 mJ/m^2", "54 GPa", "0.6 um", "2.65 g/cm^3", "2 nm", 0.17)


def materials(quick):
    """All corners of the six numbers: colliding grains, and a few grains on a wall."""
    cells = []
    for values in list(product(*CORNERS.values()))[:: 13 if quick else 1]:
        row_and_column = [", ".join(f"{k} {v}" for k, v in half) for half in _halves(values)]
        cells += _of_material(values, "materials", ", ".join(row_and_column), *row_and_column)
    return sorted(cells, key=lambda cell: cell.kernels)


def single_materials(quick):
    """Each of the six numbers at its ends, the others of silicate."""
    cells = []
    for n, (key, ends) in enumerate(CORNERS.items()):
        for end in ends[1 if quick else 0 :]:
            values = (*MIDDLE[:n], end, *MIDDLE[n + 1 :])
            name = f"{key} {end}"
            cells += _of_material(values, "one number", name, "", name)
    for damping in ("viscoelastic", "viscous", "scaled"):
        blocks = scene(
            material=dict(zip(KEYS, (*MIDDLE[:5], 0), strict=True)),
            interaction={"damping": damping},
        )
        cells.append(
            Cell("one number", f"nu 0, {damping}", blocks, {"kind": "meeting", "sticking": 0.7},
                 2_000, kernels=damping, row="pair", column=f"nu 0, {damping}")
        )  # fmt: skip
    return sorted(cells, key=lambda cell: cell.kernels)


def _halves(values):
    named = list(zip(CORNERS, values, strict=True))
    return named[:3], named[3:]


def _of_material(values, group, name, row, column):
    material = dict(zip(KEYS, values, strict=True))
    cells = []
    for body, boundary, sample in (
        ("pair", {"kind": "open"}, {"kind": "meeting", "sticking": 0.7}),
        ("wall", BOTTOM, {"kind": "cluster", "grains": 4}),
    ):
        blocks = scene(material=material, boundary=boundary, interaction={"damping": "none"})
        cells.append(
            Cell(group, f"{body}, {name}", blocks, sample, 2_000, limit=body == "wall",
                 row=f"{body}: {row}".rstrip(": "), column=column, kernels=body)
        )  # fmt: skip
    return cells


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
    rows = []
    for speed in SPEEDS[::3] if quick else SPEEDS:
        text = f"{speed:g} m/s"
        pulled = PRESSED | {"wall_speed": f"-{text}"}
        bead = {"kind": "impact", "target": BED, "projectile": BEAD, "speed": text}
        down = ["0 m/s", f"-{text}"]
        rows += [
            ("bead", text, {"sample": bead, "boundary": LYING, "gravity": "9.81 m/s^2"}),
            ("sphere on a wall", text, {"sample": SPHERE | {"velocity": down},
                                        "boundary": {"kind": "faces", "bottom": "rigid"}}),
            ("block compressed", text, {"sample": BED, "boundary": PRESSED | {"wall_speed": text}}),
            ("block pulled", text, {"sample": BED, "boundary": pulled}),
        ]  # fmt: skip
    return sorted(rows, key=lambda row: row[0])


def _moduli(quick):
    bead = {"kind": "impact", "target": BED, "projectile": BEAD, "speed": "0.65 m/s"}
    rows = []
    for modulus in MODULI[::3] if quick else MODULI:
        material = {"base": "dust_g09", "bulk_modulus": f"{modulus} kPa"}
        blocks = {"material": material, "sample": bead, "boundary": LYING}
        rows.append(("bulk modulus", f"{modulus:g} kPa", blocks))
    return rows


def _fillings(quick):
    rows = []
    for phi in FILLINGS[::3] if quick else FILLINGS:
        sample = BED | {"filling_factor": phi}
        boundary = PRESSED | {"wall_speed": "0.2 m/s"}
        rows.append(("filling factor", f"{phi:g}", {"sample": sample, "boundary": boundary}))
    return rows


def _odd():
    """Single particles, bodies that touch, overlap or coincide, a fast spin, a collapsing bed."""
    particle = {"kind": "sphere", "diameter": "0.25 mm"}
    wall = {"kind": "faces", "bottom": "rigid"}
    fast = {"velocity": ["1 m/s", "-1 m/s"]}
    near = {"position": ["2.1 mm", "0 mm"], "velocity": ["-1 m/s", "0 m/s"]}

    def both(second):
        return {"kind": "several", "bodies": [SPHERE, SPHERE | second]}

    weak = {"base": "dust_g09", "compressive": {"p_m": "0.1 Pa"}, "tensile": {"a": -2.0}}
    blocks_by_name = {
        "one particle": {"sample": particle | fast},
        "one particle on a wall": {"sample": particle | fast, "boundary": wall},
        "two bodies meet": {"sample": both(near)},
        "two bodies overlap": {"sample": both({"position": ["1 mm", "0 mm"]})},
        "two bodies coincide": {"sample": both({})},
        "spin of 1e4 rad/s": {"sample": SPHERE | {"spin": "1e4 rad/s"}},
        "bed too weak for its weight": {"sample": BED, "boundary": LYING, "material": weak,
                                        "gravity": "9.81 m/s^2"},
        "bead at rest": {"sample": {"kind": "impact", "target": BED, "projectile": BEAD},
                             "boundary": LYING, "gravity": "9.81 m/s^2"},
    }  # fmt: skip
    return [("other bodies", name, blocks) for name, blocks in blocks_by_name.items()]
