"""NetCDF files of other programs: names, units and dimensions of their variables."""

import numpy as np
import pytest
import xarray as xr
from scenes import make_scene

from dusttaichi import samples
from dusttaichi.continuum.samples.contents import CONTENTS
from dusttaichi.errors import DustError
from dusttaichi.samples import netcdf
from dusttaichi.samples.formats.text import Source

UM = 1e-6
X = np.array([[0, 0, 0], [1.2, 0, 0], [2.4, 0.1, 0], [3.5, 0.2, 0.3]])  # um
RADII = np.array([0.6, 0.6, 0.6, 0.5])
COLUMNS = {name: ("n", X[:, k]) for k, name in enumerate("xyz")}


def write(path, variables, attrs=None):
    """A file of variables (dims, values, units)."""
    data = {
        name: (dims, values, {"units": unit[0]} if unit else {})
        for name, (dims, values, *unit) in variables.items()
    }
    xr.Dataset(data, attrs=attrs or {}).to_netcdf(path)
    return path


def read(tmp_path, variables, units=UM, **keys):
    path = write(tmp_path / "a.nc", variables)
    return netcdf.read(path, Source("a.nc", [], units, **keys))


@pytest.mark.parametrize(
    "variables",
    [
        COLUMNS | {"r": ("n", RADII)},
        COLUMNS | {"Radius": ("n", RADII)},
        COLUMNS | {"diameter": ("n", 2 * RADII)},
        COLUMNS | {"d": ("n", 2 * RADII)},
        {"position": (("grain", "xyz"), X), "radius": ("grain", RADII)},
        {"position": (("xyz", "grain"), X.T), "r": ("grain", RADII)},
        {"coordinates": (("spatial", "atom"), X.T), "rad": ("atom", RADII)},
        {"pos": (("a", "b"), X), "radii": ("a", RADII)},
        {"pos": (("b", "a"), X.T), "radii": ("a", RADII)},  # three components can be told
        {"x_um": ("n", X[:, 0]), "y_um": ("n", X[:, 1]), "z_um": ("n", X[:, 2])}
        | {"r_nm": ("n", 1e3 * RADII)},
        {k: ("n", 1e-6 * v[1]) for k, v in COLUMNS.items()}
        | {"r": ("n", 1e-6 * RADII)},  # read in metres
    ],
)
def test_positions_and_radii(tmp_path, variables):
    """Four grains, in the unit of the sample, with radii under all names of the lists."""
    largest = max(np.abs(values).max() for _, values in variables.values())
    in_si = largest < 1e-3 or "x_um" in variables
    state = read(tmp_path, variables, units=1.0 if in_si else UM)
    np.testing.assert_allclose(state["position"], UM * X, rtol=1e-12)
    np.testing.assert_allclose(state["radius"], UM * RADII, rtol=1e-12)
    assert state["unread"] == [] and not state["remarks"]


THREE = X[1:]
FRAMES = np.stack([X + 1.0, X])  # of which the last is read


@pytest.mark.parametrize(
    "dims, values, expected",
    [
        (("grain", "xyz"), THREE, THREE),
        (("xyz", "grain"), THREE.T, THREE),
        (("component", "n"), THREE.T, THREE),
        (("n_particles", "axis"), THREE, THREE),
        (("a", "b"), THREE, THREE),  # without names: (grain, xyz)
        (("time", "grain", "xyz"), FRAMES, X),
        (("grain", "xyz", "time"), FRAMES.transpose(1, 2, 0), X),
        (("xyz", "snapshot", "grain"), FRAMES.transpose(2, 0, 1), X),
        (("a", "b", "c"), FRAMES, X),
        (("frame", "atom", "spatial"), FRAMES[:, :3], X[:3]),
        (("frame", "a", "b"), FRAMES[:, :3], X[:3]),
    ],
)
def test_dimensions_by_name(tmp_path, dims, values, expected):
    state = read(tmp_path, {"position": (dims, values)})
    np.testing.assert_allclose(state["position"], UM * expected, rtol=1e-12)


def test_labels_and_remarks_on_dimensions(tmp_path):
    """Labels x, y, z say which dimension has the components; else either of two may be."""
    labels = {"c": ("c", ["x", "y", "z"])}
    state = read(tmp_path, {"position": (("c", "g"), THREE.T), **labels})
    np.testing.assert_allclose(state["position"], UM * THREE, rtol=1e-12)
    assert not state["remarks"]
    state = read(tmp_path, {"position": (("a", "b"), THREE)})
    assert state["remarks"] == ["its position (a, b) is read as (grain, xyz)"]


