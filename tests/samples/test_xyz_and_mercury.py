"""Files of XYZ, as of ASE and OVITO, and of MercuryDPM: what is read and what is refused."""

import numpy as np
import pytest
from grain_texts import XYZ, check_motion, check_refusal, expand_cases, lines, read


@pytest.mark.parametrize(
    "text, keys, positions, speeds, spins",
    [
        (XYZ, {"units": "um"}, [[0, 0, 0], [0, 0, 1.2]], [0, 0], [0, 0]),
    ],
)
def test_grains_of_a_plain_xyz(tmp_path, text, keys, positions, speeds, spins):
    check_motion(read(tmp_path, text, **keys), positions, speeds, spins)


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


REFUSED = [
    ("3\n\nC 0 0 0\nC 1 0 0\n2\n\nC 0 0 0\nC 1 0 0\n", r"line 1 .* is 2, where line 5 \('2'\)"),
    ("2\n\nC 0 0 0\nC 1 0 0\nend\n2\n\nC 0 0 0\nC 1 0 0\n", "line 5 .'end'. is one line more"),
    ("2\n\nC 0 0 0 .6\nC 1.2 0 0 .6\n", r"have no names, .* columns: \[species, x, y, z, rad"),
    ("2\nProperties=species:S:1:pos:R:3\nC 0 0 0 1\nC 2 0 0 1\n", "have 4 columns, and line 3"),
    ("1\n0 0 0 .6\n1.2 0 0 .6\n", "can be the comment of an XYZ or a grain of a list"),
    ("3\n\n1 0 0 .6\n2 9 0 .6\n9 9 9 .6\n", "can be x y z r or type x y z; sample.columns"),
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
]


@pytest.mark.parametrize("text, keys, message", expand_cases(REFUSED))
def test_files_that_are_refused(tmp_path, text, keys, message):
    check_refusal(tmp_path, text, keys, message)
