"""Only what a scene requires: its fields and kernels by name, and what the parts of it cost."""

import csv
import io

import numpy as np
import pytest
from conftest import box, make_scene, sample_of
from scene_text import CONFIGS

from dusttaichi.errors import DustError
from dusttaichi.grains import inventory, preview
from dusttaichi.grains.build import build
from dusttaichi.grains.simulation import Simulation
from dusttaichi.samples import Sample
from dusttaichi.scene import load
from dusttaichi.studies import bench
from dusttaichi.studies.bench import costs, parts

PAIR = sample_of([[0, 0, 0], [1.19e-6, 0, 0]])
UNLIKE = Sample(PAIR.positions, PAIR.velocities, PAIR.spins, radii=np.array([0.6e-6, 0.59e-6]))
FLOOR = box("bottom")
CELL = {"kind": "periodic", "size": ["5 um"] * 3}
SERIES = {"series": {"steps": 10}}
CHECKS = {"output": SERIES}

FIELDS = set(
    "x v w x_search pair_i pair_j pair_start state load entry_start entry loss sync counts".split()
)
SCRATCH = set(
    "old_j cell_start cell_fill cell_grain near near_count own_count old_start chunk_sum "
    "bounds".split()
)
KERNELS = set("advance bounds find relist list_entries measure_grains measure_pairs".split())
WALL_FIELDS = set(
    "wall_grain wall_gap wall_of wall_slot wall_loss impulse impulse_total wall_chunk wall_first "
    "wall_sum wall_force".split()
)
WALL_KERNELS = {"relist_walls", "measure_walls"}
CELL_FIELDS = {"shift", "wraps", "cell", "face_work", "wrap_work"}
UNLIKE_FIELDS = {"radius", "mass", "inertia", "material", "constants", "near_start", "interfaces"}

# what a scene has beyond a pair of grains: keys of the scene, sample, fields, kernels, state size
SCENES = {
    "pair": ({}, PAIR, set(), set(), 7),
    "pair without twisting": ({"effects": ("rolling", "sliding")}, PAIR, set(), set(), 6),
    "damping": ({"damping": "viscous"}, PAIR, set(), set(), 9),
    "asperities": (
        {"material": "silica_pd08", "interaction": {"asperities": "on", "damping": "none"}},
        PAIR,
        set(),
        set(),
        9,
    ),
    "one grain on a floor": (
        {"boundary": FLOOR, **CHECKS},
        sample_of([[0, 0, 0]]),
        WALL_FIELDS,
        WALL_KERNELS,
        7,
    ),
    "box": ({"boundary": box(), **CHECKS}, PAIR, WALL_FIELDS, WALL_KERNELS, 7),
    "periodic": (
        {"boundary": CELL, "output": {**SERIES, "stress": False}},
        PAIR,
        CELL_FIELDS,
        {"wrap"},
        7,
    ),
    "stress": ({"boundary": CELL, **CHECKS}, PAIR, CELL_FIELDS | {"virial", "flux"}, {"wrap"}, 7),
    "stress in a box": (
        {"boundary": box(), "output": {**SERIES, "stress": True}},
        PAIR,
        WALL_FIELDS | {"virial", "wall_virial", "flux"},
        WALL_KERNELS,
        7,
    ),
    "unlike grains": ({}, UNLIKE, UNLIKE_FIELDS, set(), 7),
    "force": (
        {"push": [{"grains": [0], "force": ["1 nN", "0 N", "0 N"]}]},
        PAIR,
        {"push_force"},
        set(),
        7,
    ),
    "carried": (
        {"push": [{"grains": [0], "speed": ["1 m/s", "0 m/s", "0 m/s"]}]},
        PAIR,
        {"free", "held"},
        set(),
        7,
    ),
}


@pytest.fixture
def unstarted(monkeypatch):
    """Scenes are built, but nothing runs: only a run compiles."""
    monkeypatch.setattr(Simulation, "_start", lambda self, sample: None)


def place(scene, sample, **how):
    sim = build(scene, sample, **how)
    return sim, set(sim.fields) | set(sim.scratch) | set(sim.sums), set(sim.kernels.names)


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_has_what_it_requires_and_nothing_else(name, unstarted):
    blocks, sample, fields, kernels, size = SCENES[name]
    sim, there, compiled = place(make_scene(**blocks), sample)
    own = FIELDS | SCRATCH | {"grain_sum", "pair_sum"} | fields
    assert there == own
    assert compiled == KERNELS | kernels
    assert sim.layout.state_size == size
    assert sim.fields["state"].shape[1] == size


def test_a_batch_has_the_number_of_the_scene_beside(unstarted):
    _, there, compiled = place(make_scene(), PAIR, scenes=np.array([0, 1]))
    assert there == FIELDS | SCRATCH | {"grain_sum", "pair_sum", "scene"}
    assert compiled == KERNELS


@pytest.mark.parametrize("part", parts.PARTS[:-1], ids=lambda part: f"{part.name} {part.instead}")
def test_a_pair_of_scenes_differs_in_one_way(part):
    """In one key of the scene (an effect each where several are off), or in how it is built."""
    one, two = (variant.scene(8) for variant in (part.has, part.lacks))
    blocks = [
        key
        for key in ("material", "interaction", "boundary", "push", "numerics")
        if getattr(one, key) != getattr(two, key)
    ]
    stress = one.output.stress != two.output.stress
    assert len(blocks) + stress + (part.has.built != part.lacks.built) == 1


