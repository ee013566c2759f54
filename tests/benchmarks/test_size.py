"""Cost against size: rows of the table, without the commands and runs that take long."""

import pandas as pd
import pytest

from benchmarks import size, size_task
from dusttaichi.errors import DustError


class InProcess:
    """A process of the benchmark, in this one; runs and commands take no time."""

    def __init__(self, task):
        assert task == size.TASK

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def call(self, do, **arguments):
        if do == "sample":
            return size_task.answer(None, do=do, **arguments)
        if do == "command" and arguments["phase"] == "report":
            raise DustError("no report")
        phases = ("build", "steps", "output", "files") if do == "run" else (arguments["phase"],)
        return dict.fromkeys(phases, 1.0) | {"peak": 2e6}


def test_every_phase_and_kind_has_a_row(tmp_path, monkeypatch):
    monkeypatch.setattr(size, "Timed", InProcess)
    monkeypatch.setattr(size, "machine", lambda: "a machine; dusttaichi 0")
    monkeypatch.setattr(size, "CONTINUUM", (500,))
    monkeypatch.setattr(size, "GRAINS", (64, 512))
    monkeypatch.setattr(size, "SHORT", 0.0)
    for name in ("KINDS", "BODIES"):
        selected = dict(list(getattr(size, name).items())[-1:])
        monkeypatch.setattr(size, name, selected)
    file, lines = tmp_path / "size.csv", []
    table = size.main(out=file, log=lines.append)
    rows = pd.DataFrame(table.rows)
    assert list(rows["kind"]) == [
        *("rbd", "rbd", "rbd", "impact"),
        *[size.LIST] * 3,
        *["block, filling factor of a length"] * 3,
    ]
    grains = rows[rows["method"] == "grains"]
    assert list(grains["particles"][3:]) == [64, 500, 512]
    assert (rows["sample"] > 0.0).all() and (rows["sample_peak"] > 1.0).all()
    assert (grains[["check", "build", "steps", "output", "files", "figures"]][:3] == 1.0).all(
        axis=None
    )
    assert grains["exponent"].notna().sum() == 1  # of 500 over 64
    assert "grains, 64, report: no report" in table.notes
    assert len(pd.read_csv(file, comment="#")) == len(rows)
    assert "grains, 64 particles" in lines


@pytest.mark.parametrize("name", [*size.KINDS, *size.BODIES])
def test_scenes_of_all_kinds_are_valid(name):
    method = "grains" if name in size.KINDS else "continuum"
    scene = size._scene_of_kind(method, name, 1024)
    assert scene.method == method
