"""A process that writes files while this one continues; what it could not write is not lost."""

import os
import signal
import time

import numpy as np
import pytest
import synthetic
from records import GRAINS, check, fill

from dusttaichi.compute.background import Background
from dusttaichi.errors import DustError
from dusttaichi.results import files, waiting
from dusttaichi.results import writer as writing
from dusttaichi.running import checkpoint


@pytest.fixture
def background():
    background = Background()
    yield background
    background.close()


def test_calls_are_made_in_another_process_in_their_order(tmp_path, background):
    arrays = {"a": np.arange(2_000_000.0), "transposed": np.arange(6.0).reshape(2, 3).T}
    path = tmp_path / "checkpoint"
    background.start((checkpoint.save, path, arrays, {}), (os.rename, path, tmp_path / "other"))
    assert background.wait() is None and background.done == 2
    stored = checkpoint.load(tmp_path / "other").arrays
    assert all(np.array_equal(stored[name], values) for name, values in arrays.items())


def test_its_errors_are_answers_and_a_killed_process_is_followed_by_another(tmp_path, background):
    background.start((os.rename, tmp_path / "none", tmp_path / "a"), (os.mkdir, tmp_path / "b"))
    assert isinstance(background.wait(), FileNotFoundError) and background.done == 0
    assert not (tmp_path / "b").exists()
    background.start((time.sleep, 60.0))
    os.kill(background._process.pid, signal.SIGKILL)
    assert "has ended" in str(background.wait())
    background.start((os.mkdir, tmp_path / "b"))
    assert background.wait() is None and (tmp_path / "b").exists()


def test_records_that_could_not_be_written_wait_for_the_next_attempt(tmp_path, background):
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        fill(writer, 0, 20)
        writer.begin_flush(background)
        fill(writer, 20, 30)
        assert writer.settle() > 0.0 and writer.counts()["series"] == 30
        assert check(path) == 20
        blocked = path.with_name(".result.nc.tmp")
        blocked.mkdir()
        writer.begin_flush(background)
        fill(writer, 30, 40)
        with pytest.raises(DustError, match=r"up to t = 19 s\); \d+ records since then"):
            writer.settle()
        assert writer.counts()["series"] == 40 and check(path) == 20
        blocked.rmdir()
        writer.begin_flush(background)
        assert writer.flush() == 0.0  # waits
    assert check(path) == 40


@pytest.mark.parametrize("parts", [0, 2])
def test_the_last_records_are_joined_without_a_file_of_their_own(
    tmp_path, background, monkeypatch, parts
):
    monkeypatch.setattr(writing, "PIECE", 50_000)
    path = tmp_path / "result.nc"
    with synthetic.writer(path, GRAINS) as writer:
        for part in range(parts + 1):
            fill(writer, 50 * part, 50 * part + 50)
            if part == 0:
                assert not writer.join_at_once(background)  # it has not begun
            writer.begin_flush(background)
            writer.settle()
        first = 50 * parts + 50
        fill(writer, first, first + 80)
        monkeypatch.setattr(writing, "COPIED", 1)
        assert not writer.join_at_once(background)  # a long time without these records
        monkeypatch.undo()
        monkeypatch.setattr(writing, "PIECE", 50_000)
        writer.set_status("finished")
        assert writer.join_at_once(background)
        assert check(path) == first + 80 and not files.parts_folder(path).exists()
        assert writer.counts()["series"] == first + 80
        fill(writer, first + 80, first + 90)
    assert check(path) == first + 90


@pytest.mark.parametrize("cause", ["a full disk", "a kill"])
def test_records_that_could_not_be_joined_are_not_lost(tmp_path, background, monkeypatch, cause):
    monkeypatch.setattr(writing, "PIECE", 50_000)
    path = tmp_path / "result.nc"
    blocked = path.with_name(".result.nc.tmp")
    with synthetic.writer(path, GRAINS) as writer:
        fill(writer, 0, 50)
        writer.begin_flush(background)
        writer.settle()
        fill(writer, 50, 130)
        if cause == "a kill":
            os.kill(background._process.pid, signal.SIGKILL)
            writer.join(background)
            assert not files.parts_folder(path).exists()
        else:
            blocked.mkdir()
            with pytest.raises(DustError, match="could not be joined.*Nothing is lost"):
                writer.join(background)
            blocked.rmdir()
        assert check(path) == 130
    assert not background.has_begun  # HDF5 may not work any more in a process where it failed


def test_large_blocks_of_records_are_not_copied():
    large = {"a": np.zeros(waiting.MERGED)}
    small = [{"a": np.full(3, float(n))} for n in range(4)]
    merged = waiting.merge([*small[:2], large, *small[2:]])
    assert [len(block["a"]) for block in merged] == [6, waiting.MERGED, 6]
    assert [len(block["a"]) for block in waiting.merge([{"a": np.zeros(0)}, small[0]])] == [3]
    assert merged[1] is large and list(merged[2]["a"]) == [2.0, 2.0, 2.0, 3.0, 3.0, 3.0]
