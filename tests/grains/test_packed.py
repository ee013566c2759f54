"""The pass over contacts is compiled to packed arithmetic. LLVM turns its loop into vectors under
conditions (grains.kernels.contacts) that one line of the source can break: it would be three times
slower, silently.
"""

import re
from collections import Counter

import pytest
from scenes import make_scene

from dusttaichi.compute.backend import LOOPS, start_taichi
from dusttaichi.compute.engine import settings, ti
from dusttaichi.compute.processor import compiled_bits
from dusttaichi.domain.pushes import make_push
from dusttaichi.grains.build import chosen_layout
from dusttaichi.grains.kernels.contacts import ContactPass
from dusttaichi.grains.kernels.declare import declare, place
from dusttaichi.grains.kernels.phases import Phases
from dusttaichi.physics.contact.registry import chosen_model

ARITHMETIC = re.compile(
    r"= (?:fadd|fsub|fmul|fdiv|fneg|tail call|call) [a-z ]*(<\d+ x )?(float|double)>? ?(.*)"
)


@ti.func
def nothing(self, block, tile, dt, p, place):
    """In place of what happens to contacts that form or break."""


def operations(precision, folder, monkeypatch):
    """Counter of the arithmetic of the compiled pair pass by (lanes, type)."""
    monkeypatch.chdir(folder)
    # few contacts form or break: those are not part of the loop, and not packed
    monkeypatch.setattr(ContactPass, "change_block", nothing)
    scene = make_scene(damping="viscoelastic", numerics={"precision": precision})
    model = chosen_model(scene.interaction, scene.numerics.newton_steps)
    push = make_push(scene.push, {}, [], 1.0)
    layout = chosen_layout(scene, model, LOOPS["cpu"], push, polydisperse=False)
    start_taichi(scene, 1, simplify=False)
    settings().print_kernel_llvm_ir_optimized = True
    settings().offline_cache = False  # what comes from the cache is not printed
    phases = Phases(place(declare(64, layout, False)), layout, False)

    @ti.kernel
    def pass_over_pairs(dt: ti.f64):
        for tile in range(phases.pair_tiles()):
            phases.touch_pairs(tile, dt, 0.0)

    pass_over_pairs(0.0)
    found = Counter()
    for file in folder.glob("*optimized*.ll"):
        for lanes, kind, rest in ARITHMETIC.findall(file.read_text()):
            if "@" not in rest or "@llvm.sqrt" in rest:
                found[int(lanes[1:-3] or 1) if lanes else 1, kind] += 1
    return found


@pytest.mark.parametrize("precision, kind", [("mixed", "float"), ("f64", "double")])
def test_contacts_are_packed(precision, kind, tmp_path, monkeypatch):
    found = operations(precision, tmp_path, monkeypatch)
    lanes = min(LOOPS["cpu"].width, compiled_bits() // {"float": 32, "double": 64}[kind])
    packed = sum(n for (count, _), n in found.items() if count > 1)
    # what is gathered in double precision may be left as it is, a tenth of all
    assert packed > 0.85 * found.total(), found
    # and they fill the registers: one number of another width would halve them
    assert found[lanes, kind] > 0.8 * found.total(), found
