"""The result file and the checkpoint: nothing on disk is ever half written."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import synthetic
import xarray as xr

from dusttaichi import files
from dusttaichi.errors import DustError
from dusttaichi.grains.variables import VARIABLES
from dusttaichi.names import CHANNELS, WALLS
from dusttaichi.results import Writer, provenance, select
from dusttaichi.results import writer as writing
from dusttaichi.results.reading import open_tree
from dusttaichi.run import checkpoint

GRAINS = 50
HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def fill(writer, first, last, rows=7):
    """Series records first..last-1, and a snapshot with `rows` contacts at every tenth."""
    for step in range(first, last):
        writer.append("series", synthetic.series_record(step))
        if step % 10 == 0:
            for group, record in synthetic.snapshot_records(step, GRAINS, rows + step).items():
                writer.append(group, record)


def check(path, least=0, rows=7):
    """The file holds an unbroken sequence of records as `fill` writes them; their number."""
    with open_tree(path) as tree:
        count = tree.sizes["time"]
        steps = np.arange(count)
        np.testing.assert_array_equal(tree.step, steps)
        np.testing.assert_array_equal(tree.pressure, np.repeat(steps[:, None], 6, 1))
        frames = tree["snapshots"]
        np.testing.assert_array_equal(frames.step, steps[::10])
        np.testing.assert_array_equal(frames.position[:, -1, 0], steps[::10] + 0.1)
        np.testing.assert_array_equal(frames.contact_count, rows + steps[::10])
        owner = np.repeat(steps[::10], rows + steps[::10])
        np.testing.assert_array_equal(tree["contacts"].grain_j, owner)
        np.testing.assert_array_equal(tree["contacts"].pointer_i[:, 2], owner)
        np.testing.assert_array_equal(tree["wall_contacts"].foot[:, 0], np.repeat(steps[::10], 2))
    assert count >= least
    return count


def test_round_trip_through_xarray(tmp_path):
    path = tmp_path / "run" / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill(writer, 0, 25)
        assert writer.pending_bytes > 0
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
    asked = [v.name for v in VARIABLES.values() if "asked" in v.needs]
    synthetic.writer(tmp_path / "result.nc", features=features, asked=asked).close()
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


def test_a_large_result_is_written_in_parts_and_read_as_one(tmp_path, monkeypatch):
    """Each flush writes what is new and one piece at most; at the end there is one file."""
    monkeypatch.setattr(writing, "PIECE", 100_000)
    path, written = tmp_path / "result.nc", []
    real = writing.write_whole

    def write_whole(file, data):
        real(file, data)
        written.append(file.stat().st_size)

    monkeypatch.setattr(writing, "write_whole", write_whole)
    with synthetic.writer(path, GRAINS) as writer:
        for step in range(0, 300, 60):
            fill(writer, step, step + 60, rows=1)
            writer.flush()
            assert step == 120 or check(path, rows=1) == step + 60  # at any moment
        parts = list(files.parts_folder(path).iterdir())
        # a file of few records is some 800 kB of chunks
        assert len(parts) == 4 and max(written) < 1_000_000
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


# records of the first 150 steps of `fill` with rows=1
FIRST_HALF = {
    "series": 150,
    "profiles": 0,
    "snapshots": 15,
    "contacts": sum(range(1, 150, 10)),
    "wall_contacts": 30,
}


def test_work_files_that_kills_have_left_in_memory_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MEMORY", tmp_path)
    old, new = tmp_path / f"{files.WORK}old", tmp_path / f"{files.WORK}new"
    for path in (old, new):
        path.touch()
    os.utime(old, (0, 0))
    files._remove_forgotten.cache_clear()
    with files.WorkFile(tmp_path / "result.nc", 10):
        assert not old.exists() and new.exists()


def test_a_part_of_another_result_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(writing, "PIECE", 100_000)
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        for step in range(0, 100, 50):
            fill(writer, step, step + 50)
            writer.flush()
    kept = tmp_path / "kept"
    shutil.copytree(files.parts_folder(path), kept)
    with Writer.resume(path, writer.counts()) as writer:
        writer.join()
    shutil.copytree(kept, files.parts_folder(path))  # as a kill right before they are removed
    assert check(path) == 100
    with Writer.resume(path, writer.counts()) as writer:
        fill(writer, 100, 120)
    assert check(path) == 120


def test_parts_that_cannot_be_joined_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(writing, "PIECE", 100_000)
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        for step in range(0, 100, 50):
            fill(writer, step, step + 50)
            writer.flush()
        (tmp_path / ".result.nc.tmp").mkdir()  # where the joined file is to be made
        with pytest.raises(DustError, match="could not be joined.*Nothing is lost.*--resume"):
            writer.join()
        assert check(path) == 100
        (tmp_path / ".result.nc.tmp").rmdir()
        writer.join()
    assert check(path) == 100 and not files.parts_folder(path).exists()


def test_wrong_records_are_refused(tmp_path):
    with synthetic.writer(tmp_path / "result.nc", GRAINS) as writer:
        record = synthetic.series_record(0)
        with pytest.raises(ValueError, match="shape"):
            writer.append("series", record | {"pressure": np.zeros(5)})
        with pytest.raises(ValueError, match="number of rows"):
            rows = synthetic.snapshot_records(0, GRAINS, 3)["contacts"]
            writer.append("contacts", rows | {"twist": np.zeros(4)})
        writer.append("contacts", rows)
        with pytest.raises(ValueError, match="contact_count says 0"):
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
    with pytest.raises(DustError, match="not a result"):
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


def test_second_writer_is_refused(tmp_path):
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS):
        with pytest.raises(DustError, match=f"process {os.getpid()} on "):
            synthetic.writer(path, GRAINS, force=True)
        with pytest.raises(DustError, match="Another run"):
            Writer.resume(path, {})
    with files.RunLock(tmp_path) as lock:
        synthetic.writer(path, GRAINS, force=True, lock=lock).close()
        with pytest.raises(DustError, match="Another run"):
            files.RunLock(tmp_path)


@pytest.mark.parametrize("call", ["ftruncate", "pwrite"])
def test_a_lock_that_cannot_be_written(tmp_path, monkeypatch, call):
    def fail(*_):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(files.os, call, fail)
    with pytest.raises(DustError, match="Cannot write in .*Input/output error"):
        files.RunLock(tmp_path)
    monkeypatch.undo()
    files.RunLock(tmp_path).release()


def test_a_lock_that_is_deleted_by_hand_still_holds(tmp_path):
    with files.RunLock(tmp_path):
        (tmp_path / ".lock").unlink()
        for _ in range(2):
            with pytest.raises(DustError, match="Another run is writing"):
                files.RunLock(tmp_path)
    files.RunLock(tmp_path).release()
    assert not list(tmp_path.iterdir())


def run_child(script, *arguments):
    paths = f"import sys; sys.path[:0] = [{str(HERE)!r}, {str(HERE.parent)!r}, {str(ROOT)!r}]\n"
    return subprocess.Popen(
        [sys.executable, "-c", paths + script, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


KILLED = """
import json, os
from dusttaichi.run import checkpoint
from dusttaichi.results import Writer, writer as module
import synthetic, test_results
path, saved, piece = sys.argv[1:]
module.PIECE = int(piece)
if os.path.exists(saved):
    state = checkpoint.load(saved)
    step, writer = int(state.arrays["step"]), Writer.resume(path, state.meta["counts"])
