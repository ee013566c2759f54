"""Defaults to change: what is named, and where."""

import pytest

from dusttaichi import method
from dusttaichi.analysis.numbers.general import END
from dusttaichi.scene import Scene

GRAINS = {
    "name": "plain",
    "material": "silicate_s12",
    "sample": {"kind": "lattice", "structure": "sc", "grains": 64},
    "boundary": {"kind": "box", "wall_speed": "5 cm/s"},
    "stop": {"steps": 10},
}
DUST = {
    "name": "plain",
    "method": "continuum",
    "material": "dust_g09",
    "sample": {"kind": "sphere", "diameter": "1 mm", "velocity": ["0 m/s", "-3 m/s"]},
    "boundary": {"kind": "faces", "bottom": "rigid"},
    "numerics": {"spacing": "100 um"},
    "stop": {"steps": 1},
}
BEAD = {"kind": "elastic", "diameter": "1.1 mm", "density": "2540 kg/m^3", "bulk_modulus": "10 MPa"}
COARSE = {"spacing": "150 um", "contact": "separate"}
IMPACT = {
    "kind": "impact",
    "target": {"kind": "block", "size": ["3 mm", "2 mm"]},
    "projectile": BEAD | {"shear_ratio": 0.6},
    "speed": "0.5 m/s",
}
PULLED = {"kind": "plates", "wall_speed": "-5 cm/s"}
PRESSED = {"kind": "plates", "wall_speed": "5 cm/s"}
PACKING = {"kind": "random_packing", "size": ["6 um"] * 3, "filling_factor": 0.3}
DISC = {"kind": "cutout", "of": PACKING, "diameter": "5 um", "length": "5 um"}
PAIR = {"kind": "pair", "gap": "1 nm", "speed": "1 m/s"}
CASES = [
    (GRAINS, {}, ["interaction.damping"]),
    (GRAINS, {"interaction": {"damping": "viscous"}}, []),
    (GRAINS, {"boundary": PULLED}, ["output.series"]),
    (GRAINS, {"boundary": PULLED, "output": {"series": {"strain": 1e-3}}}, []),
    (
        GRAINS,
        {"boundary": PRESSED, "sample": DISC, "interaction": {"damping": "viscous"}},
        ["output.series"],
    ),
    (GRAINS, {"sample": PAIR, "boundary": {"kind": "open"}}, ["numerics.accuracy"]),
    (DUST, {}, ["numerics.viscosity", "numerics.contact"]),
    (DUST, {"numerics": {"spacing": "100 um", "viscosity": "impact", "contact": "separate"}}, []),
    (DUST, {"sample": IMPACT, "numerics": COARSE}, ["numerics.spacing"]),
    (DUST, {"sample": IMPACT, "numerics": COARSE | {"spacing": "90 um"}}, []),
]


@pytest.mark.parametrize(("base", "changes", "keys"), CASES)
def test_defaults_to_change_are_named(base, changes, keys):
    scene = Scene.from_dict(base | changes)
    sections = dict(method.of(scene).preview(scene).sections)
    assert [key for key, _ in sections.get("Defaults to change", [])] == keys


def test_the_table_of_a_run_has_them():
    (row,) = (number for number in END.numbers if number.name == "advice")
    texts = "numerics.viscosity: impact. Dense: 8 %\nnumerics.contact: separate"
    found = row.table_rows({"advice": texts})
    assert found == [
        ("set numerics.viscosity", "impact. Dense: 8 %", ""),
        ("set numerics.contact", "separate", ""),
    ]
