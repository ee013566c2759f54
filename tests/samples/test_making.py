"""Cost and progress of samples: told before a long one is made, and while it is."""

from types import SimpleNamespace

import numpy as np
import pytest
from bodies import SIZES, scene

from dusttaichi import method
from dusttaichi.commands import progress
from dusttaichi.commands.check import _remark_on_costs
from dusttaichi.continuum.samples.lattice import glass
from dusttaichi.scene import Scene
from dusttaichi.scene.making import listening, report_progress

KINDS = {
    "rbd": {"grains": 3000},
    "pca": {"grains": 100},
    "bcca": {"grains": 64},
    "space_filling": {"grains": 30},
    "random_packing": {"grains": 60, "filling_factor": 0.4},
}


def _heard(make):
    """Shares that are told while something is made."""
    progress = []
    with listening(lambda finished, total: progress.append(finished / total)):
        make()
    return progress


@pytest.mark.parametrize("mixed", [False, True], ids=["equal", "mixed"])
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_tells_its_progress(kind, mixed):
    one = scene(kind=kind, **KINDS[kind], **({"sizes": SIZES} if mixed else {}))
    progress = _heard(lambda: method.make_sample(one))
    assert progress and progress == sorted(progress)
    assert progress[0] >= 0.0


def test_a_glass_tells_its_progress():
    progress = _heard(lambda: glass(np.ones(2), 0.1, 1))
    assert progress == sorted(progress) and 0.0 <= progress[0] < progress[-1] <= 1.0


def test_what_grows_faster_than_n_log_n_is_told_before(capsys):
    """Of a body of a sample too; short samples and those of N log N are not mentioned."""
    packing = {"kind": "random_packing", "grains": 100_000}
    for one, path in (
        (scene(**packing), "sample.kind = random_packing"),
        (scene(kind="cutout", of=packing, grains=100), "sample.of.kind = random_packing"),
        (scene(kind="pca", grains=60_000, sizes=SIZES), "sample.kind = pca"),
        (scene(kind="pca", grains=30_000, impact_parameter=0.5), "sample.kind = pca"),
    ):
        _remark_on_costs(one)
        text = " ".join(capsys.readouterr().err.split())
        assert text.startswith(f"{path}: making this sample takes about ")
        assert "the time grows as N" in text
    for one in (
        scene(**packing | {"grains": 100}),
        scene(kind="rbd", grains=1_000_000),
        scene(kind="space_filling", grains=1_000_000),
    ):
        _remark_on_costs(one)
    assert capsys.readouterr().err == ""


def test_a_scatter_with_a_length_is_told_before():
    block = {"kind": "block", "size": ["1 mm"] * 3}
    block["filling_factor"] = {"sigma": 0.01, "length": "0.1 mm"}
    data = {"name": "scatter", "method": "continuum", "dimension": 3, "material": "dust_g09"}
    data |= {"numerics": {"spacing": "20 um"}, "stop": {"steps": 1}}
    (cost,) = (
        Scene.from_dict(data | {"sample": block})
        .sample.costs(Scene.from_dict(data | {"sample": block}))
        .values()
    )
    assert 10.0 < cost.seconds < 1000.0
    assert not Scene.from_dict(data | {"sample": block | {"filling_factor": 0.15}}).sample.costs(
        Scene.from_dict(data | {"sample": block})
    )


def test_a_bar_is_updated_seldom(monkeypatch):
    """Not for each grain, and not at all in the first second."""
    clock, shown = [0.0], []
    monkeypatch.setattr(progress.real_time, "monotonic", lambda: clock[0])
    bar = SimpleNamespace(show=lambda text, finished, total: shown.append((text, finished, total)))
    with progress.show_sample(bar):
        for grain in range(200):
            clock[0] = 0.01 * grain
            report_progress(grain, 200)
    assert shown[0][:2] == ("sample", 101) and 5 < len(shown) < 12
