"""Dumps and data files of LAMMPS: atom styles, cells, image flags, what is refused."""

import numpy as np
import pytest
from grain_texts import (
    BOX,
    HEAD,
    IN_BOX,
    MICRO,
    SPHERES,
    STEP,
    check_motion,
    check_refusal,
    dump,
    expand_cases,
    lines,
    read,
)

from dusttaichi.errors import DustError

ATOMS = {
    "1 1 {x} 5 5": "atomic",
    "1 1 1 {x} 5 5": "bond angle molecular",
    "1 1 -.5 {x} 5 5": "charge dpd",
    "1 1 1 -.5 {x} 5 5": "full",
    "1 1 1.2 2.65 {x} 5 5": "sphere",
    "1 1 1 1.2 2.65 {x} 5 5": "bpm/sphere",
    "1 1 1.7 2.65 {x} 5 5": "peri edpd",
    "1 1 .5 {x} 5 5 1 0 0": "dipole",
    "1 1 0 2.4 {x} 5 5": "body ellipsoid",
    "1 1 1 0 2.65 {x} 5 5": "line tri",
    "1 1 {x} 5 5 1 0 0 1.5": "spin",
}
# by the columns and their values alone; for the others two or more styles fit
ALONE = {"atomic", "full", "charge"}


@pytest.mark.parametrize("row", ATOMS)
@pytest.mark.parametrize("flags", ["", " 0 -1 1"])
def test_atom_styles(tmp_path, row, flags):
    rows = [row.format(x=1) + flags, "2" + row.format(x=2.2)[1:] + flags]
    for style in ATOMS[row].split():
        sample = read(tmp_path, lines(*rows, head=f"{HEAD}Atoms  # {style}\n\n"))
        np.testing.assert_allclose(sample.positions * 1e6, IN_BOX, rtol=1e-12)
        bare = lines(*rows, head=f"{HEAD}Atoms\n\n")
        bare_sample = read(tmp_path, bare, style=style)
        np.testing.assert_array_equal(bare_sample.positions, sample.positions)
        if style in ALONE:
            alone = read(tmp_path, bare)
            np.testing.assert_array_equal(alone.positions, sample.positions)
            assert f"{style} " in alone.info["remarks"][0]
        elif style not in ("dpd",):
            with pytest.raises(DustError, match=f"{style}.* fit .*sample.style: "):
                read(tmp_path, bare)


@pytest.mark.parametrize("comment", ["id type diameter density x y z", "sphere (of write_data)"])
def test_comments_of_the_section_atoms(tmp_path, comment):
    sample = read(tmp_path, SPHERES.replace("# sphere", f"# {comment}"))
    np.testing.assert_allclose(sample.positions * 1e6, IN_BOX, rtol=1e-12)
    hybrid = SPHERES.replace("# sphere", "# hybrid sphere bond")
    with pytest.raises(DustError, match="atom style is 'hybrid'; allowed: .*sample.columns"):
        read(tmp_path, hybrid)
    larger = hybrid.replace("1.2 2.65 2.2", "1.4 2.65 2.4").replace("1.2 2.65 1", "1.4 2.65 1")
    sample = read(tmp_path, larger, columns=["id", "type", "diameter", "density", "x", "y", "z"])
    np.testing.assert_allclose(sample.radii, 0.7e-6)


def test_sections_of_data_files(tmp_path):
    """Also without empty lines, below a long header, and behind the sections of bonds."""
    head = "# filling\n" * 900
    text = HEAD.replace("\n\n2 atoms", f"\n{head}\n2 atoms # both")
    text += "Masses\n\n1 2.4\n\nPair Coeffs # gran\n\n1 1 1\n\nAtoms # sphere\n"
    text += SPHERES[len(HEAD) + len("Atoms # sphere\n\n") :]
    text += "Velocities\n1 1 0 0 0 0 1\n2 2 0 0 0 0 2\n\nBonds\n\n1 1 1 2\n"
    sample = read(tmp_path, text)
    np.testing.assert_allclose(sample.positions * 1e6, IN_BOX, rtol=1e-12)
    np.testing.assert_array_equal(sample.velocities[:, 0], [1, 2])
    np.testing.assert_array_equal(sample.spins[:, 2], [1e6, 2e6])
    assert "section Masses, section Pair Coeffs, section Bonds" in sample.info["remarks"][0]


