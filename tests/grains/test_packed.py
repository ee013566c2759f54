"""The pair pass is compiled to packed arithmetic. LLVM finds the lanes from the stores of a block,
and one line of the source can make it find them no more: it would be three times slower, silently.
"""

import re
from collections import Counter

import pytest
import taichi as ti
from scenes import make_scene
from taichi.lang.impl import current_cfg

from dusttaichi.compute.backend import LOOPS, start_taichi
from dusttaichi.compute.processor import compiled_bits
from dusttaichi.domain.pushes import make_push
from dusttaichi.grains.build import chosen_layout
from dusttaichi.grains.kernels.declare import declare, place
from dusttaichi.grains.kernels.phases import Phases
from dusttaichi.physics.contact.registry import chosen_model

ARITHMETIC = re.compile(
    r"= (?:fadd|fsub|fmul|fdiv|fneg|tail call|call) [a-z ]*(<\d+ x )?(float|double)>? ?(.*)"
)


def operations(precision, folder, monkeypatch):
    """Counter of the arithmetic of the compiled pair pass by (lanes, type)."""
    monkeypatch.chdir(folder)
    scene = make_scene(damping="viscoelastic", numerics={"precision": precision})
    model = chosen_model(scene.interaction, scene.numerics.newton_steps)
    push = make_push(scene.push, {}, [], 1.0)
    layout = chosen_layout(scene, model, LOOPS["cpu"], push, polydisperse=False)
    start_taichi(scene, 1, simplify=False)
    current_cfg().print_kernel_llvm_ir_optimized = True
    current_cfg().offline_cache = False  # what comes from the cache is not printed
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
    # two doubles at a time (SSE2) LLVM leaves a quarter as it is: what is gathered costs more to
    # put together than it saves. Where it finds no lanes, next to nothing is packed
    assert packed > (0.9 if lanes > 2 else 0.6) * found.total()
    # and they fill the registers: one number of another width would halve them
    assert found[lanes, kind] > (0.8 if lanes > 2 else 0.6) * found.total()
