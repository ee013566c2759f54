"""Who may write into a directory, and what is said where nobody can."""

import errno
import os
import re
import shutil

import pytest
import synthetic
from records import GRAINS, fill

from dusttaichi.errors import DustError
from dusttaichi.results import Writer, files


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
