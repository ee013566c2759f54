"""Streams that are closed or full, and variables of other work: no traceback, and the right exit
code."""

import os
import subprocess
import sys

import pytest
import synthetic

DUST = f'"{sys.executable}" -m dusttaichi'
posix = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")


def shell(words, **variables):
    environment = {**os.environ, **variables}
    how = {"capture_output": True, "text": True, "env": environment}
    return subprocess.run(["sh", "-c", f"{DUST} {words}"], **how)


@posix
@pytest.mark.parametrize(
    "words, code, said",
    [
        ("schema >&-", 0, ""),
        ("schema >&- 2>&- <&-", 0, ""),
        ("schema >/dev/full", 2, "the output could not be printed: No space left on device"),
        ("--help >/dev/full", 2, "the output could not be printed: No space left on device"),
        ("schema | head -1 >/dev/null", 0, ""),
        ("check nothing.yaml 2>&-", 2, ""),
        ("check nothing.yaml 2>/dev/full", 2, ""),
    ],
)
def test_streams_that_cannot_be_written(words, code, said):
    done = shell(words)
    assert done.returncode == code, done.stderr
    assert said in done.stderr and "Traceback" not in done.stderr
    assert said or not done.stderr


@posix
def test_files_that_may_not_grow(tmp_path):
    """Where even temporary files cannot be made, the words of the system are the message."""
    text = "name: a\nmaterial: silicate_s12\nsample: {kind: chain, grains: 3}\n"
    (tmp_path / "a.yaml").write_text(text + "boundary: {kind: open}\nstop: {steps: 1}\n")
    done = subprocess.run(
        ["sh", "-c", f"ulimit -f 0; exec {DUST} run a.yaml -q"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and done.stderr.startswith("dust: "), done.stderr
    assert "Traceback" not in done.stderr


def test_settings_of_other_work(tmp_path):
    """No window system, no LaTeX, and no warning of a library is in the way of a figure."""
    synthetic.plates_run(tmp_path / "result.nc")
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
    done = shell(
        f"plot {tmp_path}",
        MPLBACKEND="nonsense",
        PYTHONWARNINGS="error",
        MATPLOTLIBRC=str(tmp_path / "matplotlibrc"),
    )
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
    assert (tmp_path / "ledger.png").exists()
