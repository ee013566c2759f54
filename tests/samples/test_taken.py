"""What a sample takes of another run: a snapshot, a fragment, walls and their load, time."""

from functools import partial

import netCDF4
import numpy as np
import pytest
import yaml

from dusttaichi.analysis import open_run, read_frame
from dusttaichi.errors import DustError
from dusttaichi.grains.build import build
from dusttaichi.physics.geometry import WALLS, nearest_image
from dusttaichi.results.integrity import DIGEST
from dusttaichi.run import execute
from dusttaichi.samples import Sample, make
from dusttaichi.samples.taken import fragment
from dusttaichi.scene import Scene, from_yaml

CAKE = """
name: cake
material: silicate_s12
sample: {kind: lattice, structure: sc, cells: [3, 3, 3]}
boundary: {kind: box}
stages:
  - {name: press, drive: {wall_speed: 0.5 m/s}, stop: {time: 15 ns}}
  - {name: rest, stop: {steps: 2000}}
  - {name: hold, stop: {steps: 1000}}
numerics: {threads: 1, time_step: 0.15 ns}
output: {series: {steps: 50}, snapshots: off}
"""
TOP, BOTTOM = WALLS.index("top"), WALLS.index("bottom")


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """A cake that is pressed, then held: snapshots at the start, and after each stage."""
    return execute(from_yaml(CAKE), tmp_path_factory.mktemp("pressed") / "run")


def onward(pressed, boundary=None, **sample):
    """The scene that goes on with a pressed cake, its walls at rest."""
    data = yaml.safe_load(CAKE)
    del data["stages"]
    data["sample"] = {"kind": "explicit", "file": str(pressed), **sample}
    return Scene.from_dict(
        data | {"boundary": boundary or {"kind": "box"}, "stop": {"steps": 1000}}
    )


def pressures(directory):
    """Time [s] and pressure on the top wall [Pa] of all records."""
    with open_run(directory) as run:
        return run.series.time.values, run.series.pressure.values[:, TOP]


def test_a_pressed_cake_goes_on_under_its_load(pressed, tmp_path):
    """The run that is cut in two and goes on with all that can be kept is the run that is not:
    the crystal rings on under its walls in the same way."""
    told = []
    scene = onward(pressed, snapshot=2, keep=["walls", "box", "time"])
    found = execute(scene, tmp_path / "run", log=told.append)
    assert not [text for text in told if "grains may meet" not in text]  # walls are fast here
    with open_run(pressed) as run:
        frame = read_frame(run, 2)
        forces = run.contacts(2, "wall_contacts")
    load = forces.normal_force.values[forces.wall.values == TOP].sum() / np.prod(frame.edges[:2])
    time, pressure = pressures(found)
    end, uncut = (values[-1] for values in pressures(pressed))
    assert load > 5e4 and time[0] == frame.time
    # the damping of half a step before the snapshot is not part of what is kept
    assert pressure[0] == pytest.approx(load, rel=1e-4)
    assert time[-1] == pytest.approx(end, rel=1e-12)
    assert pressure[-1] == pytest.approx(uncut, rel=1e-4) and uncut > load
    with open_run(found) as run:
        assert read_frame(run, 0).cell == pytest.approx(frame.cell, rel=1e-12)


def test_what_is_left_behind_is_said(pressed, tmp_path):
    sample = make(onward(pressed, snapshot=2))
    (said,) = sample.info["remarks"]
    assert "contacts with walls and the load that they carry; the positions of its walls" in said
    assert "(to keep them: sample.keep: [walls, box])" in said
    sample = make(onward(pressed, snapshot=2, keep=["box"]))
    (said,) = sample.info["remarks"]
    assert "positions of its walls" not in said and "[walls]" in said
    sim = build(onward(pressed, snapshot=2, keep=["box"]), sample)
    with open_run(pressed) as run:
        room = read_frame(run, 2).cell.ravel() * 1e6
    np.testing.assert_allclose(sim.box.planes(0.0), room, rtol=1e-12)
    open_top = {"kind": "box", "omit": ["top"]}
    sample = make(onward(pressed, open_top, snapshot=2, keep=["walls"]))
    assert sample.info["remarks"][-1].endswith("contacts with top: no such walls here")
    assert not (sample.wall_contacts["wall"] == TOP).any()
    assert (sample.wall_contacts["wall"] == BOTTOM).any()


