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

    def ask(self, request):
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
    monkeypatch.setattr(bench, "vector_bits", lambda: 512)
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


def test_a_process_that_fails_is_an_error():
    with bench.Timed("dusttaichi.studies.bench:answer") as process:
        with pytest.raises(DustError, match="process of the benchmark ended.*no_such_command"):
            process.ask("no_such_command")


@pytest.mark.parametrize("bits, own", [(128, 512), (256, 512), (512, 512), (128, None)])
def test_narrow_vectors_are_remarked(bits, own, monkeypatch):
    monkeypatch.setattr(bench, "machine", lambda: "a machine")
    monkeypatch.setattr(bench, "vector_bits", lambda: bits)
    monkeypatch.setattr(processor, "own_bits", lambda: own)
    said = "vectors of 128 bits where this processor has 512" in bench.text([_timing()])
    assert said == (bits == 128 and own is not None)
    assert not said or bench.text([_timing()]).endswith("chooses a newer one.")


def test_the_width_of_vectors_is_read_from_code():
    bits, own = bench.vector_bits(), processor.own_bits()
    assert bits in (128, 256, 512) and (own is None or bits <= own)
    assert f"vectors of {bits} bits" in bench.machine()
