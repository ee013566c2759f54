"""Grains given one by one, files, the last frames of other runs and what a sample takes of them."""

from functools import partial

import netCDF4
import numpy as np
import pytest
import xarray as xr
import yaml
from bodies import PLAIN, R, make_sample

from dusttaichi.analysis import open_run, read_frame
from dusttaichi.errors import DustError
from dusttaichi.grains.build import build
from dusttaichi.physics.geometry import WALLS, nearest_image
from dusttaichi.results.integrity import DIGEST
from dusttaichi.running import execute
from dusttaichi.samples import Sample, make
from dusttaichi.samples.extraction import extract_fragment
from dusttaichi.scene import Scene, from_yaml

N = 5
RNG = np.random.default_rng(8)
STATE = {
    "position": np.arange(N)[:, None] * [2 * R, 0.1 * R, 0.0] + RNG.random((N, 3)) * 0.01 * R,
    "velocity": RNG.normal(size=(N, 3)),
    "spin": RNG.normal(size=(N, 3)) * 1e5,
}
NAMES = {"position": "xyz", "velocity": ("vx", "vy", "vz"), "spin": ("wx", "wy", "wz")}
UNITS = {"position": "m", "velocity": "m/s", "spin": "rad/s"}


def load(**keys):
    """The grains as they are in the block, or in its file."""
    keys |= {"file": str(keys["file"])} if "file" in keys else {}
    return make_sample("explicit", touch_within=0, **keys)


def write_rows(quantity):
    return [[f"{value!r} {UNITS[quantity]}" for value in row] for row in STATE[quantity].tolist()]


def assert_state(sample, rtol=0.0):
    for values, name in zip(
        (sample.positions, sample.velocities, sample.spins), STATE, strict=True
    ):
        assert values.dtype == np.float64
        np.testing.assert_allclose(values, STATE[name], rtol=rtol, atol=0)


def test_positions_from_the_yaml():
    positions = write_rows("position")
    assert_state(
        load(positions=positions, velocities=write_rows("velocity"), spins=write_rows("spin"))
    )
    still = load(positions=positions)
    assert not still.velocities.any() and not still.spins.any() and still.contacts is None
    assert len(load(positions=positions[:1])) == 1
    with pytest.raises(DustError, match=r"sample\.positions: grains 0 and 1"):
        load(positions=[["0 m"] * 3, ["0.6 um", "0 m", "0 m"]])


@pytest.mark.parametrize("name", ["absent.csv", "absent.nc", ""])
def test_missing_file_is_refused(tmp_path, name):
    with pytest.raises(DustError, match=r"sample\.file = .*there is no .*allowed"):
        load(file=tmp_path / name)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00x", b"\x89HDF\r\n\x1a\n" + b"\0" * 50])
def test_unreadable_file_is_refused(tmp_path, content):
    (tmp_path / "a.nc").write_bytes(content)
    with pytest.raises(DustError, match=r"sample\.file = .*(it cannot be read|is damaged)"):
        load(file=tmp_path / "a.nc")


@pytest.mark.parametrize("check_files", [True, False])
def test_a_path_that_no_system_takes(tmp_path, check_files):
    data = PLAIN.input_data | {"sample": {"kind": "explicit", "file": "x" * 5000}}
    with pytest.raises(DustError, match="it cannot be a file: File name too long"):
        Scene.from_dict(data, tmp_path, check_files=check_files)


# -- NetCDF and other runs ------------------------------------------------------------------------


