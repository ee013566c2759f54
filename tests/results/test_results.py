"""The result file: what is appended is read back, in parts or not, and a run goes on with it.

Checkpoints: the same bits, whole at any moment; who may write into a directory.
"""

import errno
import os
import re
import shutil
import weakref
from dataclasses import replace

import netCDF4
import numpy as np
import pytest
import synthetic
import xarray as xr
from records import GRAINS, check, fill

from dusttaichi.errors import DustError
from dusttaichi.grains.grain_variables import VARIABLES
from dusttaichi.method import ArraysOnRequest
from dusttaichi.physics.contact.effect_numbers import CHANNELS
from dusttaichi.physics.geometry import WALLS
from dusttaichi.results import Writer, files, pieces, provenance, select_variables, waiting
from dusttaichi.results import writer as writing
from dusttaichi.results.run_lock import RunLock
from dusttaichi.running import checkpoint


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
    synthetic.writer(tmp_path / "result.nc", features=features, requested=optional).close()
    with netCDF4.Dataset(tmp_path / "result.nc") as file:
        for key in VARIABLES:
            assert file[key].units and file[key].long_name


def test_an_open_scene_has_no_walls(tmp_path):
    keys = [v.key for v in select_variables(VARIABLES.values(), {"snapshots", "contacts"})]
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
    for name, blocks in (("a", records), ("b", [block])):
        with synthetic.writer(tmp_path / name / "result.nc") as writer:
            for one in blocks:
                writer.append("series", one)
    one, second = (xr.open_dataset(tmp_path / n / "result.nc") for n in "ab")
    xr.testing.assert_equal(one, second)


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


def test_a_resumed_result_marks_the_contact_history(tmp_path, monkeypatch):
    """A sample that is read from it includes the history of a registered law."""
    overlap = replace(VARIABLES["contacts/overlap"], history=True)
    monkeypatch.setattr(synthetic, "VARIABLES", VARIABLES | {overlap.key: overlap})
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill(writer, 0, 3)
        counts = writer.counts()
    with Writer.resume(path, counts) as writer:
        fill(writer, 3, 5)
    with netCDF4.Dataset(path) as file:
        variables = file["contacts"].variables.values()
        assert [v.name for v in variables if "contact_history" in v.ncattrs()] == [overlap.name]


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


# records of the first 150 steps of `fill` with rows=1
FIRST_HALF = {
    "series": 150,
    "profiles": 0,
    "snapshots": 15,
    "contacts": sum(range(1, 150, 10)),
    "wall_contacts": 30,
}


def fill_parts(writer):
    """A hundred records, in two parts."""
    for step in (0, 50):
        fill(writer, step, step + 50)
        writer.flush()


@pytest.fixture
def joined_here(monkeypatch):
    """Parts are joined in this process, not in one of its own."""

    def join(path, lock, background):
        identity = pieces.new_identity()
        pieces._put_together(path, identity)
        return identity

    monkeypatch.setattr(pieces, "join", join)


