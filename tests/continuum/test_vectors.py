"""The loops over neighbours are compiled to vectors, a lane for each particle of a block. LLVM
makes them of the innermost loop, over the lanes, where it writes to local arrays alone and has no
branch; one store to memory or `and` in it, and particles would be computed one by one, silently."""

import re
from types import SimpleNamespace

import pytest
from compilers import blocks_with_roots
from continuum import dust

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import settings, ti
from dusttaichi.continuum.compiled_dust import passes
from dusttaichi.continuum.dust_build import layout_of
from dusttaichi.continuum.kernels import store
from dusttaichi.continuum.kernels.run_arguments import numbers_type
from dusttaichi.continuum.physics.kernels import MATERIAL
from dusttaichi.studies.machine_speed import compiled_bits

# the kernel's slope takes one root for each neighbour
ROOTS = re.compile(r"call [a-z ]*<(\d+) x double> @llvm\.sqrt\.v")
# names of the copies of a loop that LLVM unrolls, as it does for some processors
COPY = re.compile(r"[\w.]+\.(?:prol|epil|\d)\w*:")
ARITHMETIC = re.compile(r"= f(?:add|sub|mul|div) [a-z ]*(<\d+ x double>|double)")
# bits of a vector: to gather two doubles takes LLVM as long as what the vector saves
NARROWEST = 256
# what a scene can have in these loops beside what all have
MORE = {"contact": "separate", "viscosity": {"contact": 1.0}}
WALL = {"boundary": {"kind": "faces", "bottom": "rigid"}}


OPTIONS = {"plain": {}, "separate, viscous": MORE, "rigid": WALL}
CASES = [("plain", 2), ("plain", 3)]
CASES += [
    pytest.param(name, dimension, marks=pytest.mark.long)
    for name in OPTIONS
    for dimension in (2, 3)
    if name != "plain"
]


@pytest.mark.parametrize("option, dimension", CASES)
@pytest.mark.parametrize("number", ["first", "second"])
def test_a_pass_over_neighbours_is_packed(number, option, dimension, tmp_path, monkeypatch):
    """Of neighbours, and of their images behind faces where there are any."""
    scene = dust.scene(dimension=dimension, **OPTIONS[option])
    layout, StepNumbers = layout_of(scene), numbers_type(dimension)
    start_taichi(scene, 1)
    f, lists = (SimpleNamespace(**fields) for fields in store.place(layout, 64, 64))
    _, rates, forces = passes(f, lists, layout)

    @ti.kernel
    def first(n: StepNumbers, m: MATERIAL):
        for i in range(n.count):
            rates.pass_over(i, n, m)

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
    (tmp_path / "loop").mkdir()
    if (bits := compiled_bits(tmp_path / "loop")) < NARROWEST:
        pytest.skip(f"the compiler has vectors of {bits} bits here, which do not pay")
    bodies = [body for body in blocks_with_roots(tmp_path) if ROOTS.search(body)]
    loops = [body for body in bodies if not COPY.match(body)]
    # newer compilers make more of them, or take the lanes of two neighbours together
    assert len(loops) >= 1 + layout.faces
    lanes = {int(lane_count) for body in bodies for lane_count in ROOTS.findall(body)}
    assert min(lanes) == store.LANES or lanes == {2 * store.LANES}
    # what belongs to the neighbour alone is computed once for all lanes: of an image, its place
    for body, alone in zip(loops, (5, 25), strict=False):
        operations, times = ARITHMETIC.findall(body), len(ROOTS.findall(body))
        alone_here = operations.count("double")
        assert len(operations) - alone_here > 25 * times
        assert alone_here < alone * times
