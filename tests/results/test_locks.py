"""Result files that another program has open, and disks without locks: no damage, nothing lost."""

import errno
import os
import shutil
import subprocess
import sys

import pytest
import synthetic
import xarray as xr
from program import python

from dusttaichi.analysis import open_run
from dusttaichi.analysis.foreign import explain_foreign_errors
from dusttaichi.analysis.stored import read_stored
from dusttaichi.compute.processes import HDF5_LOCKS
from dusttaichi.errors import DustError
from dusttaichi.results import Writer, files, integrity, locks, outputs
from dusttaichi.results.reading import open_tree
from dusttaichi.results.run_lock import RunLock
from dusttaichi.running import checkpoint, opening
from dusttaichi.samples.files import read
from dusttaichi.samples.formats.text import Source
from dusttaichi.studies import points

WRITER = """
import netCDF4, sys
file = netCDF4.Dataset(sys.argv[1], "r+")
print("open", flush=True)
sys.stdin.read()
"""
WITHOUT = r"""
#include <errno.h>
#include <stdlib.h>
int flock(int file, int operation) { errno = atoi(getenv("FLOCK_ERRNO")); return -1; }
"""


@pytest.fixture(scope="module")
def finished_run(tmp_path_factory):
    """Directory of a finished result."""
    path = tmp_path_factory.mktemp("run") / "result.nc"
    with synthetic.writer(path, 4, features=set()) as writer:
        for step in range(5):
            writer.append("series", synthetic.series_record(step, set()))
        writer.set_status("finished: 5 steps")
    return path.parent


@pytest.fixture
def in_use(finished_run, tmp_path):
    """The same, while another program has its result open for writing."""
    finished_run = shutil.copytree(finished_run, tmp_path / "run")
    words = [sys.executable, "-c", WRITER, str(finished_run / "result.nc")]
    environment = {k: v for k, v in os.environ.items() if k != HDF5_LOCKS}
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
    ) as caught:
        assert caught.stdout.readline() == b"open\n"
        yield finished_run
        caught.stdin.close()


READERS = {
    "open_run": open_run,
    "tree": lambda run: open_tree(run / "result.nc"),
    "stored": lambda run: read_stored(run / "result.nc", "a sweep", ()),
    "resume": lambda run: Writer.resume(run / "result.nc", {}),
    "resume_without_checkpoint": lambda run: opening._check_replaced(run / "result.nc", None),
    "sample": lambda run: read(run, Source("sample.file", [])),
    "point_of_a_sweep": lambda run: points.Point("p", None, run, {})._read_status(False),
}


@pytest.mark.parametrize("reader", READERS)
def test_a_file_that_another_program_writes_is_in_use(in_use, reader):
    with pytest.raises(DustError, match="result.nc is in use: another program") as refusal:
        READERS[reader](in_use)
    assert not isinstance(refusal.value, integrity.DamagedFile)
    assert "damage" not in str(refusal.value) and "--force" not in str(refusal.value)


def test_what_has_two_causes_is_told_by_the_file(finished_run, tmp_path, monkeypatch):
    """HDF5 has one error for a lock, a fault of the disk and damage; only the last is damage."""
    path = shutil.copy(finished_run / "result.nc", tmp_path)
    fault = OSError(-101, "NetCDF: HDF error")
    assert isinstance(integrity.refusal(fault, path), integrity.DamagedFile)
    assert "no permission" in str(integrity.refusal(PermissionError(13, "denied"), path))
    assert integrity.refusal(OSError(-51, "NetCDF: Unknown file format"), path) is None
    with monkeypatch.context() as patch:
        patch.delenv(HDF5_LOCKS, raising=False)
        patch.setattr(locks, "take", lambda *_, **__: None)
        assert f"{HDF5_LOCKS}=FALSE" in str(integrity.refusal(fault, path))
        patch.setenv(HDF5_LOCKS, "FALSE")
        assert isinstance(integrity.refusal(fault, path), integrity.DamagedFile)
        patch.setenv(HDF5_LOCKS, "TRUE")
        with pytest.raises(DustError, match="no file locks"), explain_foreign_errors([path]):
            raise RuntimeError("NetCDF: HDF error")
    marked = tmp_path / "marked.nc"
    marked.write_bytes(b"\x89HDF\r\n\x1a\n\x03\x08\x08\x01" + bytes(100))
    assert "h5clear" in str(integrity.refusal(fault, marked))