TILTED = "ITEM: BOX BOUNDS xy xz yz pp pp pp\n-2 10 0\n0 10 -2\n0 10 0\n"  # xz = -2
GENERAL = "ITEM: BOX BOUNDS abc origin pp pp pp\n10 0 0 0\n0 10 0 0\n-2 0 10 0\n"


@pytest.mark.parametrize(
    "text",
    [
        dump("id type xs ys zs", "2 1 .42 .9 .5", "1 1 .3 .9 .5", bounds=TILTED),
        dump("id type xsu ysu zsu", "2 1 .42 .9 .5", "1 1 .3 .9 .5", bounds=GENERAL),
        dump("id type x y z", "1 1 2 9 5", "2 1 3.2 9 5", bounds=GENERAL),
    ],
)
def test_tilted_cells(tmp_path, text):
    """Origin 0, edges 10, xz = -2: about its centre the cell is one further down along x."""
    sample = read(tmp_path, text, {"kind": "periodic"}, keep=["box"])
    np.testing.assert_allclose(sample.positions * 1e6, [[2, 9, 5], [3.2, 9, 5]], rtol=1e-12)
    assert sample.info["tilt"] == pytest.approx(-2e-6)
    np.testing.assert_allclose(
        sample.info["room"], np.array([-1, 9, 0, 10, 0, 10]) * 1e-6, atol=1e-18
    )


@pytest.mark.parametrize(
    "bounds, message",
    [
        ("ITEM: BOX BOUNDS xy xz yz pp pp pp\n0 13 3\n0 10 0\n0 10 0\n", "tilted by xy = 3 µm"),
        ("ITEM: BOX BOUNDS xy xz yz pp pp pp\n0 10 0\n0 12 0\n0 10 2\n", "tilted by yz = 2 µm"),
        (
            "ITEM: BOX BOUNDS abc origin pp pp pp\n0 9 0 0\n-9 0 0 0\n0 0 9 0\n",
            "has the edges a = ",
        ),
    ],
)
def test_cells_that_are_not_possible_here(tmp_path, bounds, message):
    text = dump("id type x y z", "1 1 1 5 5", "2 1 2.2 5 5", bounds=bounds)
    with pytest.raises(DustError, match=rf"sample\.keep: .*{message}"):
        read(tmp_path, text, {"kind": "periodic"}, keep=["box"])
    assert message in read(tmp_path, text).info["remarks"][0]


def test_columns_of_dumps(tmp_path):
    """Twice the same column, ids in any order, angular momenta, and a line on the others."""
    text = dump(
        "id type type xu yu zu c_pe v_x diameter mass angmomx angmomy angmomz",
        *("2 1 1 2.2 5 5 7 7 1.2 2 0 0 2.88e-1", "1 1 1 1 5 5 7 7 1.2 2 0 0 0"),
    )
    sample = read(tmp_path, text)
    np.testing.assert_allclose(sample.positions * 1e6, IN_BOX, rtol=1e-12)
    # 2/5 m r^2 = 0.288 pg um^2, and 1 rad/us
    np.testing.assert_allclose(sample.spins, [[0, 0, 0], [0, 0, 1e6]], rtol=1e-12)
    assert "mass is not that of the material" in sample.info["remarks"][0]
    assert "not read from" in sample.info["remarks"][1] and "c_pe, v_x" in sample.info["remarks"][1]


CHAIN = [(8.0, 0), (9.2, 0), (0.4, 1), (1.6, 1), (2.8, 1)]  # across a face of 10: x, ix
UNWRAPPED = [8, 9.2, 10.4, 11.6, 12.8]
HEAD_5 = MICRO.replace("\n2\n", "\n5\n")


def chain(form, columns, bounds=BOX):
    """A dump of the chain; form: text of x, ix, x + 10 ix of a grain."""
    rows = [f"{n} 1 " + form(x, i, x + 10.0 * i) for n, (x, i) in enumerate(CHAIN)]
    return dump(f"id type {columns}", *rows, bounds=bounds, head=HEAD_5)


