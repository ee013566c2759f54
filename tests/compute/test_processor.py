"""The vectors of compiled kernels, and the folder of a processor's kernels."""

import json
import os
import time

import pytest
from typer.testing import CliRunner

from dusttaichi import compiler
from dusttaichi.commands.app import app
from dusttaichi.compute import processor

OTHER = ("AMD EPYC 9755", frozenset({"sse2", "avx", "avx512f"}))


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A cache of its own; returns a function that makes this another processor."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    processor.compiled_bits.cache_clear()
    yield lambda described: monkeypatch.setattr(processor, "_described", lambda: described)
    processor.compiled_bits.cache_clear()


def test_the_width_is_read_from_code_and_kept(home, monkeypatch):
    bits = processor.compiled_bits()
    assert bits in (128, 256, 512)
    assert processor.own_bits() is None or bits <= processor.own_bits()
    monkeypatch.setattr(processor, "_found_in_a_child", None)
    processor.compiled_bits.cache_clear()
    assert processor.compiled_bits() == bits


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
    old = time.time() - 1.1 * processor.UNUSED
    root = processor.kernel_folder().parent
    names = {"used": time.time(), "unused": old}
    for name, used in names.items():
        (root / name).mkdir(parents=True)
        for path in (root / name / "a.ll", root / f"{name}.json", root / f"{name}.tcb"):
            path.write_text("")
            os.utime(path, (used, used))
        os.utime(root / name, (used, used))
    own = processor.use_kernel_folder()
    # kernels in the root itself are those of an earlier version, and one of them is in use
    found = {"used", "used.json", "used.tcb", "unused.tcb", own.name}
    assert {path.name for path in root.iterdir()} == found
    os.utime(root / "used.tcb", (old, old))
    processor.use_kernel_folder()
    assert {path.name for path in root.iterdir()} == {"used", "used.json", own.name}


@pytest.mark.parametrize("bits, warns", [(128, True), (256, False), (512, False)])
def test_check_says_where_vectors_are_narrower(bits, warns, home):
    home(OTHER)
    beside = processor.kernel_folder().with_name(f"{processor.kernel_key()}.json")
    beside.parent.mkdir(parents=True)
    beside.write_text(json.dumps({"vector_bits": bits}))
    text = CliRunner().invoke(app, ["check", "smoke"]).output
    assert ("vectors of 128 bits where this processor has 512" in text) == warns
    rows = dict(processor.vector_rows())
    assert rows["processor"] == OTHER[0]
    assert rows["vectors in compiled kernels"].startswith(f"{bits} bits, {bits // 64} doubles")


def test_what_is_not_known_is_said_so(home, monkeypatch):
    home(("something new", frozenset()))
    monkeypatch.setattr(processor.platform, "machine", lambda: "riscv64")
    monkeypatch.setattr(processor, "_found_in_a_child", lambda: None)
    assert processor.warning() is None
    assert dict(processor.vector_rows())["vectors in compiled kernels"] == "unknown"
