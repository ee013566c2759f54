"""Files that LAMMPS itself writes."""

import numpy as np
import pytest
import snapshots
from scenes import make_scene

from dusttaichi import analysis, samples
from dusttaichi.errors import DustError
from dusttaichi.export import export
from dusttaichi.samples.formats.lammps import lammps_program, run_lammps

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