def test_a_large_result_is_written_in_parts_and_read_as_one(tmp_path, monkeypatch, joined_here):
    """Each flush writes what is new and one piece at most; at the end there is one file."""
    monkeypatch.setattr(writing, "PIECE", 100_000)
    path, written = tmp_path / "result.nc", []
    original = pieces.write_whole

    def write_whole(file, data):
        original(file, data)
        written.append(file.stat().st_size)

    monkeypatch.setattr(pieces, "write_whole", write_whole)
    with synthetic.writer(path, GRAINS) as writer:
        for step in range(0, 300, 60):
            fill(writer, step, step + 60, rows=1)
            writer.flush()
            assert step == 120 or check(path, rows=1) == step + 60  # at any moment
        paths = list(files.parts_folder(path).iterdir())
        # a file of few records is some 800 kB of chunks
        assert len(paths) == 4 and max(written) < 1_000_000
        half = writer.counts()
    # what comes later does not count any more where a run goes on from before
    with Writer.resume(path, {g: n * 4 // 5 for g, n in half.items()} | FIRST_HALF) as writer:
        fill(writer, 150, 160, rows=1)
        writer.flush()
        assert check(path, rows=1) == 160
        fill(writer, 160, 320, rows=1)
        writer.set_status("finished: here")
        writer.join()
        assert check(path, rows=1) == 320 and not files.parts_folder(path).exists()
        with xr.open_datatree(path) as tree:  # one NetCDF file as any other
            assert tree.sizes["time"] == 320 and tree.attrs["status"] == "finished: here"
            assert "starts" not in tree.attrs
        fill(writer, 320, 330, rows=1)
        writer.flush()  # on, after the end
        assert files.parts_folder(path).exists() and check(path, rows=1) == 330
    # where the joined file has more than counts, and in another order of magnitude of rows
    with Writer.resume(path, FIRST_HALF) as writer:
        fill(writer, 150, 151, rows=1)
        writer.join()
    assert check(path, rows=1) == 151


def test_work_files_that_kills_have_left_in_memory_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MEMORY", tmp_path)
    old_folder, new_folder = tmp_path / f"{files.WORK}old", tmp_path / f"{files.WORK}new"
    for path in (old_folder, new_folder):
        path.touch()
    os.utime(old_folder, (0, 0))
    files._remove_forgotten.cache_clear()
    with files.WorkFile(tmp_path / "result.nc", 10):
        assert not old_folder.exists() and new_folder.exists()


def test_a_part_of_another_result_is_not_read(tmp_path, monkeypatch, joined_here):
    monkeypatch.setattr(writing, "PIECE", 100_000)
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill_parts(writer)
    saved_folder = tmp_path / "kept"
    shutil.copytree(files.parts_folder(path), saved_folder)
    with Writer.resume(path, writer.counts()) as writer:
        writer.join()
    shutil.copytree(
        saved_folder, files.parts_folder(path)
    )  # as a kill right before they are removed
    assert check(path) == 100
    with Writer.resume(path, writer.counts()) as writer:
        fill(writer, 100, 120)
    assert check(path) == 120


def test_parts_that_cannot_be_joined_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(writing, "PIECE", 100_000)
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill_parts(writer)
        (tmp_path / ".result.nc.tmp").mkdir()  # where the joined file is to be made
        with pytest.raises(DustError, match="could not be joined.*Nothing is lost.*--resume"):
            writer.join()
        assert check(path) == 100
        (tmp_path / ".result.nc.tmp").rmdir()
        writer.join()
    assert check(path) == 100 and not files.parts_folder(path).exists()


ARRAYS = {
    "position": np.array([[0.1, np.pi, -0.0], [np.nan, np.inf, 5e-324]]),
    "flags": np.array([True, False]),
    "empty": np.zeros((0, 3), dtype=np.int32),
    "step": np.int64(2**60 + 1),
    "transposed": np.arange(6, dtype=np.float32).reshape(2, 3).T,
    "still": np.zeros((1000, 3)),
    "negative zeros": np.full(5, -0.0),
    "zeros of both signs": np.array([0.0, -0.0]),
    "single": np.array([[7.5]]),
    "mostly zeros": np.where(np.arange(3000.0) % 100 == 7, np.arange(3000.0), 0.0).reshape(-1, 3),
    "mostly nan": np.where(np.arange(2000) % 50 == 1, -0.0, np.nan),
    "few equal": np.arange(5000, dtype=np.int32) // 2,
}
META = {"counts": {"series": np.int64(3)}, "dt": 0.1 + 0.2, "scene": "name: ä\n"}


def test_checkpoint_keeps_the_bits(tmp_path):
    path = tmp_path / "checkpoint"
    checkpoint.save(path, ARRAYS, META)
    state = checkpoint.load(path)
    assert list(state.arrays) == list(ARRAYS) and state.note is None
    for name, array in ARRAYS.items():
        read = state.arrays[name]
        assert read.dtype == array.dtype and read.shape == array.shape
        assert read.tobytes() == array.tobytes() and read.flags.writeable
    assert path.stat().st_size < ARRAYS["still"].nbytes, "equal numbers are stored once"
    assert state.meta == {"counts": {"series": 3}, "dt": 0.1 + 0.2, "scene": "name: ä\n"}


def test_a_checkpoint_takes_the_memory_of_one_array(tmp_path):
    alive, most = [], []

    def make():
        array = np.random.default_rng(len(most)).random(1000)
        alive.append(weakref.ref(array))
        most.append(sum(reference() is not None for reference in alive))
        return array

    arrays = ArraysOnRequest(dict.fromkeys("abcd", make))
    checkpoint.save(tmp_path / "checkpoint", arrays, {})
    assert most == [1, 1, 1, 1] and list(checkpoint.load(tmp_path / "checkpoint").arrays) == [
        *"abcd"
    ]


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "gone"])
def test_damaged_checkpoint_falls_back(tmp_path, damage):
    path = tmp_path / "checkpoint"
    for step in (1, 2):
        checkpoint.save(path, ARRAYS | {"step": np.int64(step)}, META)
    raw = bytearray(path.read_bytes())
    raw[len(raw) // 2] ^= 1
    path.write_bytes({"flip": raw, "cut": raw[:-40], "empty": b"", "gone": b""}[damage])
    if damage == "gone":
        path.unlink()
    state = checkpoint.load(path)
    assert state.arrays["step"] == 1 and "checkpoint.previous" in state.note
    (tmp_path / "checkpoint.previous").write_bytes(b"")
    with pytest.raises(DustError, match="No valid checkpoint|no checkpoint"):
        checkpoint.load(path)
    checkpoint.discard(path)
    with pytest.raises(DustError, match="no checkpoint"):
        checkpoint.load(path)


def test_checkpoint_between_its_renames(tmp_path):
    path = tmp_path / "checkpoint"
    for step in (1, 2):
        checkpoint.save(path, {"step": np.int64(step)}, {})
    path.rename(tmp_path / "checkpoint.tmp")
    assert checkpoint.load(path).arrays["step"] == 2
    with pytest.raises(DustError, match="does not exist"):
        checkpoint.save(tmp_path / "nowhere" / "checkpoint", ARRAYS, META)
    with pytest.raises(TypeError, match="meta data"):
        checkpoint.save(tmp_path / "checkpoint", {}, {"x": object()})


def test_second_writer_is_refused(tmp_path):
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS):
        with pytest.raises(DustError, match=f"process {os.getpid()} on "):
            synthetic.writer(path, GRAINS, force=True)
        with pytest.raises(DustError, match="Another run"):
            Writer.resume(path, {})
    with RunLock(tmp_path) as lock:
        synthetic.writer(path, GRAINS, force=True, lock=lock).close()
        with pytest.raises(DustError, match="Another run"):
            RunLock(tmp_path)
    # a lock that is deleted by hand still holds
    with RunLock(tmp_path):
        (tmp_path / ".lock").unlink()
        for _ in range(2):
            with pytest.raises(DustError, match="Another run is writing"):
                RunLock(tmp_path)
    RunLock(tmp_path).release()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("call", ["ftruncate", "pwrite"])
