"""The compiler as it is patched, and as it comes: with `numerics.debug`, and in other versions."""

import numpy as np
import pytest
from compilers import taichi_alone
from scenes import Probe, box, make_scene, sample_of

from dusttaichi.compute import compiler, engine
from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import settings, ti
from dusttaichi.compute.taichi_internals import source_reading

RADIUS = 0.6e-6
DEBUG = {"numerics": {"debug": True}}


@pytest.fixture(autouse=True)
def patched_again():
    yield
    source_reading.patches.cache_clear()
    start_taichi(make_scene(), 1)


def of_taichi():
    """Whether all that is patched is Taichi's own."""
    return {
        getattr(h, n) is original
        for h, n, original, ours in source_reading.patches()
        if original is not ours
    }


def run(**keys):
    """A pair that meets in a box whose walls come, and the program that its kernels belong to."""
    x = np.array([[-0.6005, 0.0, 0.0], [0.6005, 0.01, 0.0]]) * 1e-6
    v = np.array([[0.3, 0.0, 0.0], [-0.3, 0.0, 0.0]])
    boundary = box(size="fit", wall_speed=0.01)
    probe = Probe(make_scene(boundary=boundary, dt="5 ps", **keys), sample_of(x, v))
    probe.advance(400)
    return np.concatenate([probe.x / RADIUS, probe.v, probe.w * RADIUS]), engine.program()


@pytest.mark.long
def test_a_scene_runs_in_debug_with_the_same_numbers():
    assert engine.is_tested() or compiler.name() != "taichi"  # else there is nothing to compare
    usual, first = run(numerics={"precision": "f64"})
    patched = {False} if compiler.name() == "taichi" else set()
    assert of_taichi() == patched and settings().fast_math
    bare, second = run(numerics={"precision": "f64", "debug": True})
    assert False not in of_taichi() and second is not first  # compiled anew, as the key says
    assert settings().debug and settings().check_out_of_bound and not settings().fast_math
    assert np.abs(usual[2:]).max() > 0.01  # they move
    # 400 steps that each round at 1e-16, in another order without fast math
    np.testing.assert_allclose(bare, usual, rtol=0, atol=1e-12)
    start_taichi(make_scene(), 1)
    assert of_taichi() == patched and not settings().debug


def test_bounds_are_checked_in_debug():
    start_taichi(make_scene(**DEBUG), 1)
    field = ti.field(ti.f64, shape=4)

    @ti.kernel
    def read(index: ti.i32) -> ti.f64:
        return field[index]

    assert read(3) == 0.0
    with pytest.raises(AssertionError, match=r"size \(4\) with indices \(4\)"):
        read(4)


def test_settings_of_the_shell_count_in_debug(monkeypatch):
    usual = settings().opt_level
    monkeypatch.setenv(compiler.variable("OPT_LEVEL"), str(usual + 1))
    start_taichi(make_scene(), 1)
    assert settings().opt_level == usual
    start_taichi(make_scene(**DEBUG), 1)
    assert settings().opt_level == usual + 1


@taichi_alone
def test_another_version_is_left_as_it_is(monkeypatch):
    source_reading.patch(debug=True)
    monkeypatch.setattr(engine, "VERSION", "1.7.9")
    source_reading.patches.cache_clear()
    functions_before = ti.lang.kernel_impl.transform_tree, ti.lang.expr.make_constant_expr
    source_reading.patch(debug=False)
    functions_after = ti.lang.kernel_impl.transform_tree, ti.lang.expr.make_constant_expr
    assert functions_after == functions_before
    rows = dict(source_reading.rows(debug=False))
    assert rows["compiler"] == "Taichi 1.7.9"
    assert "1.7.3 and 1.7.4" in rows["patches of its internals"]
