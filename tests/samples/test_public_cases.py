"""Files and scenes of other people, one line a case: read rightly, or refused with the reason.

The folder `cases` has a scene and its file each. More lines and other kinds are in test_formats.
"""

from pathlib import Path

import numpy as np
import pytest

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.grains.build import build
from dusttaichi.grains.measure import energies
from dusttaichi.scene import load

FOLDER = Path(__file__).parent / "cases"

# number of grains, position of the last one [um]; further: radius of the last one [um], numbers of
# materials, a part of the remarks, the edges and the tilt of the cell [um]
READ = {
    "agg_overlap_1percent": (200, None, {"remark": "200 of 201 contacts overlap by more than 5"}),
    "agg_touch_6digits": (200, None, {"remark": "199 contacts in 1 fragment: 98 of 199 pairs"}),
    "agg_touch_min": (6, (5.6083, -1.1717, -0.8125), {"remark": "5 contacts in 1 fragment"}),
    "csv_semicolon": (2, (1.2, 0, 0), {"radius": 0.6}),
    "csv_unit_parens": (2, (1.2, 0, 0), {}),
    "data_ellipsoid_nohint": (2, (2.2, 5, 5), {"radius": 0.6, "remark": "ellipsoid alone fits"}),
    "data_header_comment": (2, (2.2, 5, 5), {"radius": 0.6}),
    "data_indented": (2, (2.2, 5, 5), {"radius": 0.6}),
    "data_typelabels": (2, (2.2, 5, 5), {"radius": 0.6}),
    "dump_element": (2, (2.2, 5, 5), {"radius": 0.6}),
    "dump_general_triclinic": (2, (2.2, 9, 5), {"remark": "its cell is tilted by xy = 3 µm"}),
    "dump_gz": (2, (2.2, 5, 5), {}),
    "dump_old_nobc": (2, (2.2, 5, 5), {"remark": "are read as id type xs ys zs"}),
    "dump_triclinic_scaled": (2, (4.9, 9, 5), {"remark": "its cell is tilted by xy = 3 µm"}),
    "dump_xsu": (2, (10.9, 5, 5), {"radius": 0.6}),
    "list_aggregate_gen": (200, None, {}),
    "list_count_first": (3, (2.4, 0, 0), {"radius": 0.6, "remark": "are read as x y z r"}),
    "list_header_ws": (2, (1.2, 0, 0), {"radius": 0.6}),
    "list_mstm": (3, (2.4, 0, 0), {"radius": 0.6, "remark": "are read as r x y z"}),
    "xyz_blank_frames": (2, (0, 0, 6.2), {}),
    "xyz_bom": (2, (0, 0, 1.2), {}),
    "xyz_fortranD": (2, (1.2, 0, 0), {}),
    "xyz_id_first": (3, (2.4, 0, 0), {}),
    "xyz_no_species_zigzag": (3, (2.2, 2.4, 0), {"radius": 0.6}),
    "xyz_pbc_keepbox": (2, (0.9, 5, 5), {"edges": (10, 10, 10)}),
    "xyz_radius_lost": (4, (4.5, 0, 0), {"radius": 0.9}),
    "yade_two_materials": (2, (1.2, 0, 0), {"radius": 0.6, "materials": [0, 1]}),
}
REFUSED = {
    "data_bpm_nohint": "bpm/sphere, .* fit .*sample.style: bpm/sphere",
    # points at 1 µm, closer than two grains of the material: not diameters of 1 µm
    "data_full_nohint_q": "grains 2 and 3 .* are 1 µm apart, 0.833 diameters",
    "dump_triclinic_keepbox": "tilted by xy = 3 µm; a cell here .* tilted along x with z",
    "dump_type2": "its type 2 has no material in the scene, .*: 1 default",
    "xyz_count_too_small": "line 1 announces 2 grains, and line 5 .* is one line more",
}


def sample(name):
    return samples.make(load(FOLDER / name / "scene.yaml"))


@pytest.mark.parametrize("name", READ)
def test_it_is_read(name):
    grains, last, more = READ[name]
    found = sample(name)
    assert len(found) == grains
    if last is not None:  # to the nanometre: grains that touch are put into equilibrium contact
        np.testing.assert_allclose(found.positions[-1], np.array(last) * 1e-6, atol=1e-9)
    if "radius" in more:
        radius = 0.6e-6 if found.radii is None else found.radii[-1]
        assert radius == pytest.approx(more["radius"] * 1e-6, rel=1e-9)
    if "materials" in more:
        assert found.materials.tolist() == more["materials"]
    if "edges" in more:
        room = np.reshape(found.info["room"], (3, 2))
        np.testing.assert_allclose(np.ptp(room, axis=1), np.array(more["edges"]) * 1e-6, rtol=1e-9)
    assert more.get("remark", "") in " ".join(found.info.get("remarks", ()))


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused(name):
    with pytest.raises(DustError, match=REFUSED[name]):
        sample(name)


def test_an_aggregate_of_a_generator_holds_together():
    """Without a drive it stays as it is: all contacts, and hardly a motion."""
    scene = load(FOLDER / "agg_touch_6digits" / "scene.yaml")
    sim = build(scene, samples.make(scene))
    sim.advance(300)
    found = energies(sim)
    assert found["contacts"] == 199
    # distances are met within a thousandth of delta0, whose square is the energy that is left
    moved = found["kinetic_translation"] + found["kinetic_rotation"]
    assert moved < 1e-6 * abs(found["potential"].sum())


def test_every_case_has_a_line():
    assert {path.name for path in FOLDER.iterdir()} == {*READ, *REFUSED}
