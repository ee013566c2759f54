"""`dust bench`: its numbers are of the scene that was timed, its text says what they are."""

import pytest
from scenes import CONFIGS

from dusttaichi.compute import processor
from dusttaichi.errors import DustError
from dusttaichi.studies import bench
from dusttaichi.studies.workers import Answer


class Here:
    """A Worker that answers in this process, where kernels have been compiled already."""

    def __init__(self, task, *, kernels):
        assert task == "dusttaichi.studies.bench:answer" and kernels is None

    def ask(self, seconds=None, **request):
        assert seconds is None  # which would be its patience
        return Answer(0, found=bench.answer(None, **request))

    def close(self):
        bench._state.clear()


def test_a_scene_is_timed(monkeypatch):
    monkeypatch.setattr(bench, "usable_cores", lambda: 1)
    monkeypatch.setattr(bench, "Worker", Here)
    (one,) = bench.main([CONFIGS / "smoke.yaml"], rounds=2, seconds=0.01)
    assert (one.size, one.threads, one.speed_up) == (60, 1, 1.0)
    assert 30 < one.contacts < 180 and one.seconds > 0.0 and one.spread >= 0.0
    assert 0.0 < abs(one.residual) < bench.LEDGER


def _timing(**changes):
    own = {"scene": "a", "size": 100, "contacts": 80, "threads": 1, "seconds": 4e-6}
    return bench.Timing(**{**own, "speed_up": 1.0, "spread": 1.0, "residual": 3e-5, **changes})


def test_text(monkeypatch):
    monkeypatch.setattr(bench, "machine", lambda: "a machine; vectors of 256 bits")
    monkeypatch.setattr(processor, "warning", lambda: None)
    rows = [
        _timing(),
        _timing(threads=2, seconds=2e-6, speed_up=2.0),
        _timing(scene="b", contacts=None),
    ]
    lines = bench.text(rows).splitlines()
    assert lines == [
        "a machine; vectors of 256 bits",
        "",
        "a: 100 particles, 80 contacts",
        "  energy ledger open by 0.003 %",
        "  1 thread     250,000 steps/s     50.0 ns per contact and step",
        "  2 threads    500,000 steps/s     25.0 ns per contact and step   2.00 times one thread",
        "",
        "b: 100 particles",
        "  energy ledger open by 0.003 %",
        "  1 thread     250,000 steps/s     40.0 ns per particle and step",
    ]
    assert "differ by up to 40 %" in bench.text([*rows, _timing(spread=40.0)])
    assert "open by 2 %: WRONG RESULTS" in bench.text([*rows, _timing(residual=-0.02)])
    monkeypatch.setattr(processor, "warning", lambda: "narrow vectors")
    assert bench.text(rows).endswith("narrow vectors")


def test_a_process_that_fails_is_an_error():
    with bench.Timed("dusttaichi.studies.bench:answer") as process:
        with pytest.raises(DustError, match="process of the benchmark ended.*no_such_command"):
            process.ask("no_such_command")
