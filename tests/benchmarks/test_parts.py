"""What the parts of a scene cost: pairs of scenes, timed in turn."""

import csv
import io

import pytest
from scenes import CONFIGS, KERNELS

from benchmarks import parts
from dusttaichi import compiler
from dusttaichi.errors import DustError
from dusttaichi.scene import load

SMOKE = CONFIGS / "smoke.yaml"


@pytest.mark.parametrize("part", parts.PARTS[:-1], ids=lambda part: f"{part.name} {part.instead}")
def test_a_pair_of_scenes_differs_in_one_way(part):
    """In one key of the scene (an effect each where several are off), or in how it is built."""
    one, two = (variant.scene(8) for variant in (part.has, part.lacks))
    blocks = [
        key
        for key in ("material", "interaction", "boundary", "push", "numerics")
        if getattr(one, key) != getattr(two, key)
    ]
    written = any(
        getattr(one.output, key) != getattr(two.output, key) for key in ("stress", "variables")
    )
    assert len(blocks) + written + (part.has.built != part.lacks.built) == 1


def test_the_last_pair_is_no_pair():
    assert parts.PARTS[-1].has == parts.PARTS[-1].lacks  # its ratio is that of the noise


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Two parts on sixty grains; the second is one that the build refuses."""
    folder = tmp_path_factory.mktemp("parts")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        patch.setenv(compiler.variable(compiler.KERNEL_FOLDER), KERNELS)
        patch.setattr(parts, "FILLING_FACTOR", 0.15)  # a cake, which needs no kernels to be made
        adhesion = parts.OPEN.settings | parts._off("rolling", "sliding") | parts.NO_DAMPING
        one, two = (parts.Variant(adhesion | more) for more in ({}, parts._off("twisting")))
        refused = parts.Part(
            "time step", "of a second", parts.Variant({"numerics.time_step": "1 s"}), one
        )
        chosen = (parts.Part("twisting", "off", one, two), refused)
        result = parts.main(parts=chosen, grains=60, steps=100, rounds=2, out=folder / "parts.csv")
    assert (folder / "parts.csv").read_text() == result.csv()
    return result


def test_parts_are_timed_in_pairs(table):
    (row,) = table.rows
    assert row.name == "twisting" and min(row.has, row.lacks, row.ratio) > 0
    assert row.scatter >= 0 and row.share == pytest.approx(100 * (1 - row.ratio))
    assert any("refused" in note and "time_step" in note for note in table.notes)


def test_parts_as_text_and_csv(table):
    text = table.text()
    assert "twisting" in text and "What each part costs" in text and "time step against" in text
    lines = [line for line in table.csv().splitlines() if not line.startswith("#")]
    (row,) = csv.DictReader(io.StringIO("\n".join(lines)))
    assert row["part"] == "twisting" and row["instead"] == "off"
    assert float(row["ratio [1]"]) == pytest.approx(table.rows[0].ratio, rel=1e-5)


def test_parts_refuse_numbers_that_cannot_be():
    with pytest.raises(DustError, match="at least 1"):
        parts.main(grains=60, rounds=-1)


def test_the_parts_of_a_scene():
    found = {part.name: part for part in parts.parts_of(load(SMOKE))}
    effects = ["rolling", "sliding", "twisting", "damping"]
    assert list(found) == [*effects, "walls", "energy ledger", "noise: the scene with all"]
    for name in effects:
        one, two = found[name].has.scene(0), found[name].lacks.scene(0)
        assert getattr(two.interaction, name) in (None, two.interaction.damping)
        assert one.with_value(f"interaction.{name}", "none" if name == "damping" else "off") == two
    assert found["walls"].lacks.scene(0).boundary.kind == "open"
    tensile = {part.name for part in parts.parts_of(load(CONFIGS / "tensile_ice.yaml"))}
    assert {"periodic faces and stress", "stress", "damping"} <= tensile


def test_every_part_of_a_scene_has_a_row_or_a_note(monkeypatch):
    def measured(part, grains, path, **_):
        assert grains == 60 and path is None
        if part.name == "walls":
            raise DustError("no room\nhere")
        return parts.PartRow(part.name, "", 2.0, 1.5, 0.75, 0.01)

    monkeypatch.setattr(parts, "measure_pair", measured)
    said = []
    table = parts.main(load(SMOKE), log=said.append)
    assert len(said) == len(table.rows) + 1 and said[0] == f"1 of {len(said)}: rolling"
    (row,) = [line for line in table.text().splitlines() if line.startswith("rolling")]
    assert row.split()[-4:] == ["1.5", "0.750", "0.010", "25.0"] and "a step" in table.text()
    assert "walls: refused: no room here" in table.notes


def test_parts_of_other_methods_are_not_known():
    with pytest.raises(DustError, match="method continuum.*benchmarks continuum"):
        parts.main(load(CONFIGS / "guettler2009/bead.yaml"))
