"""Results that are damaged, whose writer is killed at any moment, or finds no room."""

import multiprocessing
import os
import random
import shutil
import time

import netCDF4
import numpy as np
import pytest
import synthetic
from records import GRAINS as MANY
from records import check, fill

from dusttaichi.analysis import open_run
from dusttaichi.errors import DustError
from dusttaichi.results import Writer, files, integrity, pieces, writer
from dusttaichi.results import writer as writing
from dusttaichi.results.segments import Segment
from dusttaichi.running import checkpoint

GRAINS = 4


@pytest.fixture(scope="module")
def result_folder(tmp_path_factory):
    """A result that has no records itself, and five parts with forty of the series each."""
    path = tmp_path_factory.mktemp("whole") / "run" / "result.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "PIECE", 1000)
        with synthetic.writer(path, GRAINS, features=set()) as writing:
            for start in range(0, 200, 40):
                for step in range(start, start + 40):
                    writing.append("series", synthetic.series_record(step, set()))
                writing.flush()
    return path.parent


@pytest.fixture
def run(result_folder, tmp_path):
    return shutil.copytree(result_folder, tmp_path / "run")


def parts(run):
    return sorted(files.parts_folder(run / "result.nc").iterdir())


def change(path, at, replacement):
    raw = bytearray(path.read_bytes())
    raw[at : at + len(replacement)] = replacement
    path.write_bytes(raw)


def test_a_damaged_part_is_named_and_can_be_left_out(run):
    change(parts(run)[1], 1000, b"xyz")
    with pytest.raises(DustError, match=r"000002\.bin is damaged.*--force.*can be read"):
        open_run(run)
    for part in parts(run)[1:]:
        part.unlink()
    assert open_run(run).series.sizes["time"] == 40  # as the message says


@pytest.mark.parametrize("form", ["segment", "NetCDF"])
def test_no_damage_gives_other_numbers(run, form):
    """Every byte that matters is missed; zeros among the texts are left to `damage`: HDF5 hangs."""
    if form == "NetCDF":
        pieces._put_together(run / "result.nc", pieces.new_identity())
    expected, rng = open_run(run).series.load(), random.Random(3)
    path = parts(run)[2] if form == "segment" else run / "result.nc"
    raw = path.read_bytes()
    refused, texts = 0, raw.index(b"GCOL") if form == "NetCDF" else len(raw)
    offsets = [*range(0, len(raw), 1997), *(rng.randrange(len(raw)) for _ in range(100))]
    for at in offsets:
        if texts <= at < texts + 4096:
            continue
        path.write_bytes(raw[:at] + bytes([raw[at] ^ 4]) + raw[at + 1 :])
        try:
            series = open_run(run).series.load()
        except DustError as error:
            assert "damaged" in str(error)
            refused += 1
        else:
            assert series.equals(expected)
    assert refused > len(offsets) / 3  # the rest is between the chunks
    for size in (0, 5, 1000, len(raw) // 2):
        path.write_bytes(raw[:size])
        with pytest.raises(DustError, match="damaged|cannot be read"):
            open_run(run)
    path.write_bytes(raw)
    assert open_run(run).series.equals(expected)


def test_a_text_that_changes_is_missed(run):
    """Texts have no checksum in HDF5."""
    path = run / "result.nc"
    shutil.rmtree(files.parts_folder(path))
    raw = path.read_bytes()
    for word in (b"running", b"name: test"):
        change(path, raw.index(word), b"R")
        with pytest.raises(DustError, match="damaged, or another program has changed it"):
            open_run(run)
        path.write_bytes(raw)
    with netCDF4.Dataset(path, "a") as file:
        file.comment = "mine"
    with pytest.raises(DustError, match="another program has changed it.*remove its attribute"):
        open_run(run)
    with netCDF4.Dataset(path, "a") as file:
        file.delncattr(integrity.DIGEST)
    assert open_run(run).attrs["comment"] == "mine"


def test_segments_of_an_earlier_version_are_named(run):
    """They were NetCDF files; without them the records of the run would be fewer."""
    path = run / "result.nc"
    with netCDF4.Dataset(files.parts_folder(path) / "000001.nc", "w") as file:
        file.continues = pieces.identity_of(path)
    with pytest.raises(DustError, match="earlier version of dusttaichi.*--resume"):
        open_run(run)
    with netCDF4.Dataset(files.parts_folder(path) / "000001.nc", "w") as file:
        file.continues = "another"
    assert open_run(run).series.sizes["time"] == 200


@pytest.mark.parametrize("name", ["largest_speed", "step"])
def test_records_that_the_index_has_lost_are_missed(tmp_path, name):
    """HDF5 returns the fill value for them."""
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS, features=set()) as writing:
        writing.append("series", synthetic.series_record(0, set()))
    with netCDF4.Dataset(path, "a") as file:
        fill = integrity.FILL.get(file[name].dtype.str[1:], -(2**63) + 2)
        file.set_auto_maskandscale(False)
        assert np.isnan(fill) or fill == netCDF4.default_fillvals["i8"]
        file[name][0] = fill
    with pytest.raises(DustError, match="damaged"):
        open_run(path)