TILTED_BOX = "ITEM: BOX BOUNDS xy xz yz pp pp pp\n0 13 3\n0 10 0\n0 10 0\n"  # b = (3, 10, 0)
FLAGGED = {
    "flags": chain(lambda x, i, xu: f"{x} 5 5 {i} 0 0", "x y z ix iy iz"),
    "flags and scaled": chain(lambda x, i, xu: f"{x / 10} .5 .5 {i} 0 0", "xs ys zs ix iy iz"),
    "unwrapped": chain(lambda x, i, xu: f"{xu} 5 5", "xu yu zu"),
    "unwrapped beside": chain(lambda x, i, xu: f"{x} 5 5 {xu} 5 5", "x y z xu yu zu"),
    "scaled beside": chain(lambda x, i, xu: f"{x} 5 5 {xu / 10} .5 .5", "x y z xsu ysu zsu"),
    # one cell further up along b, from which x comes back by 3
    "tilted": chain(lambda x, i, xu: f"{x - 3} -5 5 {i} 1 0", "x y z ix iy iz", TILTED_BOX),
    "data": lines(
        *(f"{n + 1} 1 {x} 5 5 {i} 0 0" for n, (x, i) in enumerate(CHAIN)),
        head=HEAD.replace("2 atoms", "5 atoms") + "Atoms # atomic\n\n",
    ),
}


@pytest.mark.parametrize("name", FLAGGED)
def test_image_flags_and_unwrapped_positions(tmp_path, name):
    text = FLAGGED[name]
    sample = read(tmp_path, text)
    np.testing.assert_allclose(sample.positions[:, 0] * 1e6, UNWRAPPED, rtol=1e-12)
    np.testing.assert_allclose(sample.positions[:, 1:] * 1e6, 5, rtol=1e-12)
    output = " ".join(sample.info["remarks"])
    assert ("put 3 of its 5 grains outside" in output) == (name not in ("unwrapped", "tilted"))
    assert "not read" not in output or " ix" not in output.partition("not read")[2]
    if name in ("flags", "data"):  # in the cell that is kept, the images make no difference
        periodic_sample = read(tmp_path, text, {"kind": "periodic"}, keep=["box"])
        np.testing.assert_allclose(
            periodic_sample.positions[:, 0] * 1e6, [x for x, _ in CHAIN], rtol=1e-12
        )
        assert "outside" not in " ".join(periodic_sample.info.get("remarks", ()))
    if name == "flags":
        columns = ["id", "type", "x", "y", "z", "_", "_", "_"]
        loose_sample = read(tmp_path, text, columns=columns, touch_within=1e-3)
        assert "1 of its 4 contacts is across faces of its cell" in loose_sample.info["remarks"][-1]


def test_flags_of_grains_that_have_mixed(tmp_path):
    """A packing whose grains have crossed the faces often is as it is in its cell."""
    rows = [f"{n} 1 {1 + 1.2 * n} 5 5 {n % 2} 0 0" for n in range(5)]
    text = dump("id type x y z ix iy iz", *rows, head=HEAD_5)
    sample = read(tmp_path, text)
    np.testing.assert_allclose(sample.positions[:, 0] * 1e6, 1 + 1.2 * np.arange(5), rtol=1e-12)
    assert "ix iy iz are not used: 4 pairs of grains touch" in sample.info["remarks"][0]
    rows = ("1 1 1 5 5 1 0 0", "2 1 9 5 5 0 0 0")
    sample = read(tmp_path, dump("id type x y z ix iy iz", *rows, bounds=BOX.replace("10", "9", 1)))
    assert "grains would overlap" in sample.info["remarks"][0]


@pytest.mark.parametrize("form", ["dump", "list", "data"])
def test_fragments_of_files_without_contacts(tmp_path, form):
    """The largest by the distances, across the faces of a cell that the file has."""
    rows = [*CHAIN, (5.0, 0), (5.0, 1)]
    z = [5.0] * 5 + [8.0, 8.0]
    text = {
        "dump": dump(
            "id type x y z",
            *(f"{n} 1 {x + 1.2 * (n == 6)} 5 {z[n]}" for n, (x, _) in enumerate(rows)),
            head=MICRO.replace("\n2\n", "\n7\n"),
        ),
        "list": lines(*(f"{x} 5 5" for x in UNWRAPPED), "5 5 8", "6.2 5 8"),
        "data": lines(
            *(f"{n + 1} 1 {x} 5 5" for n, x in enumerate(UNWRAPPED)), "6 1 5 5 8", "7 1 6.2 5 8",
            head=HEAD.replace("2 atoms", "7 atoms") + "Atoms # atomic\n\n",
        ),
    }[form]  # fmt: skip
    largest = read(tmp_path, text, units="um", fragment="largest")
    np.testing.assert_allclose(largest.positions[:, 0] * 1e6, UNWRAPPED, rtol=1e-12)
    assert largest.info["fragments"] == 2 and largest.info["grains_of_all"] == 7
    assert len(read(tmp_path, text, units="um", fragment=1)) == 2
    with pytest.raises(DustError, match="sample.fragment = 2: .* has 2 fragments"):
        read(tmp_path, text, units="um", fragment=2)
    apart = lines("0 0 0", "5 0 0")
    with pytest.raises(DustError, match="sample.fragment = largest: no two grains .* touch"):
        read(tmp_path, apart, units="um", fragment="largest")


