"""Structures that a process keeps: kernels are loaded once, and bits are those of a fresh start."""

from types import SimpleNamespace

import numpy as np
import pytest
from bits import assert_same_bits
from scenes import FAR, Probe, make_scene, sample_of

from dusttaichi.compute import compiled, engine
from dusttaichi.compute.compiled import Compiled, Structures
from dusttaichi.compute.engine import program, ti
from dusttaichi.compute.taichi_internals import programs
from dusttaichi.compute.taichi_internals.programs import PROGRAMS

X = np.array([[-0.6005, 0.0, 0.0], [0.6005, 0.01, 0.0]]) * 1e-6
V = np.array([[0.3, 0.1, 0.0], [-0.3, 0.0, 0.0]])
BROKEN = -1  # number of a structure that cannot be compiled

pytestmark = pytest.mark.skipif(not engine.is_tested(), reason="other compilers keep the last one")


@pytest.fixture
def small():
    """`small(number)`: Compiled of a field and of a kernel that fills it with that number."""
    PROGRAMS.end()
    structures = Structures()

    def compile_for(key):
        field = ti.field(ti.f64, shape=4)
        if key[1] == BROKEN:
            raise KeyboardInterrupt

        @ti.kernel
        def fill():
            for n in field:
                field[n] = key[1]

        return Compiled.from_kernels(key, None, SimpleNamespace(fill=fill), ({"field": field},))

    yield lambda n, **numerics: structures.get(
        ("test", n, "workers"), make_scene(numerics=numerics), 1, compile_for
    )
    PROGRAMS.end()


def run(damping):
    """State of a pair that has met, with damping of that kind, and the program of its kernels."""
    probe = Probe(make_scene(damping=damping, boundary=FAR), sample_of(X, V))
    probe.advance(100)
    return dict(probe.sim.grain_state.arrays()), program()


def test_a_structure_is_found_again_with_the_same_bits(monkeypatch):
    monkeypatch.setattr(programs, "COMPILED", np.inf)
    first = {damping: run(damping) for damping in ("none", "viscoelastic")}
    for damping in (*first, *first):
        arrays, current_program = run(damping)
        assert current_program is first[damping][1]
        assert_same_bits(first[damping][0], arrays)


def test_each_program_has_its_own_fields_and_kernels(small):
    """Also those that are launched first after another program has run."""
    structures_made = [small(n) for n in range(3)]
    assert len({id(structure.program) for structure in structures_made}) == 3
    for n in (1, 0, 2, 1):
        assert small(n) is structures_made[n] and program() is structures_made[n].program
        structures_made[n].kernels.fill()
        assert set(structures_made[n].memory["field"]) == {float(n)}


def test_all_end_where_another_one_would_be_too_many(small, monkeypatch):
    monkeypatch.setattr(programs, "MOST", 2)
    first, second = small(1), small(2)
    assert first.program in PROGRAMS and second.program in PROGRAMS
    third = small(3)
    assert [structure.program in PROGRAMS for structure in (first, second, third)] == [
        False,
        False,
        True,
    ]
    assert small(1) is not first


@pytest.mark.parametrize(("module", "limit"), [(compiled, "LARGE"), (programs, "COMPILED")])
def test_large_fields_and_new_kernels_are_not_kept(small, module, limit, monkeypatch):
    monkeypatch.setattr(module, limit, 0)
    first = small(1)
    small(2)
    assert first.program not in PROGRAMS and small(1) is not first


def test_debugging_keeps_nothing(small):
    first, bare = small(1), small(2, debug=True)
    assert first.program not in PROGRAMS
    assert small(1) is not first and bare.program not in PROGRAMS


def test_a_structure_that_was_not_compiled_to_the_end_is_not_kept(small):
    """Its fields may be large."""
    first = small(1)
    with pytest.raises(KeyboardInterrupt):
        small(BROKEN)
    broken = program()
    small(2)
    assert first.program not in PROGRAMS and broken not in PROGRAMS


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_a_program_that_was_resumed_in_part_is_not_used(small, steps, monkeypatch):
    """Ctrl-C: before, within, and after what makes it the current one."""
    first, second = small(1), small(2)

    def resume_partly(aside):
        if steps > 0:
            ti.lang.impl.pytaichi = aside.runtime
        if steps > 1:
            resume(aside)
        raise KeyboardInterrupt

    resume = programs.Aside.resume
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(programs.Aside, "resume", resume_partly)
        small(1)
    for n, earlier in ((1, first), (2, second)):
        again = small(n)
        assert again is not earlier
        again.kernels.fill()
        assert set(again.memory["field"]) == {float(n)}


def test_a_start_of_taichi_elsewhere_ends_all(small):
    first, second = small(1), small(2)
    ti.reset()
    assert small(1) is not first
    ti.init(arch=ti.cpu)
    assert small(2) is not second
    small(2).kernels.fill()
    assert set(small(2).memory["field"]) == {2.0}
