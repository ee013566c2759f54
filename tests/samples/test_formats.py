"""Texts of grains in the forms that programs write: columns, separators, cells, atom styles."""

import bz2
import gzip
import lzma

import numpy as np
import pytest
from scenes import make_scene

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.samples.formats.names import find_quantity, heading
from dusttaichi.samples.formats.text import Source

PAIR = [[0, 0, 0], [1.2, 0, 0]]  # um
IN_BOX = [[1, 5, 5], [2.2, 5, 5]]
STEP = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\n"
MICRO = f"ITEM: UNITS\nmicro\n{STEP}"
BOX = "ITEM: BOX BOUNDS pp pp pp\n0 10\n0 10\n0 10\n"
HEAD = (
    "a title, units = micro\n\n2 atoms\n1 atom types\n\n"
    "0 10 xlo xhi\n0 10 ylo yhi\n0 10 zlo zhi\n\n"
)


def lines(*rows, head=""):
    return head + "".join(f"{row}\n" for row in rows)


def read(tmp_path, text, boundary=None, materials=None, **keys):
    path = tmp_path / "grains.txt"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    options = {"materials": materials} if materials else {}
    # as they are in the file: test_touching puts them into contact
    sample = {"kind": "explicit", "file": str(path), "touch_within": 0, **keys}
    return samples.make(make_scene(sample=sample, boundary=boundary, **options))


# -- lists ---------------------------------------------------------------------------------------

LISTS = {
    "bare": lines("0 0 0", "1.2 0 0"),
    "bare with commas": lines("0.0, 0.0, 0.0", "1.2, 0.0, 0.0"),
    "with radii": lines("0 0 0 0.6", "1.2 0 0 0.6"),
    "radii first": lines("# of MSTM", "0.6 0 0 0", "0.6 1.2 0 0"),
    "tabs": lines("x\ty\tz\tradius", "0\t0\t0\t.6", "1.2\t0\t0\t.6"),
    "tabs and units": lines("x (um)\ty (um)\tz (um)\tr (nm)", "0\t0\t0\t600", "1.2\t0\t0\t600"),
    "decimal commas": lines("x;y;z;r", "0,0;0,0;0,0;0,6", "1,2;0,0;0,0;0,6"),
    "decimal commas and spaces": lines("x y z", "0,0 0,0 0,0", "1,2 0,0 0,0"),
    "decimal commas and tabs": lines("x\ty\tz", "0,0\t0,0\t0,0", "1,2\t0\t0"),
    "of a spreadsheet": lines("sep=;", "x;y;z", "0;0;0", "1,2;0;0"),
    "commented header": lines(
        "# two grains", "# x[um] y[um] z[um] r[um]", "0 0 0 .6", "1.2 0 0 .6"
    ),
    "header of commas": lines("#x,y,z,radius", "0,0,0,.6", "1.2,0,0,.6"),
    "capitals": lines("X Y Z R", "0 0 0 .6", "1.2 0 0 .6"),
    "index without a name": lines(",x,y,z", "0,0,0,0", "1,1.2,0,0"),
    "row names": lines('"x" "y" "z"', '"1" 0 0 0', '"2" 1.2 0 0'),
    "units in names": lines("x_um,y_um,z_um,radius_nm", "0,0,0,600", "1.2,0,0,600"),
    "a row of units": lines("x;y;z;r", "(um);(um);(um);(nm)", "0,0;0;0;600", "1,2;0;0;600"),
    "tabs behind commas": lines("x,\ty,\tz", "0,\t0,\t0", "1.2,\t0,\t0"),
    "title": lines("Aggregate 12, df = 1.8, kf = 1.3", "x y z r", "0 0 0 .6", "1.2 0 0 .6"),
    "count first": lines("2", "0 0 0 .6", "1.2 0 0 .6"),
    "count and names first": lines("2", "x,y,z", "0,0,0", "1.2,0,0"),
    "preamble of DDSCAT": lines("2 = NSPH", "a comment", "X Y Z R", "0 0 0 .6", "1.2 0 0 .6"),
    "Fortran": lines("0.0D0 0.0D0 0.0D0", "1.2D+00 0.0D0 0.0D0"),
    "comments behind": lines("x y z r # names", "0 0 0 .6 # one", "1.2 0 0 .6  # two"),
    "quoted decimal commas": lines("x,y,z", '"0,0","0,0","0,0"', '"1,2","0,0","0,0"'),
    "numbers of grains": lines("1 0 0 0", "2 1.2 0 0"),
    "windows": "\ufeffx,y,z\r\n0,0,0\r\n1.2,0,0\r\n",
    "latin": "x [µm],y [µm],z [µm]\n0,0,0\n1.2,0,0\n".encode("latin-1"),
    "gz": gzip.compress(b"x,y,z\n0,0,0\n1.2,0,0\n"),
    "bz2": bz2.compress(b"x,y,z\n0,0,0\n1.2,0,0\n"),
    "xz": lzma.compress(b"x,y,z\n0,0,0\n1.2,0,0\n"),
    "of YADE": lines("#format x_y_z_r_attrs", "0 0 0 .6 iron 7", "1.2 0 0 .6 ice 7"),
}