else:
    # killed before its first checkpoint: the run starts anew
    step, writer = 0, synthetic.writer(path, test_results.GRAINS, force=True)
print("ready", step, flush=True)
while True:
    test_results.fill(writer, step, step + 7)
    step += 7
    writer.flush()
    checkpoint.save(saved, {"step": step}, {"counts": writer.counts()})
    test_results.fill(writer, step, step + 4)  # past the checkpoint
    step += 4
    writer.flush()
"""


@pytest.mark.parametrize("piece", [10**9, 100_000])
def test_kill_at_any_moment(tmp_path, piece):
    """kill -9 of a process that does nothing but write; what it left opens, and goes on."""
    path, saved = tmp_path / "run" / "result.nc", tmp_path / "run" / "checkpoint"
    least, count = 0, 0
    delays = random.sample(range(20, 400), 3)  # ms; a flush takes some 10 ms
    while delays or count <= 20:  # until the runs got somewhere
        delay = delays.pop() if delays else 500
        child = run_child(KILLED, path, saved, piece)
        started = child.stdout.readline()
        assert started.startswith("ready"), child.stderr.read()
        time.sleep(delay / 1e3)
        child.send_signal(signal.SIGKILL)
        child.communicate()
        if checkpoint.exists(saved):  # else killed before the first one
            least = int(checkpoint.load(saved).arrays["step"])
        count = check(path, least)
    state = checkpoint.load(saved)
    with Writer.resume(path, state.meta["counts"]) as writer:  # the lock died with its holder
        fill(writer, least, least + 30)
    assert check(path) == least + 30


FULL = """
import json, resource
from dusttaichi.errors import DustError
from dusttaichi.results import writer as module
import os, synthetic, test_results
path, module.PIECE = sys.argv[1], int(float(sys.argv[2]))
writer = synthetic.writer(path, test_results.GRAINS)
test_results.fill(writer, 0, 30)
writer.flush()
limit = os.path.getsize(path) + 300_000
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
test_results.fill(writer, 30, 5000)
messages = []
for _ in range(2):
    try:
        writer.flush()
    except DustError as error:
        messages.append(str(error))