def test_snapshots_of_columns(tmp_path):
    """Each variable has its own dimensions: radii of all snapshots, one density of all grains."""
    variables = {k: (("n", "time"), np.stack([v[1] + 1, v[1]], axis=1)) for k, v in COLUMNS.items()}
    variables |= {"r": ("n", RADII), "density": ((), 2.65e3), "time": ("time", [0.0, 1.0])}
    state = read(tmp_path, variables, units=1.0)
    np.testing.assert_array_equal(state["position"], X)
    np.testing.assert_array_equal(state["density"], np.full(4, 2.65e3))
    assert state["unread"] == []
    state = read(tmp_path, variables, units=1.0, snapshot=0)
    np.testing.assert_array_equal(state["position"], X + 1)
    with pytest.raises(DustError, match="has 2 snapshots; allowed: 0 to 1, or last"):
        read(tmp_path, variables, snapshot=2)


def test_units_attributes_go_before_those_of_the_scene(tmp_path):
    variables = {k: ("n", 1e3 * v[1], "nm") for k, v in COLUMNS.items()}
    variables |= {"v": (("n", "xyz"), X, "cm/s"), "r": ("n", 1e3 * RADII, "nm")}
    state = read(tmp_path, variables)
    np.testing.assert_allclose(state["position"], UM * X, rtol=1e-12)
    np.testing.assert_allclose(state["velocity"], 1e-2 * X, rtol=1e-12)
    assert "sample.units is not used" in state["remarks"][0]
    with pytest.raises(DustError, match=r"others have none \(r\); allowed: a unit for all"):
        read(tmp_path, variables | {"r": ("n", RADII)})
    # metres beside numbers that are metres
    read(tmp_path, {k: ("n", v[1], "m") for k, v in COLUMNS.items()} | {"r": ("n", RADII)}, 1.0)


def test_what_is_not_read_is_listed(tmp_path):
    """Also masses, whose unit a unit of length does not say."""
    options = {
        "charge": ("n", RADII),
        "temperature": ((), 20.0),
        "mass": ("n", RADII),
        "omega": ("n", RADII),
        "forces": (("n", "xyz"), X),
    }
    state = read(tmp_path, COLUMNS | options)
    assert state["unread"] == ["charge", "forces", "mass", "omega", "temperature"]
    sample = {"kind": "explicit", "file": str(tmp_path / "a.nc"), "units": "um", "touch_within": 0}
    remarks = samples.make(make_scene(sample=sample)).info["remarks"]
    assert remarks[0].endswith("a.nc: charge, forces, mass, omega, temperature")
    run = write(tmp_path / "run.nc", COLUMNS | options, {"dusttaichi_version": "1"})
    with pytest.raises(DustError, match="this run has no snapshots; allowed: one with output.snap"):
        netcdf.read(run, Source("run.nc", []))


def test_ids_and_materials(tmp_path):
    """Grains are in the order of their ids, where no contacts number them; texts may be bytes."""
    names = np.array([b"ice", b"sand", b"sand", b"ice"])
    state = read(tmp_path, COLUMNS | {"id": ("n", [4, 3, 2, 1]), "material": ("n", names)})
    np.testing.assert_allclose(state["position"], UM * X[::-1], rtol=1e-12)
    assert state["material"].tolist() == ["ice", "sand", "sand", "ice"]


@pytest.mark.parametrize(
    "variables, message",
    [
        ({k: ("time", v[1]) for k, v in COLUMNS.items()}, r"x has the shape \(4,\) along time"),
        ({"position": (("grain", "xyz"), X[:, :2])}, r"shape \(4, 2\) along grain, xyz; allowed"),
        (COLUMNS | {"radius": ("m", RADII[:3])}, r"radius has the shape \(3,\); allowed: \(4,\)"),
        (COLUMNS | {"r": ("n", list("abcd"))}, "r contains texts; allowed: numbers"),
        (COLUMNS | {"r": ("n", RADII), "d": ("n", RADII)}, "radius and diameter do not agree"),
        (COLUMNS | {"r": ("n", RADII, "kg")}, "units of r = '1 kg': a length is needed"),
        ({"temperature": ("n", RADII)}, "has the variables temperature; allowed: position"),
    ],
)
def test_files_that_are_refused(tmp_path, variables, message):
    with pytest.raises(DustError, match="a.nc.*" + message):
        read(tmp_path, variables)


def test_particles_of_a_plane(tmp_path):
    """Two components along x and z, masses per metre of depth."""
    variables = {
        "position": (("particle", "xz"), X[:, [0, 2]], "mm"),
        "mass": ("particle", RADII, "g/m"),
        "rho": ("particle", 500 * RADII),
        "r": ("particle", RADII),
    }
    state = read(tmp_path, variables, units=1.0, contents=CONTENTS[2])
    np.testing.assert_allclose(state["position"], 1e-3 * X * [1, 0, 1], rtol=1e-12)
    np.testing.assert_allclose(state["mass"], 1e-3 * RADII, rtol=1e-12)
    np.testing.assert_allclose(state["density"], 500 * RADII, rtol=1e-12)
    assert state["unread"] == ["r"]