POINTERS = [[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [0.0, -0.6, 0.8]]  # of three contacts


def write_result(path, contacts=True, counts=(1, 2)):
    """The layout of our own results; the last frame is STATE."""
    of_grains = ("snapshot", "grain", "xyz")
    groups = {
        "/snapshots": {
            name: (of_grains, np.stack([values + 1.0, values]), {"units": UNITS[name]})
            for name, values in STATE.items()
        }
    }
    if contacts:
        rows = np.arange(sum(counts))
        groups["/snapshots"]["contact_count"] = ("snapshot", list(counts))
        groups["/contacts"] = {"grain_i": ("contact", rows), "grain_j": ("contact", rows + 1)}
        pointers = ("contact", "xyz"), np.array(POINTERS[: len(rows)])
        groups["/contacts"] |= dict.fromkeys(("pointer_i", "pointer_j"), pointers)
        groups["/contacts"] |= dict.fromkeys(("twist", "approach"), ("contact", rows + 0.5))
    groups = {name: xr.Dataset(variables) for name, variables in groups.items()}
    xr.DataTree.from_dict(groups).to_netcdf(path)
    return path


def test_last_snapshot_of_another_run(tmp_path):
    file = write_result(tmp_path / "result.nc")
    for source in (file, tmp_path):
        sample = load(file=source)
        assert_state(sample)
        contacts = sample.contacts
        assert contacts["i"].tolist() == [1, 2] and contacts["j"].tolist() == [2, 3]
        assert contacts["pointer_i"].tolist() == POINTERS[1:]
        assert contacts["pointer_j"].shape == (2, 3)
        assert contacts["twist"].tolist() == contacts["approach"].tolist() == [1.5, 2.5]
    assert load(file=write_result(tmp_path / "bare.nc", contacts=False)).contacts is None
    empty = load(file=write_result(tmp_path / "none.nc", counts=(2, 0))).contacts
    assert empty["i"].shape == (0,) and empty["pointer_i"].shape == (0, 3)


def test_generic_netcdf(tmp_path):
    units = {"position": (1e6, "um"), "velocity": (1.0, "m s-1"), "spin": (1.0, "rad/s")}
    columns = {
        name: ("n", STATE[quantity][:, k] * factor, {"units": unit})
        for quantity, (factor, unit) in units.items()
        for k, name in enumerate(NAMES[quantity])
    }
    xr.Dataset(columns).to_netcdf(tmp_path / "a.nc", format="NETCDF3_CLASSIC")
    assert_state(load(file=tmp_path / "a.nc"), rtol=1e-15)  # metres to micrometres and back
    xr.Dataset({"position": (("n", "three"), STATE["position"])}).to_netcdf(tmp_path / "b.nc")
    assert np.array_equal(load(file=tmp_path / "b.nc").positions, STATE["position"])


def generic(path, **variables):
    data = {}
    for name, (values, unit) in variables.items():
        dims = [f"{name}_{axis}" for axis in range(np.ndim(values))]
        data[name] = (dims, np.array(values, float), {"units": unit} if unit else {})
    xr.Dataset(data).to_netcdf(path)
    return path


@pytest.mark.parametrize(
    "variables, message",
    [
        ({"density": (np.zeros(3), None)}, "has the variables density; allowed: position"),
        ({"x": ([0.0], "m"), "y": ([0.0], "m")}, "it lacks z; allowed: x, y, z, and vx"),
        (
            {"x": ([0.0], "m"), "y": ([0.0], "m"), "z": ([0.0, 1.0], "m")},
            r"z has the shape \(2,\); allowed: \(1,\), as many grains as x has",
        ),
        ({"position": (np.zeros((1, 3)), "kg")}, "units of position = '1 kg': a length is needed"),
        ({"position": (np.zeros(3), "m")}, r"position has the shape \(3,\)"),
        ({"position": (np.zeros((2, 2)), "m")}, r"position has the shape \(2, 2\)"),
        ({"position": (np.zeros((0, 4, 3)), "m")}, "no snapshot yet"),
        (
            {"position": ([[0, 0, 0]], "m"), "velocity": (np.zeros((2, 3)), None)},
            r"velocity has the shape \(2, 3\); allowed: \(1, 3\)",
        ),
        ({"position": ([[0, 0, np.nan]], "m")}, "position of grain 0"),
    ],
)
def test_bad_netcdf_is_refused(tmp_path, variables, message):
    file = generic(tmp_path / "a.nc", **variables)
    with pytest.raises(DustError, match=r"sample\.file = .*" + message):
        load(file=file)


@pytest.mark.parametrize(
    "group, name, value, message",
    [
        ("contacts", "grain_j", 99, "contacts name grain 99; allowed: 0 to 4"),
        ("contacts", "twist", np.nan, "contacts' twist has not-a-number"),
        (
            "contacts",
            "twist",
            1e30,
            r"contact 1 \(from 0\): twist is 1e\+30; allowed: at most 1000",
        ),
        ("contacts", "grain_j", 2, r"contact 1 \(from 0\): grain 2 with itself"),
        ("contacts", "grain_j", 0, r"contact 1 .*grains 2 and 0, .* apart; allowed: at most 1.5"),
        ("contacts", "pointer_j", 0.5, r"contact 1 .*pointer_j has the length 0.866.*: 1, a unit"),
        ("snapshots", "contact_count", -1, "contact_count of snapshot 1 is -1; allowed: 0 or more"),
        ("snapshots", "contact_count", 99, "it has 3 contacts; allowed: 100"),
        ("contacts", "twist", None, "contacts lack twist"),
    ],
)
def test_bad_contacts_are_refused(tmp_path, group, name, value, message):
    file = write_result(tmp_path / "result.nc")
    with netCDF4.Dataset(file, "a") as data:
        if value is None:
            data[group].renameVariable(name, "other")
        else:
            data[group][name][-1] = value
    with pytest.raises(DustError, match=message):
        load(file=file)


@pytest.mark.parametrize(
    "kind, message",
    [
        ("text", "position contains texts"),
        ("scalar material", r"material has the shape \(\); allowed: \(grain,\)"),
        ("a great many", "1e\\+12 grains need 1e\\+06 GB of memory"),
    ],
)
def test_files_that_hold_no_sample(tmp_path, kind, message):
    """At once: nothing is allocated for what is only declared."""
    file = tmp_path / "a.nc"
    with netCDF4.Dataset(file, "w") as data:
        data.createDimension("grain", 10**12 if kind == "a great many" else 1)
        data.createDimension("xyz", 3)
        chunks = {"chunksizes": (1000, 3)} if kind == "a great many" else {}
        type_ = str if kind == "text" else "f8"
        x = data.createVariable("position", type_, ("grain", "xyz"), **chunks)
        if kind == "text":
            x[:] = np.array([["a", "b", "c"]], dtype=object)
        elif kind == "scalar material":
            x[:] = 0.0
            data.createVariable("material", "i4", ())[:] = 0
    with pytest.raises(DustError, match=message):
        load(file=file)


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
def pressed_result(tmp_path_factory):
    """A cake that is pressed, then held: snapshots at the start, and after each stage."""
    return execute(from_yaml(CAKE), tmp_path_factory.mktemp("pressed") / "run")


def onward(pressed_result, boundary=None, **sample):
    """The scene that goes on with a pressed cake, its walls at rest."""
    data = yaml.safe_load(CAKE)
    del data["stages"]
    data["sample"] = {"kind": "explicit", "file": str(pressed_result), **sample}
    return Scene.from_dict(
        data | {"boundary": boundary or {"kind": "box"}, "stop": {"steps": 1000}}
    )


def pressures(directory):
    """Time [s] and pressure on the top wall [Pa] of all records."""
    with open_run(directory) as run:
        return run.series.time.values, run.series.pressure.values[:, TOP]


def test_a_pressed_cake_goes_on_under_its_load(pressed_result, tmp_path):
    """The run that is cut in two and goes on with all that can be kept is the run that is not:
    the crystal rings on under its walls in the same way."""
    messages = []
    scene = onward(pressed_result, snapshot=2, keep=["walls", "box", "time"])
    resumed = execute(scene, tmp_path / "run", log=messages.append)
    assert not [text for text in messages if "impact speed" not in text]  # walls are fast here
    with open_run(pressed_result) as run:
        frame = read_frame(run, 2)
        forces = run.contacts(2, "wall_contacts")
    load = forces.normal_force.values[forces.wall.values == TOP].sum() / np.prod(frame.edges[:2])
    time, pressure = pressures(resumed)
    end, uncut = (values[-1] for values in pressures(pressed_result))
    assert load > 5e4 and time[0] == frame.time
    # the damping of half a step before the snapshot is not part of what is kept
    assert pressure[0] == pytest.approx(load, rel=1e-4)
    assert time[-1] == pytest.approx(end, rel=1e-12)
    assert pressure[-1] == pytest.approx(uncut, rel=1e-4) and uncut > load
    with open_run(resumed) as run:
        assert read_frame(run, 0).cell == pytest.approx(frame.cell, rel=1e-12)


def test_what_is_left_behind_is_said(pressed_result, tmp_path):
    sample = make(onward(pressed_result, snapshot=2))
    (remark,) = sample.info["remarks"]
    assert "contacts with walls and the load that they carry; the positions of its walls" in remark
    assert "(to keep them: sample.keep: [walls, box])" in remark
    sample = make(onward(pressed_result, snapshot=2, keep=["box"]))
    (remark,) = sample.info["remarks"]
    assert "positions of its walls" not in remark and "[walls]" in remark
    sim = build(onward(pressed_result, snapshot=2, keep=["box"]), sample)
    with open_run(pressed_result) as run:
        room = read_frame(run, 2).cell.ravel() * 1e6
    np.testing.assert_allclose(sim.domain.box.planes(0.0), room, rtol=1e-12)
    open_top = {"kind": "box", "omit": ["top"]}
    sample = make(onward(pressed_result, open_top, snapshot=2, keep=["walls"]))
    assert sample.info["remarks"][-1].endswith("contacts with top are dropped: no such walls here")
    assert not (sample.wall_contacts["wall"] == TOP).any()
    assert (sample.wall_contacts["wall"] == BOTTOM).any()


def test_snapshots_and_fragments(pressed_result, tmp_path):
    with open_run(pressed_result) as run:
        first = read_frame(run, 0)
    np.testing.assert_array_equal(
        make(onward(pressed_result, snapshot=0)).positions, first.position
    )
    file = tmp_path / "result.nc"
    file.write_bytes((pressed_result / "result.nc").read_bytes())
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
    """A chain of three about a face, in a cell of 10, by its contacts and not the distances."""
    x = np.array([[9.4, 0, 0], [0.4, 0, 0], [1.4, 0, 0], [5.0, 0, 0]]) * 1e-6
    members, _, number = extract_fragment(
        Sample.at_rest(x),
        None,
        "largest",
        pairs=np.array([[0, 1], [1, 2]]),
        nearest=partial(nearest_image, period=np.array([1e-5, np.inf, np.inf])),
        masses=np.ones(4),
        origin="here",
    )
    assert number == 2
    np.testing.assert_allclose(members.positions[:, 0], [9.4e-6, 10.4e-6, 11.4e-6], rtol=1e-12)


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
def test_what_cannot_be_taken_is_refused(pressed_result, sample, boundary, message):
    with pytest.raises(DustError, match=message):
        make(onward(pressed_result, boundary, **sample))


def test_keys_of_another_run_need_one(tmp_path, pressed_result):
    (tmp_path / "a.csv").write_text("x,y,z\n0,0,0\n")
    with pytest.raises(DustError, match="such a file has no snapshots"):
        make(onward(tmp_path / "a.csv", snapshot=2))
    with pytest.raises(DustError, match="has no walls and no cell"):
        make(onward(tmp_path / "a.csv", keep=["walls"]))
    data = onward(tmp_path)._input_data | {
        "sample": {"kind": "explicit", "positions": [["0 m"] * 3], "keep": ["box"]}
    }
    with pytest.raises(DustError, match="keep = .*: it is allowed only together with file"):
        Scene.from_dict(data)
    file = tmp_path / "result.nc"
    file.write_bytes((pressed_result / "result.nc").read_bytes())
    with netCDF4.Dataset(file, "a") as data:
        data.delncattr(DIGEST)
        data["wall_contacts"]["wall"][-1] = 7
    remarks = make(onward(file, keep=["walls"])).info["remarks"]
    assert any("surface 1 is dropped: no such walls here" in text for text in remarks)
    with netCDF4.Dataset(file, "a") as data:
        data["wall_contacts"]["wall"][-1] = -1
    with pytest.raises(DustError, match="names wall -1; allowed: 0 or more"):
        make(onward(file, keep=["walls"]))


def test_a_sphere_of_a_run(pressed_result):
    of = {"kind": "explicit", "file": str(pressed_result)}
    body = make(
        onward(pressed_result).with_value("sample", {"kind": "cutout", "of": of, "grains": 7})
    )
    assert len(body) == 7 and body.wall_contacts is None and len(body.contacts["i"]) == 6
    assert body.info["cut_from"] == 27 and body.info["shape"] == "sphere"
    assert not body.info.get("remarks") and not body.velocities.any()
    with pytest.raises(DustError, match="kind: cutout, of: {kind: explicit"):
        onward(pressed_result, grains=8, seed=3)
