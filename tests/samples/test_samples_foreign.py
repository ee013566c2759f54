"""Files that LAMMPS writes, of several snapshots, and those that it reads of this program."""

import numpy as np
import pytest
import snapshots
from scenes import make_scene
from test_formats import read

from dusttaichi import analysis, samples
from dusttaichi.errors import DustError
from dusttaichi.export import export
from dusttaichi.samples.formats.lammps import lammps_program, run_lammps

R = 0.6e-6
PLACES = np.array([[0.0, 0.0, 0.0], [1.2, 0.0, 0.0], [0.0, 1.2, 0.5]]) * 1e-6

DUMP = """ITEM: UNITS
micro
ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
2
ITEM: BOX BOUNDS pp ff sm
0 10
-1 9
0 8
ITEM: ATOMS id type xs ys zs vx vy vz radius
2 1 0.5 0.5 0.5 1 2 3 0.6
1 1 0.1 0.1 0.25 4 5 6 0.6
ITEM: TIMESTEP
10
ITEM: NUMBER OF ATOMS
2
ITEM: BOX BOUNDS pp ff sm
0 10
-1 9
0 8
ITEM: ATOMS id type x y z
1 1 3 4 5
2 1 6 4 5
"""
DATA = """LAMMPS data file via write_data, timestep = 0, units = si

2 atoms
1 atom types

0 1e-5 xlo xhi
0 1e-5 ylo yhi
0 1e-5 zlo zhi

Atoms # sphere

2 1 1.2e-6 2650 2e-6 0 0 0 0 0
1 1 1.2e-6 2650 0 0 0 0 0 0

Velocities

1 0.5 0 0 0 0 7
2 -0.5 0 0 0 0 0
"""
XYZ = "2\nmade by hand\nC 0 0 0\nC 0 0 1.2\n"


@pytest.fixture
def lammps():
    try:
        lammps_program()
    except DustError:
        pytest.skip("LAMMPS itself writes and reads these")


@pytest.mark.parametrize(
    "text, keys, places, speeds, spins",
    [
        (DUMP, {}, [[3, 4, 5], [6, 4, 5]], [0, 0], [0, 0]),
        (DUMP, {"snapshot": 0}, [[1, 0, 2], [5, 4, 4]], [4, 1], [0, 0]),
        (DATA, {}, [[0, 0, 0], [2, 0, 0]], [0.5, -0.5], [7, 0]),
        (XYZ, {"units": "um"}, [[0, 0, 0], [0, 0, 1.2]], [0, 0], [0, 0]),
    ],
)
def test_grains_and_their_motion(tmp_path, text, keys, places, speeds, spins):
    """In the order of the ids, in the units of the file."""
    sample = read(tmp_path, text, **keys)
    np.testing.assert_allclose(sample.positions, np.array(places) * 1e-6, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(sample.velocities[:, 0], speeds)
    np.testing.assert_allclose(sample.spins[:, 2], spins)


@pytest.mark.parametrize(
    "text, said",
    [
        (DUMP.replace("micro", "lj"), "its units are 'lj'; allowed: micro"),
        (DUMP.replace("3 4 5", "3 4"), r"line 23 \('1 1 3 4'\) has 4 columns; allowed: 5"),
        (DATA.replace("# sphere", "# bond"), "style bond have 6 columns, or 9 .* has 10"),
        (XYZ.replace("2", "3", 1), "line 1 announces 3 grains, and the number of lines .* is 2"),
    ],
)
def test_what_cannot_be_used_is_said(tmp_path, text, said):
    with pytest.raises(DustError, match=said):
        read(tmp_path, text)


def test_a_restart_file_is_read_again(tmp_path, lammps):
    """Files of the other exports: test_round_trip."""
    moves = np.array([[1.0, 0, 0], [0, 2.0, 0], [0, 0, 3.0]])
    frame = {"position": PLACES, "velocity": moves, "spin": 1e5 * moves}
    snapshots.write(tmp_path / "result.nc", [frame], R)
    with analysis.open_run(tmp_path) as run:
        path = export(run, "lammps-restart")[0]
    block = {"kind": "explicit", "file": str(path), "touch_within": 0}
    sample = samples.make(make_scene(sample=block))
    np.testing.assert_allclose(sample.positions, PLACES, rtol=0, atol=1e-15)
    np.testing.assert_allclose(sample.velocities, moves, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(sample.spins, 1e5 * moves, rtol=1e-7, atol=1e-3)


LAMMPS = """units micro
atom_style {style}
region b prism 0 10 0 10 0 10 0 -2 0
create_box 2 b
create_atoms 1 single 1 9 5
create_atoms 2 single 2.2 9 5
{sizes}
dump a all custom/gz 1 a.dump.gz id type xs ys zs vx vy vz
dump b all custom 1 b.dump id element xsu ysu zsu mass
dump_modify b element ice default units yes time yes
dump c all atom 1 c.dump
dump d all xyz 1 d.xyz
dump_modify d element ice default
run 0
write_data e.data
"""
SIZES = {
    "sphere": "set group all diameter 1.2\nset group all density 2.65",
    "ellipsoid": "set group all shape 1.2 1.2 1.2\nset group all density 2.65",
    "full": "mass * 2.4",
}


@pytest.mark.parametrize("style", SIZES)
def test_files_that_lammps_writes(tmp_path, lammps, style):
    """Of a tilted cell; a packed dump, scaled positions, elements, a data file."""
    (tmp_path / "in").write_text(LAMMPS.format(style=style, sizes=SIZES[style]))
    run_lammps(tmp_path, "-in", "in")
    for name in ("a.dump.gz", "b.dump", "c.dump", "d.xyz", "e.data"):
        sample = {"kind": "explicit", "file": str(tmp_path / name), "units": "um"}
        sample["touch_within"] = 0
        sample |= {} if name == "d.xyz" else {"keep": ["box"]}
        boundary = {"kind": "open" if name == "d.xyz" else "periodic"}
        made = samples.make(
            make_scene(sample=sample, boundary=boundary, materials={"ice": "ice_t19"})
        )
        # six digits of a dump, of the cell
        np.testing.assert_allclose(made.positions * 1e6, [[1, 9, 5], [2.2, 9, 5]], atol=2e-5)
        elements = name in ("b.dump", "d.xyz")
        assert made.materials.tolist() == ([1, 0] if elements else [0, 1])
        if name != "d.xyz":
            assert made.info["tilt"] == pytest.approx(-2e-6)
            room = np.array([-1, 9, 0, 10, 0, 10]) * 1e-6
            np.testing.assert_allclose(made.info["room"], room, rtol=1e-9, atol=1e-15)


def test_grains_that_do_not_touch_are_remarked(tmp_path):
    far = read(tmp_path, XYZ, units="mm")
    (text,) = far.info["remarks"]
    assert "no two of its 2 grains touch" in text and "units" in text
    assert "remarks" not in read(tmp_path, XYZ, units="um").info
