"""Grains given one by one: lists, CSV and NetCDF files, the last frames of other runs, and what is
refused of them. Texts of other programs: test_formats."""

import netCDF4
import numpy as np
import pytest
from bodies import PLAIN, R, made

from dusttaichi.errors import DustError
from dusttaichi.scene import Scene

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
    return made("explicit", touch_within=0, **keys)


def written(quantity):
    return [[f"{value!r} {UNITS[quantity]}" for value in row] for row in STATE[quantity].tolist()]


def assert_state(sample, rtol=0.0):
    for values, name in zip(
        (sample.positions, sample.velocities, sample.spins), STATE, strict=True
    ):
        assert values.dtype == np.float64
        np.testing.assert_allclose(values, STATE[name], rtol=rtol, atol=0)


def write_csv(path, header, rows):
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def test_positions_from_the_yaml():
    places = written("position")
    assert_state(load(positions=places, velocities=written("velocity"), spins=written("spin")))
    still = load(positions=places)
    assert not still.velocities.any() and not still.spins.any() and still.contacts is None
    assert len(load(positions=places[:1])) == 1
    with pytest.raises(DustError, match=r"sample\.positions: grains 0 and 1"):
        load(positions=[["0 m"] * 3, ["0.6 um", "0 m", "0 m"]])


def test_csv(tmp_path):
    columns = np.hstack(list(STATE.values())).tolist()
    names = [name for parts in NAMES.values() for name in parts]
    assert_state(load(file=write_csv(tmp_path / "a.csv", ",".join(names), columns)))
    reordered = [row[::-1] for row in columns]
    file = write_csv(tmp_path / "b.csv", "# grains\n" + " , ".join(names[::-1]), reordered)
    assert_state(load(file=file))
    only = write_csv(tmp_path / "c.csv", "x,y,z", STATE["position"].tolist())
    assert np.array_equal(load(file=only).positions, STATE["position"])


def test_csv_with_units(tmp_path):
    micro = np.hstack([STATE["position"] * 1e6, STATE["velocity"] * 100]).tolist()
    heading = write_csv(
        tmp_path / "a.csv", "x [um],y [um],z [um],vx [cm/s],vy [cm/s],vz [cm/s]", micro
    )
    option = write_csv(tmp_path / "b.csv", "x,y,z,vx [cm/s],vy [cm/s],vz [cm/s]", micro)
    for sample in (load(file=heading), load(file=option, units="um")):
        # Two products of rounded numbers.
        np.testing.assert_allclose(sample.positions, STATE["position"], rtol=1e-15)
        np.testing.assert_allclose(sample.velocities, STATE["velocity"], rtol=1e-15)


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
    data = PLAIN.given | {"sample": {"kind": "explicit", "file": "x" * 5000}}
    with pytest.raises(DustError, match="it cannot be a file: File name too long"):
        Scene.from_dict(data, tmp_path, check_files=check_files)


# -- NetCDF and other runs ------------------------------------------------------------------------


POINTERS = [[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [0.0, -0.6, 0.8]]  # of three contacts


def write_result(path, frames=2, contacts=True, counts=(1, 2)):
    """The layout of our own results; the last frame is STATE."""
    with netCDF4.Dataset(path, "w") as data:
        group = data.createGroup("snapshots")
        for name, length in (("snapshot", None), ("grain", N), ("xyz", 3)):
            group.createDimension(name, length)
        for name, values in STATE.items():
            variable = group.createVariable(name, "f8", ("snapshot", "grain", "xyz"))
            variable.units = UNITS[name]
            for frame in range(frames):
                variable[frame] = values if frame == frames - 1 else values + 1.0
        if contacts:
            group.createVariable("contact_count", "i8", ("snapshot",))[:] = counts
            group = data.createGroup("contacts")
            group.createDimension("contact", None)
            group.createDimension("xyz", 3)
            total = sum(counts)
            for name in ("grain_i", "grain_j"):
                group.createVariable(name, "i4", ("contact",))[:] = np.arange(total) % (N - 1) + (
                    name == "grain_j"
                )
            for name in ("pointer_i", "pointer_j"):
                group.createVariable(name, "f8", ("contact", "xyz"))[:] = POINTERS[:total]
            for name in ("twist", "approach"):
                group.createVariable(name, "f8", ("contact",))[:] = np.arange(total) + 0.5
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
    with netCDF4.Dataset(tmp_path / "a.nc", "w", format="NETCDF3_CLASSIC") as data:
        data.createDimension("n", N)
        for quantity, factor, unit in (
            ("position", 1e6, "um"),
            ("velocity", 1.0, "m s-1"),
            ("spin", 1.0, "rad/s"),
        ):
            for k, name in enumerate(NAMES[quantity]):
                variable = data.createVariable(name, "f8", ("n",))
                variable.units = unit
                variable[:] = STATE[quantity][:, k] * factor
    assert_state(load(file=tmp_path / "a.nc"), rtol=1e-15)  # metres to micrometres and back
    with netCDF4.Dataset(tmp_path / "b.nc", "w") as data:
        data.createDimension("n", N)
        data.createDimension("three", 3)
        data.createVariable("position", "f8", ("n", "three"))[:] = STATE["position"]
    assert np.array_equal(load(file=tmp_path / "b.nc").positions, STATE["position"])


def generic(path, **variables):
    with netCDF4.Dataset(path, "w") as data:
        for name, (values, unit) in variables.items():
            values = np.asarray(values, dtype=float)
            dims = []
            for axis, length in enumerate(values.shape):
                dims.append(f"{name}_{axis}")
                data.createDimension(dims[-1], length)
            variable = data.createVariable(name, "f8", dims)
            variable[...] = values
            if unit:
                variable.units = unit
    return path


@pytest.mark.parametrize(
    "variables, message",
    [
        ({"density": (np.zeros(3), None)}, "has the variables density; allowed: position"),
        ({"x": ([0.0], "m"), "y": ([0.0], "m")}, "lacks the variable z"),
        ({"x": ([0.0], "m"), "y": ([0.0], "m"), "z": ([0.0, 1.0], "m")}, "1, 1, 2 grains"),
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
    ],
)
def test_bad_contacts_are_refused(tmp_path, group, name, value, message):
    file = write_result(tmp_path / "result.nc")
    with netCDF4.Dataset(file, "a") as data:
        data[group][name][-1] = value
    with pytest.raises(DustError, match=message):
        load(file=file)


def test_incomplete_contacts_are_refused(tmp_path):
    file = write_result(tmp_path / "result.nc")
    with netCDF4.Dataset(file, "a") as data:
        data["contacts"].renameVariable("twist", "turn")
    with pytest.raises(DustError, match="contacts lack twist"):
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