def test_units_without_a_scale(tmp_path):
    """lj: lengths by sample.units, and no motion, whose unit nobody can know."""
    text = dump("id type x y z vx vy vz mass", "1 1 1 5 5 1 0 0 1", "2 1 2 5 5 0 0 0 1")
    text = text.replace("micro", "lj")
    sample = read(tmp_path, text, units="1.2 um")
    np.testing.assert_allclose(sample.positions[:, 0] * 1e6, [1.2, 2.4], rtol=1e-12)
    assert not sample.velocities.any()
    assert "mass, velocity (lj has no unit of time)" in sample.info["remarks"][0]
    with pytest.raises(DustError, match="units are lj, without a scale; allowed: sample.units"):
        read(tmp_path, text)
    titled = SPHERES.replace("units = micro", "units = lj")
    np.testing.assert_allclose(read(tmp_path, titled, units="um").positions * 1e6, IN_BOX)


def test_ids_that_are_there_twice(tmp_path):
    text = dump("id type x y z", "2 1 1 5 5", "2 1 2.2 5 5")
    with pytest.raises(DustError, match="its id 2 is on lines 12 and 13; allowed: each id once"):
        read(tmp_path, text)
    assert len(read(tmp_path, text, columns=["_", "type", "x", "y", "z"])) == 2
    # atoms without ids have the number 0
    assert len(read(tmp_path, dump("id type x y z", "0 1 1 5 5", "0 1 2.2 5 5"))) == 2
    twice = SPHERES.replace("\n2 1 1.2", "\n1 1 1.2")
    with pytest.raises(DustError, match="its id 1 is on lines 12 and 13"):
        read(tmp_path, twice)
    # pandas numbers the rows of tables that are put together from 0 on again
    table = ",x,y,z\n0,0,0,0\n1,1.2,0,0\n0,5,0,0\n"
    sample = read(tmp_path, table, units="um")
    np.testing.assert_allclose(sample.positions[:, 0] * 1e6, [0, 1.2, 5], rtol=1e-12)
    assert "some ids are there twice" in sample.info["remarks"][0]


def test_dumps_without_names_of_columns(tmp_path):
    rows = ("1 1 .1 .5 .5", "2 1 .22 .5 .5")
    dump_text = dump("", *rows, head=STEP, bounds="ITEM: BOX BOUNDS\n0 1\n0 1\n0 1\n")
    with pytest.raises(DustError, match=r"names no columns, .*columns: \[id, type, xs, ys, zs\]"):
        read(tmp_path, dump_text, units="10 um")
    sample = read(tmp_path, dump_text, units="10 um", columns=["id", "type", "xs", "ys", "zs"])
    np.testing.assert_allclose(sample.positions * 1e6, IN_BOX, rtol=1e-12)


def test_materials_by_name(tmp_path):
    """Species and types that are names of the scene's materials; others are refused."""
    ice = {"ice": "ice_t19"}
    text = dump("id element x y z radius", "1 ice 1 5 5 .6", "2 default 2.2 5 5 .6")
    assert read(tmp_path, text, materials=ice).materials.tolist() == [1, 0]
    with pytest.raises(DustError, match="its grains are O, default, and the materials"):
        read(tmp_path, text.replace("ice", "O"), materials=ice)
    labels = f"{HEAD}Atom Type Labels\n\n1 ice\n2 default\n\nAtoms # atomic\n\n"
    labelled = lines(
        "1 1 1 5 5", "2 2 2.2 5 5", head=labels.replace("1 atom types", "2 atom types")
    )
    assert read(tmp_path, labelled, materials=ice).materials.tolist() == [1, 0]
    first_sample = read(tmp_path, text.replace("ice", "O"))
    assert (
        first_sample.materials is None and "species (O, default)" in first_sample.info["remarks"][0]
    )


