"""Numbers that kernels are told in structs."""

from scenes import make_scene

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import ti


def test_structs_reach_a_kernel_whatever_their_place_and_however_often():
    start_taichi(make_scene(), 1)
    Numbers = ti.types.struct(a=ti.f64, n=ti.i32, m=ti.types.matrix(2, 2, ti.f64))

    @ti.kernel
    def read(first: Numbers, second: Numbers) -> ti.f64:
        own = first.a + 10.0 * first.n + 100.0 * first.m[1, 0]
        return own + 1000.0 * (second.a + 10.0 * second.n + 100.0 * second.m[1, 0])

    one = Numbers(a=1.0, n=2, m=[[0.0, 0.0], [3.0, 0.0]])
    other = Numbers(a=4.0, n=5, m=[[0.0, 0.0], [6.0, 0.0]])
    # whole numbers in double precision: exact
    for _ in range(2):
        assert read(one, other) == 654_321.0
        assert read(other, one) == 321_654.0
        assert read(one, one) == 321_321.0
