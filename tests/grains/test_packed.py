"""The pass over contacts is compiled to packed arithmetic. LLVM turns its loop into vectors under
conditions (grains.kernels.contacts) that one line of the source can break: it would be three times
slower, silently.
"""

import re
from collections import Counter

import pytest
from compilers import blocks_with_roots
from scenes import box, make_scene

from dusttaichi.compute.backend import loops_of, start_taichi
from dusttaichi.compute.engine import settings, ti
from dusttaichi.grains.kernels.contact_pass import ContactPass
from dusttaichi.grains.kernels.declare import declare, place
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.layout_choice import choose_layout
from dusttaichi.grains.pushes import make_push
from dusttaichi.grains.step import Phases
from dusttaichi.physics.contact.effect_registry import chosen_model
from dusttaichi.studies.machine_speed import compiled_bits

ARITHMETIC = re.compile(
    r"= (?:fadd|fsub|fmul|fdiv|fneg|tail call|call) [a-z ]*(<\d+ x )?(float|double)>? ?(.*)"
)


@ti.func
def nothing(self, block, tile, dt, p, position):
    """In place of what happens to contacts that form or break."""


CELL = {"kind": "periodic", "size": ["5 um"] * 3}
SCENES = {
    "pairs": {},
    "walls": {"boundary": box("bottom")},
    "stress in a cell": {"boundary": CELL, "output": {"series": {"steps": 10}}},
}


def operations(scene, walls, folder, monkeypatch):
    """Counter of the arithmetic of the compiled loop over walls or pairs by (lanes, type)."""
    monkeypatch.chdir(folder)
    # few contacts form or break: those are not part of the loop, and not packed
    monkeypatch.setattr(ContactPass, "change_block", nothing)
    model = chosen_model(scene.interaction, scene.numerics.newton_steps)
    push = make_push(scene.push, {}, [], 1.0)
    layout = choose_layout(scene, model, loops_of(scene.numerics), push, polydisperse=False)
    start_taichi(scene, 1)
    settings().print_kernel_llvm_ir_optimized = True
    settings().offline_cache = False  # what comes from the cache is not printed
    phases = Phases(place(declare(64, layout, walls)), layout, walls)
    contacts = phases.walls if walls else phases.pairs

    @ti.kernel
    def pass_over_contacts(dt: ti.f64, surfaces: Walls):
        for tile in range(contacts.tiles()):
            contacts.tile(tile, dt, contacts.gatherer.outside(1, dt, surfaces), dt)

    pass_over_contacts(0.0, Walls())
    counts = Counter()
    for block in blocks_with_roots(folder):
        for lanes, operation, operands in ARITHMETIC.findall(block):
            if "@" not in operands or "@llvm.sqrt" in operands:
                counts[int(lanes[1:-3] or 1) if lanes else 1, operation] += 1
    return counts


@pytest.mark.parametrize(
    "name, precision, kind",
    [
        *((name, "mixed", "float") for name in SCENES),
        ("pairs", "f64", "double"),
        *(pytest.param(n, "f64", "double", marks=pytest.mark.long) for n in SCENES if n != "pairs"),
    ],
)
def test_contacts_are_packed(name, precision, kind, tmp_path, monkeypatch):
    scene = make_scene(damping="viscoelastic", numerics={"precision": precision}, **SCENES[name])
    counts = operations(scene, name == "walls", tmp_path, monkeypatch)
    (tmp_path / "loop").mkdir()
    bits = compiled_bits(tmp_path / "loop")
    lanes = min(loops_of(scene.numerics).width, bits // {"float": 32, "double": 64}[kind])
    packed = sum(n for (count, _), n in counts.items() if count > 1)
    # two doubles at a time (SSE2) LLVM may leave alone: to gather them costs more than it saves
    assert packed > (0.9 if lanes > 2 else 0.5) * counts.total(), counts
    # and they fill the registers: one number of another width would halve them
    assert counts[lanes, kind] > (0.9 if lanes > 2 else 0.5) * counts.total(), counts