def test_the_last_pair_is_no_pair():
    assert parts.PARTS[-1].has == parts.PARTS[-1].lacks  # its ratio is that of the noise


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Two parts on sixty grains; the second is one that the build refuses."""
    folder = tmp_path_factory.mktemp("parts")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        patch.setattr(parts, "FILLING_FACTOR", 0.15)  # a cake, which needs no kernels to be made
        adhesion = parts.OPEN.settings | parts._off("rolling", "sliding") | parts.NO_DAMPING
        one, two = (parts.Variant(adhesion | more) for more in ({}, parts._off("twisting")))
        refused = parts.Part(
            "time step", "of a second", one, parts.Variant({"numerics.time_step": "1 s"})
        )
        chosen = (parts.Part("twisting", "off", one, two), refused)
        result = parts.main(60, chosen, 100, 2, out=folder / "parts.csv")
    assert (folder / "parts.csv").read_text() == result.csv()
    return result


def test_parts_are_timed_in_pairs(table):
    (row,) = table.speed
    assert row.name == "twisting" and min(row.has, row.lacks, row.ratio) > 0
    assert row.scatter >= 0 and row.share == pytest.approx(100 * (1 - row.ratio))
    assert any("refused" in note and "time_step" in note for note in table.notes)


def test_parts_as_text_and_csv(table):
    text = table.text()
    assert "twisting" in text and "What each part costs" in text and "time step against" in text
    lines = [line for line in table.csv().splitlines() if not line.startswith("#")]
    (row,) = csv.DictReader(io.StringIO("\n".join(lines)))
    assert row["part"] == "twisting" and row["instead"] == "off"
    assert float(row["ratio [1]"]) == pytest.approx(table.speed[0].ratio, rel=1e-5)
    assert "| twisting | off |" in table.markdown()


def test_parts_refuse_numbers_that_cannot_be():
    with pytest.raises(DustError, match="at least 1"):
        parts.main(60, rounds=-1)
    assert bench.main is not parts.main


# What `dust check` says.

SMOKE = CONFIGS / "smoke.yaml"


def test_the_parts_of_a_scene():
    found = {part.name: part for part in costs.parts_of(load(SMOKE))}
    effects = ["rolling", "sliding", "twisting", "damping"]
    assert list(found) == [*effects, "walls", "energy ledger", "noise: the scene with all"]
    for name in effects:
        one, two = found[name].has.scene(0), found[name].lacks.scene(0)
        assert getattr(two.interaction, name) in (None, two.interaction.damping)
        assert one.with_value(f"interaction.{name}", "none" if name == "damping" else "off") == two
    assert found["walls"].lacks.scene(0).boundary.kind == "open"
    tensile = {part.name for part in costs.parts_of(load(CONFIGS / "tensile_ice.yaml"))}
    assert {"periodic faces and stress", "stress", "damping"} <= tensile


def test_costs_are_told_of_every_part(monkeypatch):
    def measured(part, grains, paths, **_):
        if part.name == "walls":
            raise DustError("no room\nhere")
        return parts.PartRow(part.name, "", 2.0, 1.5, 0.75, 0.01)

    monkeypatch.setattr(costs, "measure_pair", measured)
    said = []
    rows = dict(costs.cost_rows(load(SMOKE), 60, said.append))
    assert rows["rolling"] == "25.0 ± 1.0 % of a step"
    assert rows["walls"] == "not measured: no room here"
    assert len(said) == len(rows) and said[0] == f"1 of {len(rows)}: rolling"


def test_check_says_what_is_compiled_in_and_what_it_takes(unstarted):
    scene = make_scene(boundary=FLOOR, damping="viscous", output=SERIES)
    sim, there, _ = place(scene, PAIR)
    told = dict(inventory.compiled_rows(scene, sim))
    assert told["walls"] == "bottom" and told["periodic faces"] == "none"
    assert told["forces"].endswith("damping (viscous)") and told["left out"] == "asperities"
    assert told["numbers of state a contact"].startswith("9: ")
    assert set(told["kernels"].split(", ")) == KERNELS | WALL_KERNELS
    arrays = (field.to_numpy() for field in inventory.tables(sim).values())
    whole = sum(array.nbytes for array in arrays)
    rows = inventory.field_rows(sim)
    assert f"{whole / 2:.0f} bytes a grain" in rows[-1][1]
    assert preview.state_bytes(sim) == whole
    named = {rows[k][0] for k in range(len(rows) - 2)}
    named |= set(rows[-2][1].split(": ")[1].split(", "))
    assert named == there


def test_check_says_what_the_preset_sets():
    scene = make_scene(numerics={"accuracy": "fast", "newton_steps": 3})
    rows = dict(inventory.preset_rows(scene))
    assert rows["accuracy"] == "fast; it sets"
    assert rows["  newton_steps"] == "3, given (the preset has 1)"
    assert rows["  step_fraction"].endswith("not used: time_step is given")
    assert "time_step 0.1 ns" in rows["not set by it"] and "mass_scaling 1" in rows["not set by it"]
    assert {key.strip() for key in rows} == {*scene.numerics.preset, "accuracy", "not set by it"}
