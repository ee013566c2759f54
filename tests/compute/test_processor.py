"""The folder of a processor's kernels, and where it is without a home that can be written."""

import os
import tempfile
import time

import pytest
from program import python

from dusttaichi.compute import cache, compiler, processor

OTHER = ("AMD EPYC 9755", frozenset({"sse2", "avx", "avx512f"}))


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A cache of its own; returns a function that makes this another processor."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return lambda described: monkeypatch.setattr(
        processor, "_describe_processor", lambda: described
    )


def test_processors_and_compilers_share_no_folder(home, monkeypatch):
    folders = [processor.kernel_folder()]
    home(OTHER)
    folders.append(processor.kernel_folder())
    home((OTHER[0], OTHER[1] - {"avx512f"}))
    folders.append(processor.kernel_folder())
    monkeypatch.setattr(compiler.metadata, "version", lambda name: "1.8.0")
    folders.append(processor.kernel_folder())
    assert len(set(folders)) == 4
    assert "amd-epyc-9755" in folders[1].name
    assert folders[3].name.endswith(f"{compiler.name()}-1.8.0")


def test_kernels_of_others_go_when_nobody_uses_them(home):
    oldest_use = time.time() - 1.1 * processor.UNUSED
    root = processor.kernel_folder().parent
    names = {"used": time.time(), "unused": oldest_use}
    for name, used in names.items():
        (root / name).mkdir(parents=True)
        (root / name / "a.ll").write_text("")
        os.utime(root / name, (used, used))
    folder = processor.use_kernel_folder()
    assert {path.name for path in root.iterdir()} == {"used", folder.name}


def test_a_lock_of_a_killed_process_is_removed(home):
    """Taichi would neither read nor write kernels for as long as it exists."""
    folder = processor.use_kernel_folder()
    current_time = time.time()
    for age, name in ((0.0, processor.LOCKS[0]), (2.0 * processor.LOCKED, processor.LOCKS[1])):
        lock = folder / name
        lock.parent.mkdir(exist_ok=True)
        lock.write_text("")
        os.utime(lock, (current_time - age, current_time - age))
    processor.remove_old_locks(folder)
    assert (folder / processor.LOCKS[0]).exists()  # a process is writing
    assert not (folder / processor.LOCKS[1]).exists()
    processor.remove_old_locks(folder / "none")


# -- without a home -------------------------------------------------------------------------------


CODE = """
import dusttaichi, taichi
from dusttaichi.compute import cache
print(cache.cache_folder(), *cache.remarks(), sep="\\n")
"""


@pytest.mark.skipif(os.name != "posix", reason="homes are of POSIX systems")
@pytest.mark.parametrize("home", (None, "", "/dev/null/home"))
def test_taichi_starts_without_a_home(tmp_path, home):
    """As under cron, systemd and in containers: Taichi would end the process."""
    environment = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_CACHE_HOME")}
    environment |= {"TMPDIR": str(tmp_path)} | ({} if home is None else {"HOME": home})
    process = python("-c", CODE, env=environment)
    assert process.returncode == 0, process.stderr
    folder, remark = process.stdout.splitlines()
    assert folder == str(tmp_path / f"dusttaichi-{os.getuid()}" / "dusttaichi")
    assert remark.endswith(f"compiled kernels are stored in {folder}")


@pytest.mark.skipif(os.name != "posix", reason="modes are of POSIX systems")
def test_a_folder_that_others_can_write_is_not_used(tmp_path, monkeypatch):
    """What is kept there is run: nobody else may put a kernel into it."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    planted = tmp_path / f"dusttaichi-{os.getuid()}"
    planted.mkdir()
    planted.chmod(0o777)
    assert cache._private() != planted
    planted.chmod(0o700)
    assert cache._private() == planted
    planted.rmdir()
    planted.symlink_to(tmp_path)
    assert cache._private() != planted
