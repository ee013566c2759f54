"""Snapshots written by `dust export`, and files written by LAMMPS, read as samples."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
import snapshots
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scenes import RADIUS, make_scene

from dusttaichi import analysis, samples
from dusttaichi.errors import DustError
from dusttaichi.export import export
from dusttaichi.samples.formats.lammps import lammps_program, run_lammps

# alike on every machine
SUITE = settings(derandomize=True, deadline=None, max_examples=20, phases=[Phase.generate])
MICRO = 1e-6
RTOL = 1e-9  # of the digits of a file: twelve and more
ATOL = 1e-18  # m: the eighth decimal of an Angstrom


@st.composite
def frames(draw):
    """A snapshot with radii, a box (6,) [m], its periodic axes, and tilt [m]."""
    digits = draw(st.integers(1, 12))
    n = draw(st.integers(1, 4))
    number = st.floats(-1.0, 1.0, allow_subnormal=False)

    def vectors():
        rows = draw(st.lists(st.tuples(number, number, number), min_size=n, max_size=n))
        return np.round(np.array(rows), digits)

    sizes = st.floats(0.3, 0.9)
    radius = np.round(draw(st.lists(sizes, min_size=n, max_size=n)), max(digits, 2)) * MICRO
    # two micrometres apart along x, so that no sample is refused for its overlaps
    apart = np.arange(n)[:, None] * [2.5, 0.0, 0.0]
    position = (apart + 0.3 * vectors()) * MICRO
    low = np.round(np.array([-1.5, -2.0, -3.0]) + 0.5 * vectors()[0], digits) * MICRO
    edges = np.round(np.array([14.0, 5.0, 6.0]) + vectors()[0], digits) * MICRO
    box = np.stack([low, low + edges], axis=1).ravel()
    axes = draw(st.sampled_from(["x y z", "x y", "x", "", "x y z"]))
    tilt = draw(st.integers(-49, 49)) * 0.01 * edges[0] if axes == "x y z" else 0.0
    frame = {"position": position, "velocity": vectors(), "spin": 1e5 * vectors(), "tilt": tilt}
    return frame, radius, box, axes


def compare(sample, case, to):
    """Check a sample against the snapshot that it was written from."""
    frame, radius, box, axes = case
    np.testing.assert_allclose(sample.positions, frame["position"], rtol=RTOL, atol=ATOL)
    radii = np.full(len(radius), RADIUS) if sample.radii is None else sample.radii
    np.testing.assert_allclose(radii, radius, rtol=RTOL, atol=ATOL)
    # eight decimals of m/s and rad/s in extended XYZ
    np.testing.assert_allclose(sample.velocities, frame["velocity"], rtol=RTOL, atol=1e-8)
    np.testing.assert_allclose(sample.spins, frame["spin"], rtol=RTOL, atol=1e-8)
    np.testing.assert_allclose(sample.info["room"], box, rtol=RTOL, atol=ATOL)
    assert sample.info.get("tilt", 0.0) == pytest.approx(frame["tilt"], rel=1e-7, abs=ATOL)
    if to != "lammps-data":  # which does not say along which axes it is periodic
        edges = sample.info.get("cell", {}).get("period", [None] * 3)
        assert [edge is not None for edge in edges] == [axis in axes for axis in "xyz"]


@SUITE
@given(frames())
def test_an_export_comes_back_through_its_reader(case):
    frame, radius, box, axes = case
    boundary = {"kind": "periodic"} if axes == "x y z" else {"kind": "box", "size": "fit"}
    with tempfile.TemporaryDirectory() as folder:
        result = snapshots.write(
            Path(folder) / "result.nc", [frame], radius, box=box, periodic=axes
        )
        with analysis.open_run(result) as run:
            paths = {to: export(run, to)[0] for to in ("extxyz", "lammps", "lammps-data")}
        for to, path in paths.items():
            block = {"kind": "explicit", "file": str(path), "keep": ["box"]}
            compare(samples.make(make_scene(sample=block, boundary=boundary)), case, to)


R = 0.6e-6
PLACES = np.array([[0.0, 0.0, 0.0], [1.2, 0.0, 0.0], [0.0, 1.2, 0.5]]) * 1e-6


@pytest.fixture
def lammps():
    try:
        lammps_program()
    except DustError:
        pytest.skip("LAMMPS itself writes and reads these")


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
