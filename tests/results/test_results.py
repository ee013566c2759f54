"""The result file: what is appended is read back, and a run goes on with it."""

import os

import netCDF4
import numpy as np
import pytest
import synthetic
import xarray as xr
from program import python
from records import GRAINS, check, fill

from dusttaichi.errors import DustError
from dusttaichi.grains.variables import VARIABLES
from dusttaichi.physics.contact.numbers import CHANNELS
from dusttaichi.physics.geometry import WALLS
from dusttaichi.results import Writer, provenance, select


def test_round_trip_through_xarray(tmp_path):
    path = tmp_path / "run" / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill(writer, 0, 25)
        assert writer.counts()["series"] == 25
        writer.set_status("finished: time reached")
    assert check(path) == 25
    assert sorted(os.listdir(path.parent)) == ["result.nc"]  # no lock, no working copy
    series = xr.open_dataset(path)
    assert list(series.wall.values) == list(WALLS)
    assert list(series.channel.values) == list(CHANNELS)
    assert series.time.attrs["units"] == "s" and series.sizes["time"] == 25
    assert series.attrs["status"] == "finished: time reached"
    assert series.attrs["grains"] == GRAINS and series.attrs["seed"] == 1
    assert float(series.loss.sel(channel="rolling", time=24)) == 24
    frame = xr.open_datatree(path)["snapshots"].isel(snapshot=-1)
    assert float(frame.snapshot_time) == 20 and frame.position.shape == (GRAINS, 3)


def test_every_variable_has_units_and_a_name(tmp_path):
    features = frozenset().union(*(variable.needs for variable in VARIABLES.values()))
    optional = [v.name for v in VARIABLES.values() if "requested" in v.needs]
    synthetic.writer(tmp_path / "result.nc", features=features, asked=optional).close()
    with netCDF4.Dataset(tmp_path / "result.nc") as file:
        for key in VARIABLES:
            assert file[key].units and file[key].long_name


def test_an_open_scene_has_no_walls(tmp_path):
    keys = [v.key for v in select(VARIABLES.values(), {"snapshots", "contacts"})]
    assert "pressure" not in keys and "height" not in keys and "wall_contacts/foot" not in keys
    features = {"snapshots", "contacts"}
    with synthetic.writer(tmp_path / "result.nc", 2, features=features) as writer:
        writer.append("series", synthetic.series_record(3, features))
        with pytest.raises(ValueError, match="series takes"):
            writer.append("series", synthetic.series_record(3))
    with xr.open_datatree(tmp_path / "result.nc") as tree:
        assert "wall" not in tree.sizes and set(tree.children) == {"snapshots", "contacts"}


def test_wrong_records_are_refused(tmp_path):
    with synthetic.writer(tmp_path / "result.nc", GRAINS) as writer:
        record = synthetic.series_record(0)
        with pytest.raises(ValueError, match="shape"):
            writer.append("series", record | {"pressure": np.zeros(5)})
        with pytest.raises(ValueError, match="number of rows"):
            rows = synthetic.snapshot_records(0, GRAINS, 3)["contacts"]
            writer.append("contacts", rows | {"twist": np.zeros(4)})
        writer.append("contacts", rows)
        with pytest.raises(ValueError, match="contact_count 0"):
            writer.flush()
        writer.append("snapshots", synthetic.snapshot_records(0, GRAINS, 3, 0)["snapshots"])


def test_blocks_of_records_equal_single_ones(tmp_path):
    records = [synthetic.series_record(i) for i in range(6)]
    block = {k: np.array([r[k] for r in records]) for k in records[0]}
    for name, pieces in (("a", records), ("b", [block])):
        with synthetic.writer(tmp_path / name / "result.nc") as writer:
            for piece in pieces:
                writer.append("series", piece)
    one, other = (xr.open_dataset(tmp_path / n / "result.nc") for n in "ab")
    xr.testing.assert_equal(one, other)


def test_resume_drops_what_is_past_the_checkpoint(tmp_path):
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill(writer, 0, 21)
        counts = writer.counts()
        fill(writer, 21, 58, rows=1)  # other contacts than those that will be written again
    with Writer.resume(path, counts) as writer:
        assert xr.open_dataset(path).sizes["time"] == 58  # kept until there is something better
        assert writer.counts() == counts
        fill(writer, 21, 40)
    assert check(path) == 40
    with xr.open_dataset(path) as series:
        assert series.attrs["history"].count("resumed") == 1
        assert series.attrs["scene_given"] == "name: test\n"
    with pytest.raises(DustError, match="fewer records"):
        Writer.resume(path, counts | {"series": 41})
    with pytest.raises(DustError, match="no result"):
        Writer.resume(tmp_path / "other.nc", counts)
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(DustError, match="is damaged"):
        Writer.resume(path, counts)


def test_existing_results_are_kept_unless_forced(tmp_path):
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill(writer, 0, 5)
    with pytest.raises(DustError, match="--force"):
        synthetic.writer(path, GRAINS)
    assert check(path) == 5
    synthetic.writer(path, GRAINS, force=True).close()
    assert check(path) == 0


def test_provenance_names_the_machine():
    attrs = provenance("a", "b", seed=3)
    assert attrs["scene_given"] == "a" and attrs["seed"] == 3
    assert attrs["taichi_version"] and attrs["cpu"] and attrs["platform"]


def test_arrays_of_dask_and_pint_are_those_of_xarray():
    """A result is opened without them; an array of theirs is known as soon as they are imported."""
    code = (
        "import sys, xarray as xr, numpy as np, dusttaichi.results.reading\n"
        "data = xr.Dataset({'x': ('n', np.arange(4.0))})\n"
        "assert float((2 * data.load()).x.sum()) == 12 and 'dask.array' not in sys.modules\n"
        "import dask.array, pint\n"
        "lazy = 2 * data.chunk(n=2)\n"
        "assert lazy.x.chunks == ((2, 2),) and isinstance(lazy.load().x.values, np.ndarray)\n"
        "own = xr.Variable('n', pint.UnitRegistry().Quantity(np.ones(2), 'm'))\n"
        "assert (own + own).to_numpy().tolist() == [2.0, 2.0]\n"
    )
    python("-c", code, check=True)
