"""Costs of the parts of a scene: pairs of scenes, timed in turn; instructions of a process."""

import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from scenes import CONFIGS, KERNELS

from benchmarks import parts, sample
from benchmarks.instructions import Stepper
from dusttaichi.compute import compiler
from dusttaichi.errors import DustError
from dusttaichi.scene import from_yaml, load

SMOKE = CONFIGS / "smoke.yaml"


BENCH = sample.bench_scene(8, threads=1, precision=parts.PRECISION)


def scenes_of(part, scene=BENCH):
    """(scene, arguments of the build) with a part and without it."""
    both = [parts.variant(scene, changes) for changes in (part.with_part, part.without_part)]
    return [(from_yaml(options.pop("scene")), options) for options in both]


@pytest.mark.parametrize("part", parts.PARTS[:-1], ids=lambda part: f"{part.name} {part.instead}")
def test_a_pair_of_scenes_differs_in_one_way(part):
    """In one key of the scene (an effect each where several are off), or in how it is built."""
    (first, built), (two, built_otherwise) = scenes_of(part)
    blocks = [
        key
        for key in ("material", "interaction", "boundary", "push", "numerics")
        if getattr(first, key) != getattr(two, key)
    ]
    written = any(
        getattr(first.output, key) != getattr(two.output, key) for key in ("stress", "variables")
    )
    assert len(blocks) + written + (built != built_otherwise) == 1


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Two parts on sixty grains; the second is one that the build refuses."""
    folder = tmp_path_factory.mktemp("parts")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        patch.setenv(compiler.variable(compiler.KERNEL_FOLDER), KERNELS)
        patch.setattr(parts, "FILLING_FACTOR", 0.15)  # a cake, which needs no kernels to be made
        first = parts.OPEN | parts._off("rolling", "sliding") | parts.NO_DAMPING
        two = first | parts._off("twisting")
        refused = parts.Part("time step", "of a second", {"numerics.time_step": "1 s"}, first)
        rows = (parts.Part("twisting", "off", first, two), refused)
        file = folder / "parts.csv"
        result = parts.main(parts=rows, grains=60, steps=100, rounds=2, out=file)
    return result, pd.read_csv(file, comment="#")


@pytest.mark.long
def test_parts_are_timed_in_pairs_and_shown(table, capsys):
    (row,) = table[0].rows
    assert row["part"] == "twisting" and min(row["has"], row["lacks"], row["ratio"]) > 0
    assert row["scatter"] >= 0 and row["share"] == pytest.approx(100 * (1 - row["ratio"]))
    assert any("refused" in note and "time_step" in note for note in table[0].notes)
    table[0].show()
    text = capsys.readouterr().out
    assert "twisting" in text and "What each part costs" in text and "time step against" in text
    ((_, row),) = table[1].iterrows()
    assert row.part == "twisting" and row.instead == "off"
    assert row["ratio [1]"] == pytest.approx(table[0].rows[0]["ratio"], rel=1e-5)


def test_the_parts_of_a_scene():
    base, scene_parts = parts.parts_of(load(SMOKE))
    pairs = {part.name: [scene for scene, _ in scenes_of(part, base)] for part in scene_parts}
    effects = ["rolling", "sliding", "twisting", "damping"]
    assert list(pairs) == [*effects, "walls", "energy ledger", "noise: the scene with all"]
    for name in effects:
        first, two = pairs[name]
        assert getattr(two.interaction, name) in (None, two.interaction.damping)
        assert (
            first.with_value(f"interaction.{name}", "none" if name == "damping" else "off") == two
        )
    assert pairs["walls"][1].boundary.kind == "open"
    tensile = {part.name for part in parts.parts_of(load(CONFIGS / "tensile_ice.yaml"))[1]}
    assert {"periodic faces and stress", "stress", "damping"} <= tensile
    assert (
        parts.PARTS[-1].with_part == parts.PARTS[-1].without_part
    )  # its ratio is that of the noise
    with pytest.raises(DustError, match="method continuum.*benchmarks continuum"):
        parts.main(load(CONFIGS / "guettler2009/bead.yaml"))


def test_every_part_of_a_scene_has_a_row_or_a_note(monkeypatch, capsys):
    def measured(part, scene, path, **_):
        assert scene.sample.grains == 60 and path is None
        if part.name == "walls":
            raise DustError("no room\nhere")
        numbers = {"has": 2.0, "lacks": 1.5, "ratio": 0.75, "scatter": 0.01, "share": 25.0}
        return {"part": part.name, "instead": ""} | numbers

    monkeypatch.setattr(parts, "measure_pair", measured)
    messages = []
    table = parts.main(load(SMOKE), log=messages.append)
    assert len(messages) == len(table.rows) + 1 and messages[0] == f"1 of {len(messages)}: rolling"
    table.show()
    text = capsys.readouterr().out
    (row,) = [line for line in text.splitlines() if line.startswith("rolling")]
    assert row.split() == "rolling 2.0 1.5 0.750 0.010 25.0".split() and "ns a" in text
    assert "walls: refused: no room here" in table.notes


CHILD = """
import sys, threading
from benchmarks.instructions import mark
rounds, go, done = [50, 100], threading.Semaphore(0), threading.Semaphore(0)
def work():
    for n in rounds:
        go.acquire()
        for _ in range(n):
            pass
        done.release()
threading.Thread(target=work).start()
print("ready", flush=True)
sys.stdin.readline()
for _ in rounds:
    mark()
    go.release()
    done.acquire()
    mark()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="not Linux")
def test_twice_the_work_takes_more_instructions():
    with subprocess.Popen(
        [sys.executable, "-c", CHILD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    ) as child:
        child.stdout.readline()
        try:
            with Stepper(child.pid) as stepper:
                child.stdin.write("go\n")
                child.stdin.flush()
                once, twice = stepper.instructions(), stepper.instructions()
        except DustError as error:
            child.kill()
            pytest.skip(str(error))
    # an iteration of nothing takes Python ten instructions at least
    assert once > 50 * 10
    assert twice > once + 50 * 10
