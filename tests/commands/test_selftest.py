"""`dust selftest` on the CPU: stored states, what is wrong is told, sizes are checked."""

import numpy as np
import pytest

from dusttaichi.commands import app as cli
from dusttaichi.errors import DustError
from dusttaichi.studies.selftest import checks, scenes


def selftest(*words):
    cli.app(["selftest", *words], standalone_mode=False)


def test_the_cpu_passes(capsys, monkeypatch):
    """And a state that is not the stored one does not, by which the exit code is 1."""
    monkeypatch.setattr(checks, "SHORTEST", 1e-4)
    selftest("--sizes", "1e3")
    told = capsys.readouterr().out
    assert told.count("passed") == len(scenes.CHANGES) and "WRONG" not in told
    assert told.startswith("cpu: ") and "GiB of memory" in told and "ns per contact" in told
    monkeypatch.setattr(scenes, "CHANGES", {"box": scenes.CHANGES["box"]})
    moved = scenes.stored()["box"] * (1.0 + 1e-6)
    monkeypatch.setattr(scenes, "stored", lambda: {"box": moved})
    with pytest.raises(SystemExit) as end:
        selftest("--no-speed")
    assert end.value.code == 1
    told = capsys.readouterr().out
    assert "WRONG" in told and "do not use it" in told


def test_what_must_hold():
    fine = {"difference": 0.0, "tolerance": 1e-9, "residual": 1e-4, "searches": 3}
    assert checks.Outcome("a", same_bits=True, **fine).passed
    assert not checks.Outcome("a", same_bits=False, **fine).passed
    for name, value in (("difference", 1e-8), ("residual", -0.02), ("searches", 1)):
        assert not checks.Outcome("a", same_bits=True, **{**fine, name: value}).passed


def test_stored_states_are_of_the_scenes():
    assert scenes.stored().keys() == scenes.CHANGES.keys()
    for name, state in scenes.stored().items():
        assert state.shape == (3, scenes.STORED, 3) and np.isfinite(state).all()
        assert (np.abs(state).max(axis=(1, 2)) > 0.0).all()  # something moves and turns
        assert scenes.difference(state, state) == 0.0
        assert scenes.difference(1.001 * state, state) == pytest.approx(1e-3)
        assert 0.0 < scenes.tolerance(name) <= 1e-5


def test_sizes_at_which_the_cpu_is_faster():
    def speeds(backend, *steps):
        return [checks.Speed(backend, n, 3 * n, t) for n, t in zip((10, 20), steps, strict=True)]

    assert checks.slower_sizes(speeds("cuda", 5.0, 6.0), speeds("cpu", 4.0, 7.0)) == [10]


@pytest.mark.parametrize("sizes", ["many", "1e4,", "10", "1e9", "1000.5"])
def test_sizes_that_cannot_be(sizes):
    with pytest.raises(DustError, match="--sizes .*1e3 to 1e7"):
        selftest("--sizes", sizes)


def test_no_device_is_a_sentence(monkeypatch):
    def nowhere(name):
        raise OSError(name)

    monkeypatch.setattr(checks.ctypes, "CDLL", nowhere)
    with pytest.raises(DustError, match="no CUDA driver.*--backend cpu"):
        checks.describe("cuda")