def test_a_part_that_is_damaged_or_gone_is_named(run):
    parts(run)[1].unlink()
    with pytest.raises(DustError, match=r"missing between .*000001\.bin and .*000003\.bin"):
        open_run(run)
    counts = dict.fromkeys(("series",), 200)
    change(parts(run)[0], 3000, b"xyz")
    with pytest.raises(DustError, match=r"000001\.bin is damaged"):
        Writer.resume(run / "result.nc", counts)
    assert not (run / ".lock").exists()


@pytest.mark.parametrize("digest", ["SHA-256 of the file, at its end", "0" * 64])
def test_files_of_older_versions_are_opened(run, digest):
    path = run / "result.nc"
    shutil.rmtree(files.parts_folder(path))
    with netCDF4.Dataset(path, "a") as file:
        file.digest = digest
    with path.open("ab") as file:
        file.write(b"{...}dustseal")
    assert open_run(run).attrs["digest"] == digest


def test_a_file_is_read_through_once_in_a_process(run, monkeypatch):
    looked, original = [], integrity._read_through
    monkeypatch.setattr(integrity, "_read_through", lambda f, p: looked.append(p) or original(f, p))
    verify = Segment.verify
    monkeypatch.setattr(Segment, "verify", lambda s: looked.append(s._path) or verify(s))
    for _ in range(2):
        open_run(run)
        assert looked == [run / "result.nc", *parts(run)]


def test_a_flush_looks_at_no_other_part(result_folder, tmp_path, monkeypatch):
    """The work of a flush does not grow with what has been written."""
    seen = []
    original = files.list_segments
    monkeypatch.setattr(writer, "PIECE", 1000)
    monkeypatch.setattr(files, "list_segments", lambda path: seen.append(path) or original(path))
    with synthetic.writer(tmp_path / "result.nc", GRAINS, features=set()) as writing:
        for step in range(3):
            writing.append("series", synthetic.series_record(step, set()))
            writing.flush()
            assert len(seen) == 1  # as the file was made


@pytest.fixture(scope="module")
def processes():
    """Processes that fork from one which has imported what they need."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(
        ["dusttaichi.results", "dusttaichi.running.checkpoint", "records"]
    )
    return context


def write_for_ever(path, saved, piece, ready):
    """Do nothing but write, from the last checkpoint on."""
    writing.PIECE = piece
    if os.path.exists(saved):
        state = checkpoint.load(saved)
        step, writer = int(state.arrays["step"]), Writer.resume(path, state.meta["counts"])
    else:
        # killed before its first checkpoint: the run starts anew
        step, writer = 0, synthetic.writer(path, MANY, force=True)
    ready.send(step)
    while True:
        fill(writer, step, step + 7)
        step += 7
        writer.flush()
        checkpoint.save(saved, {"step": step}, {"counts": writer.counts()})
        fill(writer, step, step + 4)  # past the checkpoint
        step += 4
        writer.flush()


@pytest.mark.parametrize("piece", [10**9, pytest.param(100_000, marks=pytest.mark.long)])
def test_kill_at_any_moment(tmp_path, processes, piece):
    """kill -9 of a process that does nothing but write; what it left opens, and goes on."""
    path, saved = tmp_path / "run" / "result.nc", tmp_path / "run" / "checkpoint"
    least, count = 0, 0
    delays, delay = random.sample(range(20, 400), 3), 250  # ms; a flush takes some 10 ms
    while delays or count <= 20:  # until the runs got somewhere
        delay = delays.pop() if delays else 2 * delay  # longer on a busy machine
        heard, ready = processes.Pipe(duplex=False)
        child = processes.Process(target=write_for_ever, args=(path, saved, piece, ready))
        child.start()
        ready.close()
        heard.recv()
        time.sleep(delay / 1e3)
        child.kill()
        child.join()
        if checkpoint.exists(saved):  # else killed before the first one
            least = int(checkpoint.load(saved).arrays["step"])
        count = check(path, least)
    state = checkpoint.load(saved)
    with Writer.resume(path, state.meta["counts"]) as writer:  # the lock died with its holder
        fill(writer, least, least + 30)
    assert check(path) == least + 30


def find_no_room(path, piece, message):
    """Write until a limit is reached, look at what is there, and go on without it."""
    import resource  # not everywhere

    writing.PIECE = piece
    writer = synthetic.writer(path, MANY)
    fill(writer, 0, 30)
    writer.flush()
    limit = os.path.getsize(path) + 300_000
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    fill(writer, 30, LAST)
    messages = []
    for _ in range(2):
        try:
            writer.flush()
        except DustError as error:
            messages.append(str(error))
    kept = check(path)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    writer.close()
    message.send((messages, kept, check(path)))


LAST = 1000  # steps, of 10 MB


@pytest.mark.parametrize("piece", [10**9, 200_000])
def test_no_room_left(tmp_path, processes, piece):
    """A file size limit stands for a full disk: the same calls fail at the same places."""
    heard, sender = processes.Pipe(duplex=False)
    child = processes.Process(target=find_no_room, args=(tmp_path / "result.nc", piece, sender))
    child.start()
    sender.close()
    messages, kept, finally_there = heard.recv()
    child.join()
    assert len(messages) == 2 and all("is readable (up to t = 29 s)" in m for m in messages)
    assert kept == 30 and finally_there == LAST
