"""Lists of grains: separators, names and units of columns, packed files, what is refused."""

import bz2
import gzip
import lzma

import numpy as np
import pytest
from grain_texts import PAIR, XYZ, check_motion, check_refusal, expand_cases, lines, read
from scenes import make_scene

from dusttaichi import samples
from dusttaichi.samples.formats.names import find_quantity, heading
from dusttaichi.samples.formats.text import Source

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


# all columns, in any order
CSV = lines(
    "wz [rad/us], wy [rad/us], wx [rad/us], vz [cm/s],vy [cm/s],vx [cm/s],z [um],y [um],x [um]",
    "7,0,0,0,0,50,0,0,0",
    "0,0,0,0,0,-50,0,0,2",
)


@pytest.mark.parametrize(
    "text, keys, positions, speeds, spins",
    [
        (CSV, {}, [[0, 0, 0], [2, 0, 0]], [0.5, -0.5], [7e6, 0]),
        (CSV.replace(" [um]", ""), {"units": "um"}, [[0, 0, 0], [2, 0, 0]], [0.5, -0.5], [7e6, 0]),
    ],
)
def test_grains_and_their_motion(tmp_path, text, keys, positions, speeds, spins):
    check_motion(read(tmp_path, text, **keys), positions, speeds, spins)


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


REFUSED = [
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
    (
        "x,y,z,r\n0,0,0,600\n3000,0,0,1200\n",
        "radius of grain 1 .* up to 1 mm. Are lengths in the unit",
    ),
    (
        "x,y,z,r\n0,0,0,.6\n3,0,0,.0001\n",
        "radius of grain 1 .* is 0.0001 µm; allowed: above .* 1 mm.$",
    ),
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


@pytest.mark.parametrize("text, keys, message", expand_cases(REFUSED))
def test_files_that_are_refused(tmp_path, text, keys, message):
    check_refusal(tmp_path, text, keys, message)
