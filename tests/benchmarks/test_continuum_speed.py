"""The benchmark of the continuum: its scenes, what a worker answers, its table."""

import pytest

from benchmarks import continuum
from benchmarks.table import Table


@pytest.mark.long
def test_a_worker_times_the_scene_of_the_benchmark():
    scene = continuum.scene_of(2, 900, 1).to_yaml()
    built = continuum.answer(None, do="build", scene=scene)
    assert 900 <= built["particles"] < 1400  # with the bead
    # 18 or 24 of a triangular lattice are within 2.6 spacings, fewer at edges
    assert 14 < built["neighbours"] < 25
    assert built["search"] > 0.0
    found = continuum.answer(None, do="timed", steps=10)
    assert found["used"] > 0.0 and found["real"] > 0.0


def test_the_table_tells_a_size_a_line(tmp_path, capsys):
    numbers = (2, 5836, 17.5, 0.65, 37.2, 5.2, 1.8, 3.0)
    names = [column.name for column in (*continuum.FRONT, *continuum.COLUMNS)]
    row = dict(zip(names, numbers, strict=True))
    blocks = [("Speed", continuum.FRONT, continuum.COLUMNS)]
    table = Table("a machine", [row], blocks, ("a note",))
    table.show()
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "5836" in line]
    assert line.split() == "2 5836 17.5 0.65 37.2 5.20 1.80 3".split()
    table.to_csv(tmp_path / "speed.csv")
    lines = (tmp_path / "speed.csv").read_text().splitlines()
    assert lines[:2] == ["# a machine", "# a note"] and lines[3].startswith("2,5836,17.5,0.65")


def test_scenes_of_three_dimensions_have_all_their_faces():
    scene = continuum.scene_of(3, 20_000, 2)
    assert scene.dimension == 3 and set(scene.boundary.layers) == {
        "bottom", "x_min", "x_max", "y_min", "y_max"
    }  # fmt: skip
    assert scene.numerics.threads == 2
    assert scene.numerics.spacing == pytest.approx(126e-6, rel=0.01)
