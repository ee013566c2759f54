"""The loops over neighbours are compiled to vectors. LLVM makes them of a loop that writes nothing
to memory and has no branch; one store or `and` in it, and each neighbour would be passed over
alone, silently."""

import re

import pytest
from continuum import dust

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import settings, ti
from dusttaichi.compute.processor import compiled_bits
from dusttaichi.continuum.build import layout_of
from dusttaichi.continuum.compiled import Fields, passes
from dusttaichi.continuum.kernels import store
from dusttaichi.continuum.kernels.numbers import numbers_type
from dusttaichi.physics.continuum.kernels import MATERIAL

# the kernel's slope takes one root for each neighbour
ROOTS = re.compile(r"call [a-z ]*<(\d+) x double> @llvm\.sqrt\.v")
BLOCK = re.compile(r"^vector\.body[\w.]*:.*?(?=^[\w.]+:)", re.MULTILINE | re.DOTALL)
# bits of a vector: to gather two doubles takes LLVM as long as what the vector saves
NARROWEST = 256
# what a scene can have in these loops beside what all have
MORE = {"contact": "separate", "viscosity": {"contact": 1.0}}
WALL = {"boundary": {"kind": "faces", "bottom": "rigid"}}


@pytest.mark.parametrize("more", [{}, MORE, WALL], ids=["plain", "separate, viscous", "rigid"])
@pytest.mark.parametrize("number", ["first", "second"])
def test_a_pass_over_neighbours_is_packed(number, more, tmp_path, monkeypatch):
    scene = dust.scene(**more)
    layout, StepNumbers = layout_of(scene), numbers_type(2)
    start_taichi(scene, 1)
    f, lists = (Fields(fields) for fields in store.place(layout, 64, 64))
    _, rates, forces = passes(f, lists, layout)

    @ti.kernel
    def first(n: StepNumbers, m: MATERIAL):
        for i in range(n.count):
            rates.update_stress(i, n, m)

    @ti.kernel
    def second(n: StepNumbers):
        for i in range(n.count):
            forces.pass_over(i, n)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(settings(), "print_kernel_llvm_ir_optimized", True)
    monkeypatch.setattr(settings(), "offline_cache", False)  # what it holds is not printed
    if number == "first":
        first(StepNumbers(count=0), MATERIAL())
    else:
        second(StepNumbers(count=0))
    code = "".join(file.read_text() for file in tmp_path.glob("*optimized*.ll"))
    if compiled_bits() < NARROWEST:
        pytest.skip(f"the compiler has vectors of {compiled_bits()} bits here, which do not pay")
    assert ROOTS.search(code)
    # several vectors at a time would leave the rest of a list, most of it, to be done one by one
    assert min(len(ROOTS.findall(body)) for body in BLOCK.findall(code)) == 1
