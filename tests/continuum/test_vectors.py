"""The loops over neighbours are compiled to vectors. LLVM makes them of a loop that writes nothing
to memory; one store in it, and each neighbour would be passed over alone, silently."""

import re

import pytest
import taichi as ti
from continuum import dust
from taichi.lang.impl import current_cfg

from dusttaichi.continuum.compiled import Fields
from dusttaichi.continuum.kernels.forces import Forces
from dusttaichi.continuum.kernels.rates import Rates
from dusttaichi.continuum.kernels.response import Response
from dusttaichi.continuum.kernels.smoothing import KERNELS
from dusttaichi.physics.continuum.kernels import MATERIAL

ROOTS = re.compile(r"@llvm\.sqrt\.v(\d+)f64\(")


@pytest.mark.parametrize("number", ["first", "second"])
def test_a_pass_over_neighbours_is_packed(number, tmp_path, monkeypatch):
    x, area = dust.disc(3 * dust.SPACING)
    sim = dust.moving(dust.scene(), dust.particles(x, area)).sim
    f, lists, layout = Fields(sim.compiled.fields), Fields(sim.compiled.lists), sim.layout
    slope, numbers = KERNELS[layout.kernel], sim.kernels.StepNumbers
    law = Response(f, layout.dimension)
    rates = Rates(f, lists, layout, smoothing=slope, law=law, contact=None)
    forces = Forces(f, lists, layout)

    @ti.kernel
    def first(n: numbers, m: MATERIAL):
        for i in range(n.count):
            rates.answer(i, n, m)

    @ti.kernel
    def second(n: numbers):
        for i in range(n.count):
            forces.pass_over(i, n)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(current_cfg(), "print_kernel_llvm_ir_optimized", True)
    monkeypatch.setattr(current_cfg(), "offline_cache", False)  # what it holds is not printed
    if number == "first":
        first(numbers(count=0), MATERIAL())
    else:
        second(numbers(count=0))
    code = "".join(file.read_text() for file in tmp_path.glob("*optimized*.ll"))
    # the kernel's slope takes one root for each neighbour
    assert ROOTS.search(code)
