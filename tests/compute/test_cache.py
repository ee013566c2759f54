"""Where compiled kernels are kept where there is no home, and none that can be written."""

import os
import tempfile

import pytest
from program import python

from dusttaichi.compute import cache

CODE = """
import dusttaichi, taichi
from dusttaichi.compute import cache
print(cache.cache_folder(), *cache.remarks(), sep="\\n")
"""


@pytest.mark.skipif(os.name != "posix", reason="homes are of POSIX systems")
@pytest.mark.parametrize("home", (None, "", "/dev/null/home"))
def test_taichi_starts_without_a_home(tmp_path, home):
    """As under cron, systemd and in containers: Taichi would end the process."""
    kept = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_CACHE_HOME")}
    kept |= {"TMPDIR": str(tmp_path)} | ({} if home is None else {"HOME": home})
    done = python("-c", CODE, env=kept)
    assert done.returncode == 0, done.stderr
    folder, remark = done.stdout.splitlines()
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