def test_a_lock_that_cannot_be_written(tmp_path, monkeypatch, call):
    def fail(*_):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(files.os, call, fail)
    with pytest.raises(DustError, match="Cannot write in .*Input/output error"):
        RunLock(tmp_path)
    monkeypatch.undo()
    RunLock(tmp_path).release()


def test_vanished_directory(tmp_path):
    path = tmp_path / "run" / "result.nc"
    writer = synthetic.writer(path, GRAINS)
    fill(writer, 0, 3)
    shutil.rmtree(path.parent)
    with pytest.raises(DustError, match="does not exist"):
        writer.flush()
    with pytest.raises(DustError):
        writer.close()
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(DustError, match="Cannot write in"):
        synthetic.writer(tmp_path / "file" / "run" / "result.nc")


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (errno.EROFS, "the disk of .* is read-only"),
        (errno.EACCES, "no permission to write in"),
        (errno.ENOSPC, r"the disk is full \(.* MB free"),
        (errno.ENOENT, "does not exist"),
    ],
)
def test_why_a_place_cannot_be_written(tmp_path, code, message):
    """Also where the folder could not be made for that reason."""
    missing = tmp_path / "none" / "result.nc"
    path = tmp_path / "result.nc" if code == errno.ENOSPC else missing
    assert re.search(message, files.explain(OSError(code, "words of the system"), path))


@pytest.mark.parametrize("named", ["file", "link", "device"])
def test_a_folder_that_is_something_else_is_named(tmp_path, named):
    path = tmp_path / named
    if named == "file":
        path.touch()
    elif named == "link":
        path.symlink_to("nowhere")
    path = files.Path(os.devnull) if named == "device" else path
    endings = {
        "file": "is a file, not a folder",
        "link": "is a link to nowhere, which does not exist",
    }
    for folder in (path, path / "below"):
        with pytest.raises(
            DustError, match=endings.get(named, "is a device or a pipe, not a folder")
        ):
            RunLock(folder)


@pytest.mark.parametrize("suffix", ["", ".previous", None])
def test_advice_after_a_full_disk_follows_the_checkpoints(tmp_path, suffix):
    path, checkpoint_path = tmp_path / files.RESULT, tmp_path / "folder" / files.CHECKPOINT
    path.touch()
    if suffix is not None:
        path.with_name(f"{files.CHECKPOINT}{suffix}").touch()
    text = str(waiting.build_write_error(path, OSError(errno.ENOSPC, "full"), 3, 1e-6))
    onward = "continue" if suffix is not None else "start again"
    assert f"Remove the cause and {onward} with --resume" in text
    with pytest.raises(DustError, match=r"could not be written.*There is none yet: --resume would"):
        checkpoint.write(checkpoint_path, {}, {})