@pytest.mark.parametrize("name", LISTS)
def test_lists(tmp_path, name):
    sample = read(tmp_path, LISTS[name], units="um")
    np.testing.assert_allclose(sample.positions * 1e6, PAIR, rtol=1e-12, atol=1e-12)
    assert sample.radii is None  # 0.6 um, as of the material


PARAVIEW = lines(
    '"radius","velocity:0","velocity:1","velocity:2","Points:0","Points:1","Points:2"',
    "6e-7,1,2,3,0,0,0",
    "6e-7,1,2,3,1.2e-6,0,0",
)
OVITO = lines(
    "Particle Identifier,Position.X,Position.Y,Position.Z,Radius,Velocity.X,Velocity.Y,Velocity.Z",
    "2,1.2e-6,0,0,6e-7,1,2,3",
    "1,0,0,0,6e-7,1,2,3",
)


@pytest.mark.parametrize("text", [PARAVIEW, OVITO])
def test_tables_of_viewers(tmp_path, text):
    sample = read(tmp_path, text)
    np.testing.assert_allclose(sample.positions * 1e6, PAIR, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(sample.velocities, [[1, 2, 3]] * 2)


@pytest.mark.parametrize(
    "names, quantity",
    [
        (("x", "X", "Position.X", "Points:0", "points_0", "pos_x", "x_center"), "position"),
        (("vx", "v_x", "velo:0", "Velocity.X", "vel_x"), "velocity"),
        (("wx", "omegax", "Angular Velocity.X", "spin:0", "omega_x"), "spin"),
        (("angmomx", "angmom_x"), "angular_momentum"),
        (("r", "Radius", "RADIUS"), "radius"),
        (("matId", "matid"), "matid"),
        (("", "index", "Particle Identifier", "Unnamed: 0"), "id"),
    ],
)
def test_names_of_columns(names, quantity):
    assert {(find_quantity(name) or ("none",))[0] for name in names} == {quantity}


@pytest.mark.parametrize("name", ["mux", "x0", "ix", "fx", "c_x[1]", "zeta", "v", "temperature"])
def test_names_of_other_columns(name):
    assert find_quantity(name) is None


@pytest.mark.parametrize(
    "text, name, factor",
    [
        ("x [um]", "x", 1e-6),
        ("radius (nm)", "radius", 1e-9),
        ("vx_m_per_s", "vx", 1.0),
        ("v_x (cm/s)", "v_x", 1e-2),
        ("density (g/cm3)", "density", 1e3),
        ("q [C]", "q [C]", None),
        ("type (-)", "type", None),
    ],
)
def test_units_of_columns(text, name, factor):
    assert heading(text, Source("file", [])) == (name, pytest.approx(factor) if factor else None)


# -- LAMMPS --------------------------------------------------------------------------------------

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


SPHERES = lines("2 1 1.2 2.65 2.2 5 5", "1 1 1.2 2.65 1 5 5", head=f"{HEAD}Atoms # sphere\n\n")


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


def dump(columns, *rows, bounds=BOX, head=MICRO):
    return lines(*rows, head=f"{head}{bounds}ITEM: ATOMS {columns}\n")


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
XYZ = "2\nmade by hand\nC 0 0 0\nC 0 0 1.2\n"
# all columns, in any order
CSV = lines(
    "wz [rad/us], wy [rad/us], wx [rad/us], vz [cm/s],vy [cm/s],vx [cm/s],z [um],y [um],x [um]",
    "7,0,0,0,0,50,0,0,0",
    "0,0,0,0,0,-50,0,0,2",
)


@pytest.mark.parametrize(
    "text, keys, positions, speeds, spins",
    [
        (DUMP, {}, [[3, 4, 5], [6, 4, 5]], [0, 0], [0, 0]),
        (DUMP, {"snapshot": 0}, [[1, 0, 2], [5, 4, 4]], [4, 1], [0, 0]),
        (DATA, {}, [[0, 0, 0], [2, 0, 0]], [0.5, -0.5], [7, 0]),
        (XYZ, {"units": "um"}, [[0, 0, 0], [0, 0, 1.2]], [0, 0], [0, 0]),
        (CSV, {}, [[0, 0, 0], [2, 0, 0]], [0.5, -0.5], [7e6, 0]),
        (CSV.replace(" [um]", ""), {"units": "um"}, [[0, 0, 0], [2, 0, 0]], [0.5, -0.5], [7e6, 0]),
    ],
)
def test_grains_and_their_motion(tmp_path, text, keys, positions, speeds, spins):
    """In the order of the ids, in the units of the file."""
    sample = read(tmp_path, text, **keys)
    np.testing.assert_allclose(sample.positions, np.array(positions) * 1e-6, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(sample.velocities[:, 0], speeds)
    np.testing.assert_allclose(sample.spins[:, 2], spins)


# -- XYZ -----------------------------------------------------------------------------------------

EXTENDED = (
    "2\nProperties=id:I:1:Radius:R:1:pos:R:3:velo:R:3:species:S:1:forces:R:3 "
    'Lattice="9 0 0 0 9 0 0 0 9" pbc="T F T"\n'
    "2 .7 1.4 0 0 1 2 3 C 0 0 0\n1 .7 0 0 0 4 5 6 C 0 0 0\n"
)


def test_extended_xyz(tmp_path):
    sample = read(tmp_path, EXTENDED, {"kind": "box"}, units="um", keep=["box"])
    np.testing.assert_allclose(sample.positions[:, 0], [0, 1.4e-6])
    np.testing.assert_array_equal(sample.velocities, [[4, 5, 6], [1, 2, 3]])
    np.testing.assert_allclose(sample.radii, 0.7e-6)
    assert sample.info["cell"]["period"] == pytest.approx([9e-6, None, 9e-6])
    assert sample.info["remarks"][0].endswith("forces")


def test_grains_that_do_not_touch_are_remarked(tmp_path):
    far = read(tmp_path, XYZ, units="mm")
    (text,) = far.info["remarks"]
    assert "no two of its 2 grains touch" in text and "units" in text
    assert "remarks" not in read(tmp_path, XYZ, units="um").info
    # a cutout or a collision of grains of a file says how the file was read, once
    (tmp_path / "grains.txt").write_text(LISTS["with radii"])
    body = {"kind": "explicit", "file": str(tmp_path / "grains.txt"), "units": "um"}
    cut = {"kind": "cutout", "of": body, "diameter": "9 um"}
    flying = {"kind": "collision", "target": body, "projectile": cut, "speed": "1 m/s"}
    for block in (cut, flying):
        output = samples.make(make_scene(sample=block)).info["remarks"]
        assert ["are read as x y z r" in text for text in output].count(True) == 1


# -- MercuryDPM ----------------------------------------------------------------------------------

BODIES = ((0.0, 0.6), (1.2, 0.6), (2.4, 0.6), (3.5, 0.5))  # x, r
BOX_LINE = "4 0.5 -1 -1 -1 5 1 1"


def mercury(form, header=BOX_LINE):
    return lines(header, *(form.format(x=x, r=r, n=n) for n, (x, r) in enumerate(BODIES)))


MERCURY = {
    "spheres": mercury("{x} 0 0 0.01 0 0 {r} 0 0 0 0 0 7 0"),
    "with numbers": mercury("{x} 0 0 0.01 0 0 {r} 0 0 0 0 0 7 0 {n}"),
    "radius behind": mercury("{x} 0 0 0.01 0 0 0 0 0 0 0 7 {r} 0"),
    "disks": mercury("{x} 0 0.01 0 {r} 0 7 0", header="4 0.5 -1 -1 5 1"),
    "two snapshots": mercury("{x} 9 0 0 0 0 {r} 0 0 0 0 0 0 0", header="4 0 -1 -1 -1 5 1 1")
    + mercury("{x} 0 0 0.01 0 0 {r} 0 0 0 0 0 7 0"),
}


@pytest.mark.parametrize("name", MERCURY)
def test_mercury(tmp_path, name):
    sample = read(tmp_path, MERCURY[name], units="um", keep=["time"])
    np.testing.assert_allclose(sample.positions * 1e6, [[x, 0, 0] for x, _ in BODIES], atol=1e-12)
    np.testing.assert_allclose(sample.radii * 1e6, [r for _, r in BODIES], rtol=1e-12)
    np.testing.assert_array_equal(sample.velocities, [[0.01, 0, 0]] * 4)
    if name != "radius behind":
        np.testing.assert_array_equal(sample.spins, [[0, 0, 7]] * 4)
    assert sample.info["start_time"] == 0.5
    output = " ".join(sample.info.get("remarks", ()))
    assert ("two-dimensional" in output) == (name == "disks")
    assert ("radius behind the angular velocities" in output) == (name == "radius behind")


def test_mercury_by_the_columns_of_the_scene_and_with_its_box(tmp_path):
    text = mercury("{x} 0 0 {r} 0 0", header=BOX_LINE)
    columns = ["x", "y", "z", "radius", "_", "_"]
    sample = read(tmp_path, text, {"kind": "box"}, units="um", columns=columns, keep=["box"])
    np.testing.assert_allclose(sample.radii * 1e6, [r for _, r in BODIES], rtol=1e-12)
    np.testing.assert_allclose(
        sample.info["room"], np.array([-1, 5, -1, 1, -1, 1]) * 1e-6, rtol=1e-12
    )
    first = read(tmp_path, MERCURY["two snapshots"], units="um", snapshot=0)
    np.testing.assert_allclose(first.positions[:, 1] * 1e6, 9, rtol=1e-12)


# -- what is refused ------------------------------------------------------------------------------

REFUSED = [
    # files of LAMMPS and XYZ
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
    ("3\n\nC 0 0 0\nC 1 0 0\n2\n\nC 0 0 0\nC 1 0 0\n", r"line 1 .* is 2, where line 5 \('2'\)"),
    ("2\n\nC 0 0 0\nC 1 0 0\nend\n2\n\nC 0 0 0\nC 1 0 0\n", "line 5 .'end'. is one line more"),
    ("2\n\nC 0 0 0 .6\nC 1.2 0 0 .6\n", r"have no names, .* columns: \[species, x, y, z, rad"),
    ("2\nProperties=species:S:1:pos:R:3\nC 0 0 0 1\nC 2 0 0 1\n", "have 4 columns, and line 3"),
    ("1\n0 0 0 .6\n1.2 0 0 .6\n", "can be the comment of an XYZ or a grain of a list"),
    ("3\n\n1 0 0 .6\n2 9 0 .6\n9 9 9 .6\n", "can be x y z r or type x y z; sample.columns"),
    (DUMP.replace("micro", "inch"), "its units are 'inch'; allowed: micro"),
    (DUMP.replace("3 4 5", "3 4"), r"line 23 \('1 1 3 4'\) has 4 columns; allowed: 5"),
    (DATA.replace("# sphere", "# bond"), "style bond have 6 columns, or 9 .* has 10"),
    (XYZ.replace("2", "3", 1), "line 1 announces 3 grains, and the number of lines .* is 2"),
    (
        MERCURY["spheres"].replace("4 0.5", "5 0.5"),
        "line 1 announces 5 particles, and 4 lines follow",
    ),
    (mercury("{x} 0 0 0 0 0 0 0 0 0 0 0 0 0"), "line 2 .*neither column 7 nor 13 are radii"),
    (
        mercury("{x} 0 0 0 0 0 {r} 0 0 0 0 0 0 {n}"),
        "its matId 1 has no material in the scene",
    ),
    # lists
    ("0 0 .6\n1.5 0 .9\n0 -1.8 1.2\n", "can be x y z, or x y r of disks, .* columns: .x, y, z"),
    ("2\n\nC 0 0 .6\nC 1.2 0 .6\n", "can be x y z, or x y r of disks"),
    ("x,y\n0,0\n", "it lacks z"),
    ("x,y,z,vx\n0,0,0,0\n", "it lacks vy, vz"),
    ("a,b,c\n0,0,0\n", "header, line 1 .* of which a, b, c are not known"),
    ("x,y,z,x\n0,0,0,1\n", "columns x and x both are its position, and differ"),
    ("x,y,z\n0,1,5,3,0\n", "has the columns x, y, z, 3, and the lines below have 5"),
    ("x [um],y,z\n0,0,0\n", "some lengths have a unit and others have none"),
    ("x [kg],y,z\n0,0,0\n", "column x = '1 kg': a length is needed"),
    ("x,y,z\n0,0,0\n\n1,1\n", r"line 4 \('1,1'\) has 2 columns; allowed: 3"),
    ("x,y,z\n0,0,nought\n", "line 2: z is 'nought'; allowed: plain numbers"),
    ("x,y,z\n0,0,0\n0,nan,0\n", "position of grain 1 .* allowed: finite"),
    ("x,y,z,wx,wy,wz\n0,0,0,0,inf,0\n", "spin of grain 0 .* allowed: finite"),
    ("x,y,z\n", "no grains"),
    ("", "the file is empty"),
    ("x,y,z\n0,0,0\n9,9,9\n0,0,1\n", r"grains 0 and 2 .* are 1 µm apart, 0.833 diameters"),
    ("x,y,z\n0,0,0\n0,0,0\n", r"grains 0 and 1 .* are 0 µm apart"),
    # Python reads these as numbers, other programs do not
    *(
        (f"x,y,z\n0,0,0\n{n},9,9\n", "line 3: .*plain numbers")
        for n in ("1_0", "\u0663", "0x10", "1e")
    ),
    (
        "0 0 0 .6 1\n3 0 0 .6 1\n",
        {},
        "line 1 .* has 5, whose order is not known; sample.columns",
    ),
    ("0 0 0 .6\n3 0 0 .6\n", {"columns": ["x", "y", "z"]}, "names 3 columns .* has 4"),
    ("x y z\n0 0 0\n", {"style": "sphere"}, "is no data file of LAMMPS"),
    ("x y z\n0 0 0\n", {"snapshot": 0}, "has no snapshots"),
    ("0,1,2\n0.0,0.0,0.0\n", {}, "can be the numbers of the columns or a grain"),
    ("hello\n", {}, r"line 1 \('hello'\) begins no list of grains; allowed"),
    ("x y z\n0 0 0\n***** 0 0\n", {}, r"line 3: x is '\*\*\*\*\*'; allowed: plain numbers"),
    ("# vtk DataFile Version 3.0\n", {}, "a VTK file; allowed: the CSV that ParaView saves"),
    (gzip.compress(b"x,y,z\n" * 9, mtime=0)[:9], {}, "cannot be read .* allowed: a whole"),
    ("x,y,z\n0,0,0\n".encode("utf-16"), {}, "zero bytes, as UTF-16"),
    ("#format x_y_z_r_matId\n0 0 0 .6 5\n", {}, "its matId 5 has no material .* 0 default"),
    (
        "0 0 0\n",
        {"columns": ["x", "rad1"]},
        "'rad1' is no name of a column; allowed: x y z",
    ),
    ("0 0 0\n", {"columns": ["x", "y", "r"]}, "x, y and z are needed"),
    ("0 0 0\n", {"style": "spheer"}, "an atom style of LAMMPS is needed: sphere"),
    ("0 0 0\n", {"style": "sphere", "columns": ["x", "y", "z"]}, "one of both is needed"),
]


@pytest.mark.parametrize("text, keys, message", [(t, *(k or [{}]), m) for t, *k, m in REFUSED])
def test_files_that_are_refused(tmp_path, text, keys, message):
    pattern = r"sample\.(file = '.*grains\.txt'|columns = |style = ).*"
    with pytest.raises(DustError, match=pattern + message):
        read(tmp_path, text, **{"units": "um"} | keys)