kept = test_results.check(path)
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
writer.close()
print(json.dumps([messages, kept, test_results.check(path)]))
"""


@pytest.mark.parametrize("piece", [1e9, 2e5])
def test_no_room_left(tmp_path, piece):
    """A file size limit stands for a full disk: the same calls fail at the same places."""
    out, problem = run_child(FULL, tmp_path / "result.nc", piece).communicate(timeout=600)
    assert out, problem
    messages, kept, finally_there = json.loads(out)
    assert len(messages) == 2 and all("kept and readable (up to t = 29 s)" in m for m in messages)
    assert kept == 30 and finally_there == 5000


def test_vanished_directory(tmp_path):
    path = tmp_path / "run" / "result.nc"
    writer = synthetic.writer(path, GRAINS)
    fill(writer, 0, 3)
    shutil.rmtree(path.parent)
    with pytest.raises(DustError, match="does not exist"):
        writer.flush()
    with pytest.raises(DustError):
        writer.close()


def test_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(DustError, match="Cannot write in"):
        synthetic.writer(tmp_path / "file" / "run" / "result.nc")


def test_provenance_names_the_machine():
    attrs = provenance("a", "b", seed=3)
    assert attrs["scene_given"] == "a" and attrs["seed"] == 3
    assert attrs["taichi_version"] and attrs["cpu"] and attrs["platform"]


# --- checkpoint -----------------------------------------------------------------------------------

ARRAYS = {
    "position": np.array([[0.1, np.pi, -0.0], [np.nan, np.inf, 5e-324]]),
    "flags": np.array([True, False]),
    "empty": np.zeros((0, 3), dtype=np.int32),
    "step": np.int64(2**60 + 1),
    "transposed": np.arange(6, dtype=np.float32).reshape(2, 3).T,
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
    assert state.meta == {"counts": {"series": 3}, "dt": 0.1 + 0.2, "scene": "name: ä\n"}


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
    with pytest.raises(DustError, match="No whole checkpoint|no checkpoint"):
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


def test_checkpoint_that_cannot_be_written(tmp_path):
    with pytest.raises(DustError, match="does not exist"):
        checkpoint.save(tmp_path / "nowhere" / "checkpoint", ARRAYS, META)
    with pytest.raises(TypeError, match="meta data"):
        checkpoint.save(tmp_path / "checkpoint", {}, {"x": object()})
