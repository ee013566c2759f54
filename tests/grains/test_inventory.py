"""Only what a scene requires: its fields and kernels by name, and what `dust check` says."""

import numpy as np
import pytest
from scenes import box, make_scene, sample_of

from dusttaichi.grains import grain_engine, inventory
from dusttaichi.grains.build import build
from dusttaichi.samples import Sample

PAIR = sample_of([[0, 0, 0], [1.19e-6, 0, 0]])
UNLIKE = Sample(PAIR.positions, PAIR.velocities, PAIR.spins, radii=np.array([0.6e-6, 0.59e-6]))
FLOOR = box("bottom")
CELL = {"kind": "periodic", "size": ["5 um"] * 3}
SERIES = {"series": {"steps": 10}}
CHECKS = {"output": SERIES}

FIELDS = set(
    "x v w x_search contact load numbers touches pair_i pair_j pair_start entry_start entry loss "
    "sync counts".split()
)
SCRATCH = set(
    "cell_first in_cell cell_of placeless cell_chunk bounds grid near near_count own_count "
    "old_start chunk_sum".split()
)
KERNELS = set("advance evaluate bounds list_neighbours measure_grains measure_pairs".split())
WALL_FIELDS = set(
    "wall_grain wall_gap wall_of wall_slot wall_loss impulse impulse_total wall_chunk "
    "wall_sum".split()
)
WALL_KERNELS = {"measure_walls"}
CELL_FIELDS = {"shift", "wraps", "cell", "face_work", "wrap_work"}
UNLIKE_FIELDS = {"radius", "mass", "inertia", "material", "touch", "near_start", "interfaces"}

# what a scene has beyond a pair of grains: keys of the scene, sample, fields, kernels, and how many
# numbers its contacts keep: xi, zeta, whether they touch, and what their effects need
SCENES = {
    "pair": ({}, PAIR, set(), set(), 8),
    "pair without twisting": ({"effects": ("rolling", "sliding")}, PAIR, set(), set(), 7),
    "damping": ({"damping": "viscous"}, PAIR, set(), set(), 10),
    "asperities": (
        {"material": "silica_pd08", "interaction": {"asperities": "on", "damping": "none"}},
        PAIR,
        set(),
        set(),
        10,
    ),
    "one grain on a floor": (
        {"boundary": FLOOR, **CHECKS},
        sample_of([[0, 0, 0]]),
        WALL_FIELDS,
        WALL_KERNELS,
        8,
    ),
    "box": ({"boundary": box(), **CHECKS}, PAIR, WALL_FIELDS, WALL_KERNELS, 8),
    "periodic": (
        {"boundary": CELL, "output": {**SERIES, "stress": False}},
        PAIR,
        CELL_FIELDS,
        {"wrap"},
        8,
    ),
    "stress": ({"boundary": CELL, **CHECKS}, PAIR, CELL_FIELDS | {"virial", "flux"}, {"wrap"}, 8),
    "stress in a box": (
        {"boundary": box(), "output": {**SERIES, "stress": True}},
        PAIR,
        WALL_FIELDS | {"virial", "wall_virial", "flux"},
        WALL_KERNELS,
        8,
    ),
    "unlike grains": ({}, UNLIKE, UNLIKE_FIELDS, set(), 8),
    "force": (
        {"push": [{"grains": [0], "force": ["1 nN", "0 N", "0 N"]}]},
        PAIR,
        {"push_force"},
        set(),
        8,
    ),
    "carried": (
        {"push": [{"grains": [0], "speed": ["1 m/s", "0 m/s", "0 m/s"]}]},
        PAIR,
        {"free", "carried_impulse"},
        set(),
        8,
    ),
}


@pytest.fixture
def unstarted_taichi(monkeypatch):
    """Scenes are built, but nothing runs: only a run compiles."""
    monkeypatch.setattr(grain_engine, "start", lambda *parts, **numbers: None)


def place(scene, sample, **options):
    sim = build(scene, sample, **options)
    return (
        sim,
        set(sim.fields) | set(sim.scratch) | set(sim.kernel_sums.tables),
        set(vars(sim.kernels)),
    )


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_has_what_it_requires_and_nothing_else(name, unstarted_taichi):
    blocks, sample, fields, kernels, size = SCENES[name]
    sim, fields_present, compiled = place(make_scene(**blocks), sample)
    expected_fields = FIELDS | SCRATCH | {"grain_sum", "pair_sum"} | fields
    assert fields_present == expected_fields
    assert compiled == KERNELS | kernels
    assert sim.layout.state_rows == size
    expected_fields = len(sim.layout.stored)
    assert sim.fields["contact"].to_numpy().shape[1] == size + expected_fields
    assert sim.fields["load"].to_numpy().shape[1] == max(12, size)


# What `dust check` says.


def test_check_says_what_is_compiled_in_and_what_it_takes(unstarted_taichi):
    scene = make_scene(boundary=FLOOR, damping="viscous", output=SERIES)
    sim, fields_present, _ = place(scene, PAIR)
    compiled_rows = dict(inventory.compiled_rows(scene, sim))
    assert compiled_rows["walls"] == "bottom" and compiled_rows["periodic faces"] == "none"
    assert (
        compiled_rows["forces"].startswith("normal (jkr), damping (viscous)")
        and compiled_rows["left out"] == "asperities"
    )
    assert compiled_rows["history of a contact"].startswith(
        "10 numbers: xi 3, zeta 3, touched 1, speed 1"
    )
    assert set(compiled_rows["kernels"].split(", ")) == KERNELS | WALL_KERNELS
    total_bytes = sum(table.nbytes for table in inventory.tables(sim).values())
    rows = inventory.field_rows(sim)
    assert f"{total_bytes / 1024:.0f} bytes a grain, capacity 1,024" in rows[-1][1]
    named = {rows[k][0] for k in range(len(rows) - 2)}
    named |= set(rows[-2][1].split(": ")[1].split(", "))
    assert named == fields_present


def test_check_says_what_the_preset_sets():
    scene = make_scene(numerics={"accuracy": "fast", "newton_steps": 3})
    rows = dict(inventory.preset_rows(scene))
    assert rows["accuracy"] == "fast; it sets"
    assert rows["  newton_steps"] == "3, given (the preset has 1)"
    assert rows["  step_fraction"].endswith("not used: time_step is given")
    assert "time_step 0.1 ns" in rows["not set by it"] and "mass_scaling 1" in rows["not set by it"]
    assert {key.strip() for key in rows} == {*scene.numerics.preset, "accuracy", "not set by it"}