def refuse_to_read(monkeypatch, code, name):
    """Let the system refuse to open files of that name."""
    system = os.open

    def refusing(path, *further_paths, **options):
        if str(path).endswith(name):
            raise OSError(code, os.strerror(code), str(path))
        return system(path, *further_paths, **options)

    monkeypatch.setattr(os, "open", refusing)


@pytest.mark.parametrize("reader", READERS)
def test_a_file_without_permission_is_not_computed_again(finished_run, monkeypatch, reader):
    refuse_to_read(monkeypatch, errno.EACCES, "result.nc")
    with pytest.raises(DustError, match="cannot be read: there is no permission") as refusal:
        READERS[reader](finished_run)
    assert "--force" not in str(refusal.value)


def test_a_checkpoint_that_the_system_refuses_is_not_replaced_by_the_former(tmp_path, monkeypatch):
    path = tmp_path / files.CHECKPOINT
    for _ in range(2):
        checkpoint.save(path, {}, {})
    arrays = checkpoint.stored_arrays
    monkeypatch.setattr(arrays, "open_arrays", lambda file, magic: os.listdir(path))
    with pytest.raises(DustError, match="checkpoint.bin cannot be read: Not a directory"):
        checkpoint.load(path)


@pytest.mark.parametrize("code", [errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS])
def test_a_disk_without_locks(finished_run, tmp_path, monkeypatch, code):
    """A run goes on without: its folder is locked by the name of the process in the lock file."""

    def flock(*_):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(locks.fcntl, "flock", flock)
    with RunLock(tmp_path):
        (tmp_path / ".lock").write_text("1 on elsewhere")
        with pytest.raises(DustError, match="Another run is writing"):
            RunLock(tmp_path)
    assert len(open_run(finished_run).series.time) == 5


@pytest.fixture(scope="module")
def lockless(tmp_path_factory):
    """A library without locks of files, to be loaded before that of the system."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or sys.platform != "linux":
        pytest.skip("needs a C compiler on Linux")
    folder = tmp_path_factory.mktemp("library")
    (folder / "locks.c").write_text(WITHOUT)
    built = [compiler, "-shared", "-fPIC", "-o", folder / "locks.so", folder / "locks.c"]
    subprocess.run(built, check=True)
    return folder / "locks.so"


LIBRARY = """
import sys
from pathlib import Path
from dusttaichi.analysis import open_run
from dusttaichi.errors import DustError
from dusttaichi.results import files
import synthetic
files.MEMORY = Path("nowhere")
for use in (open_run, lambda path: synthetic.writer(path / "new" / "result.nc", 4)):
    try:
        use(Path(sys.argv[1]))
        print("no error")
    except DustError as error:
        print(error)
"""


@pytest.mark.parametrize("code", [errno.ENOLCK, errno.EOPNOTSUPP])
def test_hdf5_on_a_disk_without_locks(lockless, finished_run, tmp_path, code):
    """The command does without; Python says which variable helps, and it does."""
    shutil.copytree(finished_run, tmp_path / "run")
    environment = {k: v for k, v in os.environ.items() if k != HDF5_LOCKS}
    environment |= {"LD_PRELOAD": str(lockless), "FLOCK_ERRNO": str(code)}
    environment["PYTHONPATH"] = os.pathsep.join(map(os.path.dirname, [synthetic.__file__]))
    options = {"env": environment, "cwd": tmp_path}
    process = python("-c", LIBRARY, "run", **options)
    lines = process.stdout.splitlines()
    assert len(lines) == 2, process.stderr
    assert all(f"no file locks. Set the environment variable {HDF5_LOCKS}" in n for n in lines)
    environment[HDF5_LOCKS] = "FALSE"
    assert python("-c", LIBRARY, "run", **options).stdout.split("\n")[:2] == ["no error"] * 2
    del environment[HDF5_LOCKS]
    process = python("-m", "dusttaichi", "compare", "run", "--json", **options)
    assert process.returncode == 0 and '"numbers"' in process.stdout, process.stderr


def test_a_file_is_replaced_also_where_a_viewer_has_it_open(in_use, tmp_path):
    """A table of many runs is written beside the former, which stays as it is for its reader."""
    inode_before = (in_use / "result.nc").stat().st_ino
    with outputs.writing(force=True):
        outputs.write_dataset(in_use / "result.nc", xr.Dataset({"a": 1}), "verdict")
    assert (in_use / "result.nc").stat().st_ino != inode_before
