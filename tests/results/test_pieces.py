"""Large results: parts that are read as one and joined, files in memory to work on."""

import os
import shutil

import pytest
import synthetic
import xarray as xr
from records import GRAINS, check, fill

from dusttaichi.errors import DustError
from dusttaichi.results import Writer, files, pieces
from dusttaichi.results import writer as writing

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
    monkeypatch.setattr(pieces, "join", lambda path, lock: pieces._put_together(path))


def test_a_large_result_is_written_in_parts_and_read_as_one(tmp_path, monkeypatch, joined_here):
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


def test_work_files_that_kills_have_left_in_memory_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MEMORY", tmp_path)
    old, new = tmp_path / f"{files.WORK}old", tmp_path / f"{files.WORK}new"
    for path in (old, new):
        path.touch()
    os.utime(old, (0, 0))
    files._remove_forgotten.cache_clear()
    with files.WorkFile(tmp_path / "result.nc", 10):
        assert not old.exists() and new.exists()


def test_a_part_of_another_result_is_not_read(tmp_path, monkeypatch, joined_here):
    monkeypatch.setattr(writing, "PIECE", 100_000)
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill_parts(writer)
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
        fill_parts(writer)
        (tmp_path / ".result.nc.tmp").mkdir()  # where the joined file is to be made
        with pytest.raises(DustError, match="could not be joined.*Nothing is lost.*--resume"):
            writer.join()
        assert check(path) == 100
        (tmp_path / ".result.nc.tmp").rmdir()
        writer.join()
    assert check(path) == 100 and not files.parts_folder(path).exists()