def test_snapshots_and_fragments(pressed, tmp_path):
    with open_run(pressed) as run:
        first = read_frame(run, 0)
    np.testing.assert_array_equal(make(onward(pressed, snapshot=0)).positions, first.position)
    file = tmp_path / "result.nc"
    file.write_bytes((pressed / "result.nc").read_bytes())
    with netCDF4.Dataset(file, "a") as data:  # the third layer is cut off, but for one contact
        data.delncattr(DIGEST)
        count = int(data["snapshots/contact_count"][:1].sum())
        i, j = (data[f"contacts/grain_{n}"][:count] for n in "ij")
        x = first.position[:, 0]
        across = np.flatnonzero(np.abs(x[i] - x[j]) > 0.6e-6)
        data["contacts/grain_i"][across[1:]] = i[0]
        data["contacts/grain_j"][across[1:]] = j[0]
    largest = make(onward(file, snapshot=0, fragment="largest"))
    assert len(largest) == 18 and largest.info["fragments"] == 2
    second = make(onward(file, snapshot=0, fragment=1))
    assert len(second) == 9 and np.ptp(second.positions[:, 0]) < 1e-8
    i, j = second.contacts["i"], second.contacts["j"]
    apart = np.linalg.norm(second.positions[i] - second.positions[j], axis=1)
    assert np.all(apart < 1.2e-6) and set(i) | set(j) == set(range(9))


def test_a_fragment_is_put_together_across_the_faces_of_a_cell():
    """A chain of three about a face, in a cell of 10; contacts hold it, not the distances."""
    x = np.array([[9.4, 0, 0], [0.4, 0, 0], [1.4, 0, 0], [5.0, 0, 0]]) * 1e-6
    pairs = {"i": np.array([0, 1]), "j": np.array([1, 2])}
    found, _, number = fragment(
        Sample(x, x, x, pairs),
        None,
        "largest",
        nearest=partial(nearest_image, period=np.array([1e-5, np.inf, np.inf])),
        masses=np.ones(4),
        where="here",
    )
    assert number == 2
    np.testing.assert_allclose(found.positions[:, 0], [9.4e-6, 10.4e-6, 11.4e-6], rtol=1e-12)


@pytest.mark.parametrize(
    "sample, boundary, message",
    [
        ({"snapshot": 4}, None, r"sample.snapshot = 4: .* has 4 snapshots; allowed: 0 to 3"),
        ({"fragment": 99}, None, r"sample.fragment = 99: .* fragments; allowed: 0 to"),
        ({"keep": ["box"]}, {"kind": "box", "size": ["1 mm"] * 3}, "boundary.size must be fit"),
        ({"keep": ["walls"]}, {"kind": "plates", "gap": "1 mm"}, "boundary.gap must be fit"),
        ({"keep": ["walls"]}, {"kind": "open"}, "no walls and faces in this scene"),
    ],
)
def test_what_cannot_be_taken_is_refused(pressed, sample, boundary, message):
    with pytest.raises(DustError, match=message):
        make(onward(pressed, boundary, **sample))


def test_keys_of_another_run_need_one(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z\n0,0,0\n")
    with pytest.raises(DustError, match="such a file has no snapshots"):
        make(onward(tmp_path / "a.csv", snapshot=2))
    with pytest.raises(DustError, match="has no walls and no cell"):
        make(onward(tmp_path / "a.csv", keep=["walls"]))
    data = onward(tmp_path)._given | {
        "sample": {"kind": "explicit", "positions": [["0 m"] * 3], "keep": ["box"]}
    }
    with pytest.raises(DustError, match="keep = .*: it is allowed only together with file"):
        Scene.from_dict(data)


def test_contacts_with_walls_that_cannot_be_are_refused(pressed, tmp_path):
    file = tmp_path / "result.nc"
    file.write_bytes((pressed / "result.nc").read_bytes())
    with netCDF4.Dataset(file, "a") as data:
        data.delncattr(DIGEST)
        data["wall_contacts"]["wall"][-1] = 7
    with pytest.raises(DustError, match="names wall 7; allowed: 0 to 5"):
        make(onward(file, keep=["walls"]))


def test_a_sphere_of_a_run(pressed):
    of = {"kind": "explicit", "file": str(pressed)}
    body = make(onward(pressed).with_value("sample", {"kind": "cutout", "of": of, "grains": 7}))
    assert len(body) == 7 and body.wall_contacts is None and len(body.contacts["i"]) == 6
    assert body.info["cut_from"] == 27 and body.info["shape"] == "sphere"
    assert not body.info.get("remarks") and not body.velocities.any()
    with pytest.raises(DustError, match="kind: cutout, of: {kind: explicit"):
        onward(pressed, grains=8, seed=3)
