"""Datasets that are read and indexed without dask and pint are those of xarray."""

import shutil

import netCDF4
import numpy as np
import pytest
import synthetic
import xarray as xr

from dusttaichi.results.datasets import (
    add_variables,
    is_plain,
    read_at,
    read_variables,
    take_record,
    take_records,
)
from dusttaichi.results.reading import load_groups, load_variable, open_tree

GROUPS = "series", "profiles", "snapshots"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return synthetic.compression_run(tmp_path_factory.mktemp("run") / "result.nc", points=12)


def test_a_group_is_that_of_xarray(path):
    groups = load_groups(path, *GROUPS)
    with xr.open_datatree(path) as tree:
        for name, group in groups.items():
            expected = (tree if name == "series" else tree[name]).to_dataset(inherit=False)
            assert group.identical(expected) and list(group.coords) == list(expected.coords)
            assert {n: v.dtype for n, v in group.variables.items()} == {
                n: v.dtype for n, v in expected.variables.items()
            }


def test_a_tree_is_that_of_xarray(path, tmp_path):
    """With what dask, and a copy of the file, need: chunks, types and fill values."""
    copy = shutil.copy(path, tmp_path / "result.nc")  # netCDF4 may crash by two handles of a file
    with open_tree(path) as tree, xr.open_datatree(copy, engine="netcdf4") as expected:
        assert tree.identical(expected) and tree.groups == expected.groups
        for group in expected.groups:
            variables = expected[group].to_dataset().variables
            for name, variable in tree[group].to_dataset().variables.items():
                encodings = variable.encoding, variables[name].encoding
                for encoding in encodings:
                    encoding.pop("source", None)
                np.testing.assert_equal(*encodings)
        assert not tree["snapshots/position"].variable._in_memory
        snapshots = tree["snapshots"].to_dataset(inherit=False)
        assert take_record(snapshots, "snapshot", -1).identical(snapshots.isel(snapshot=-1))
        assert read_variables(snapshots).identical(snapshots.load())


def test_added_variables_are_those_of_xarray(path):
    series = load_groups(path, "series")["series"]
    added = {"height": (("time",), 2.0 * series.height.values), "new": ((), np.array(1.0))}
    assert add_variables(series, **added).identical(series.assign(added))


def test_records_are_those_of_xarray(path):
    series = load_groups(path, "series")["series"]
    for number in (0, -1):
        assert take_record(series, "time", number).identical(series.isel(time=number))
    for numbers in ([2, 3, 4], [1, 5], [1, 2, 5], [5, 1], [2, 2], [7], []):
        records = np.array(numbers, dtype=int)
        assert take_records(series, "time", records).identical(series.isel(time=records))


def test_values_at_labels_are_those_of_xarray(path):
    force = load_groups(path, "series")["series"].wall_force
    for labels in ({"wall": "top"}, {"xyz": "x", "wall": "bottom"}):
        np.testing.assert_array_equal(read_at(force, **labels), force.sel(labels).values)
    with pytest.raises(KeyError):
        read_at(force, wall="nowhere")


def test_numbers_that_xarray_decodes_are_not_plain(tmp_path):
    """Files of other programs may scale numbers, mark missing ones or have dates."""
    attributes = {"scaled": ("scale_factor", 2.0), "marked": ("missing_value", -1.0)}
    attributes |= {"dates": ("units", "days since 2000-01-01"), "spans": ("units", "seconds")}
    for name, (key, value) in attributes.items():
        with netCDF4.Dataset(tmp_path / f"{name}.nc", "w") as file:
            file.createDimension("time", 2)
            file.createVariable("a", "f8", ("time",)).units = "m"
            assert is_plain(file)
            file["a"].setncattr(key, value)
            assert not is_plain(file)


def test_a_variable_alone(path):
    steps = load_variable(path, "snapshots", "step")
    np.testing.assert_array_equal(steps, load_groups(path, "snapshots")["snapshots"].step)
    assert not len(load_variable(path, "sphere_contacts", "step"))
