"""Materials with numbers at the ends of their ranges."""

from itertools import product

from dusttaichi.studies.extremes.groups.grains import BOTTOM, scene
from dusttaichi.studies.extremes.results import Cell

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
        place = [", ".join(f"{k} {v}" for k, v in some) for some in _halves(values)]
        cells += _of_material(values, "materials", ", ".join(place), *place)
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
        own = scene(
            material=dict(zip(KEYS, (*MIDDLE[:5], 0), strict=True)),
            interaction={"damping": damping},
        )
        cells.append(
            Cell("one number", f"nu 0, {damping}", own, {"kind": "meeting", "sticking": 0.7},
                 2_000, kernels=damping, row="pair", column=f"nu 0, {damping}")
        )  # fmt: skip
    return sorted(cells, key=lambda cell: cell.kernels)


def _halves(values):
    named = list(zip(CORNERS, values, strict=True))
    return named[:3], named[3:]


def _of_material(values, group, name, row, column):
    material = dict(zip(KEYS, values, strict=True))
    cells = []
    for what, boundary, sample in (
        ("pair", {"kind": "open"}, {"kind": "meeting", "sticking": 0.7}),
        ("wall", BOTTOM, {"kind": "cluster", "grains": 4}),
    ):
        own = scene(material=material, boundary=boundary, interaction={"damping": "none"})
        cells.append(
            Cell(group, f"{what}, {name}", own, sample, 2_000, limit=what == "wall",
                 row=f"{what}: {row}".rstrip(": "), column=column, kernels=what)
        )  # fmt: skip
    return cells