SIDES = "ITEM: BOX BOUNDS pp ff sm\n0 10\n-1 9\n0 8\n"
MOVING = ("2 1 0.5 0.5 0.5 1 2 3 0.6", "1 1 0.1 0.1 0.25 4 5 6 0.6")
DUMP = dump("id type xs ys zs vx vy vz radius", *MOVING, bounds=SIDES)
LATER = STEP.replace("\n0\n", "\n10\n")
DUMP += dump("id type x y z", "1 1 3 4 5", "2 1 6 4 5", bounds=SIDES, head=LATER)
DATA = lines(
    *("2 1 1.2e-6 2650 2e-6 0 0 0 0 0", "1 1 1.2e-6 2650 0 0 0 0 0 0", "", "Velocities", ""),
    *("1 0.5 0 0 0 0 7", "2 -0.5 0 0 0 0 0"),
    head="LAMMPS data file via write_data, timestep = 0, units = si"
    + HEAD[len("a title, units = micro") :].replace("10 ", "1e-5 ")
    + "Atoms # sphere\n\n",
)


@pytest.mark.parametrize(
    "text, keys, positions, speeds, spins",
    [
        (DUMP, {}, [[3, 4, 5], [6, 4, 5]], [0, 0], [0, 0]),
        (DUMP, {"snapshot": 0}, [[1, 0, 2], [5, 4, 4]], [4, 1], [0, 0]),
        (DATA, {}, [[0, 0, 0], [2, 0, 0]], [0.5, -0.5], [7, 0]),
    ],
)
def test_grains_and_their_motion(tmp_path, text, keys, positions, speeds, spins):
    """In the order of the ids, in the units of the file."""
    check_motion(read(tmp_path, text, **keys), positions, speeds, spins)


REFUSED = [
    (SPHERES.replace("2 atoms", "3 atoms"), "announces 3 atoms, .* section Atoms is 2"),
    (SPHERES.replace("2 atoms", "1 atoms"), "announces 1 atoms, .* section Atoms is 2"),
    (
        SPHERES + "\nVelocities\n\n1 0 0 0 0 0 0\n3 0 0 0 0 0 0\n",
        "ids of its section Velocities",
    ),
    (SPHERES.replace("sphere", "full"), "not of the style full: the column type is not of"),
    (SPHERES.replace("1 1 1.2", "1 dust 1.2"), "column type has texts"),
    (SPHERES.replace("0 10 xlo", "20 10 xlo"), "line 6 .* the upper end is below"),
    (
        lines("1 1 1 1 1 5 5", head=f"{HEAD.replace('2 at', '1 at')}Atoms # body\n\n"),
        "its grains are bodies; allowed: spheres",
    ),
    (
        lines("1 1 1 1 1 5 5", head=f"{HEAD.replace('2 at', '1 at')}Atoms # ellipsoid\n\n")
        + "\nEllipsoids\n\n1 1.2 1 1.2 1 0 0 0\n",
        "ellipsoid of the diameters 1.2, 1, 1.2",
    ),
    (dump("id type x y z", "1 1 1 5 5"), "line 6 announces 2 .* below is 1"),
    (dump("id type x y z", *["1 1 1 5 5"] * 3), "line 6 announces 2 .* below is 3"),
    (dump("id type x y", "1 1 1 5", "2 1 1 5"), "it lacks z"),
    (dump("id x y z r radius", "1 1 5 5 .6 .7", "2 3 5 5 .6 .7"), "both are its radius"),
    (dump("id type x y z", "1 0 1 5 5", "2 1 3 5 5"), "its type 0 has no material"),
    ("ITEM: TIMESTEP\n0\nITEM: ENTRIES a b\n1 2\n", "it is a dump local"),
    (DUMP.replace("micro", "inch"), "its units are 'inch'; allowed: micro"),
    (DUMP.replace("3 4 5", "3 4"), r"line 23 \('1 1 3 4'\) has 4 columns; allowed: 5"),
    (DATA.replace("# sphere", "# bond"), "style bond have 6 columns, or 9 .* has 10"),
]


@pytest.mark.parametrize("text, keys, message", expand_cases(REFUSED))
def test_files_that_are_refused(tmp_path, text, keys, message):
    check_refusal(tmp_path, text, keys, message)
