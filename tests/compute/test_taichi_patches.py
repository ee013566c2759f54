"""Kernels are read quickly, and what they compute does not change."""

from scenes import make_scene

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import ti


@ti.func
def power(x, n: ti.template()):
    """x^n, through itself: the factor on the left is known before the one on the right is read."""
    out = x
    if ti.static(n > 1):
        out = (x + 0.0) * power(x + 0.0, ti.static(n - 1))
    return out


@ti.func
def square(a):
    return a.dot(a)


def test_functions_within_themselves_and_of_several_types():
    """The same syntax tree twice at once, and after another type of what it is told: a vector,
    whose product Taichi looks up, and a struct with a product of its own."""

    @ti.func
    def twice(self, other):
        return 2.0 * self.x * other.x

    Number = ti.types.struct(x=ti.f64, __struct_methods={"dot": twice})
    start_taichi(make_scene(), 1)
    out = ti.field(ti.f64, shape=4)

    @ti.kernel
    def evaluate():
        out[0] = power(ti.cast(1.5, ti.f64), 3)
        out[1] = square(ti.Vector([3.0, 4.0]))
        out[2] = square(Number(3.0))
        out[3] = square(ti.Vector([3.0, 4.0]))

    evaluate()
    assert out.to_numpy().tolist() == [1.5**3, 25.0, 18.0, 25.0]
