"""Checkpoints: the same bits, whole at any moment; who may write into a directory."""

import errno
import os
import re
import shutil

import numpy as np
import pytest
import synthetic
from records import GRAINS, fill

from dusttaichi.errors import DustError
from dusttaichi.results import Writer, files
from dusttaichi.run import checkpoint

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
    with files.RunLock(tmp_path) as lock:
        synthetic.writer(path, GRAINS, force=True, lock=lock).close()
        with pytest.raises(DustError, match="Another run"):
            files.RunLock(tmp_path)
    # a lock that is deleted by hand still holds
    with files.RunLock(tmp_path):
        (tmp_path / ".lock").unlink()
        for _ in range(2):
            with pytest.raises(DustError, match="Another run is writing"):
                files.RunLock(tmp_path)
    files.RunLock(tmp_path).release()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("call", ["ftruncate", "pwrite"])
def test_a_lock_that_cannot_be_written(tmp_path, monkeypatch, call):
    def fail(*_):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(files.os, call, fail)
    with pytest.raises(DustError, match="Cannot write in .*Input/output error"):
        files.RunLock(tmp_path)
    monkeypatch.undo()
    files.RunLock(tmp_path).release()


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
    ("code", "said"),
    [
        (errno.EROFS, "the disk of .* is read-only"),
        (errno.EACCES, "no permission to write in"),
        (errno.ENOSPC, r"the disk is full \(.* MB free"),
        (errno.ENOENT, "does not exist"),
    ],
)
def test_why_a_place_cannot_be_written(tmp_path, code, said):
    """Also where the folder could not be made for that reason."""
    missing = tmp_path / "none" / "result.nc"
    path = tmp_path / "result.nc" if code == errno.ENOSPC else missing
    assert re.search(said, files.explain(OSError(code, "words of the system"), path))
