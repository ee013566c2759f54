"""Kernels are read quickly, and what they compute does not change; fields and their memory."""

import sys

import numpy as np
import pytest
from compilers import taichi_alone
from program import python
from scenes import make_scene

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import ti
from dusttaichi.compute.taichi_internals.addresses import arrays_of


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
    """One syntax tree twice at once, and after another type of what it is told: a vector,
    whose product Taichi looks up, and a struct with a product of its own."""

    @ti.func
    def twice(self, second):
        return 2.0 * self.x * second.x

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


def test_products_of_vectors_are_those_of_numpy():
    start_taichi(make_scene(), 1)
    a, b = np.array([1.0, -2.0, 3.0]), np.array([0.5, 4.0, -1.0])
    out = ti.field(ti.f64, shape=8)

    @ti.func
    def product(u, v):
        return (u + v).cross(u - v)

    @ti.kernel
    def evaluate():
        u, v = ti.Vector([1.0, -2.0, 3.0], ti.f64), ti.Vector([0.5, 4.0, -1.0], ti.f64)
        turned = product(u, v)
        for k in ti.static(range(3)):
            out[k] = turned[k]
        out[3], out[4], out[5] = u.dot(v), u.norm_sqr(), (u + v).sum()
        flat = ti.Vector([u[0], u[1]])
        out[6] = flat.cross(ti.Vector([v[0], v[1]]))
        out[7] = ti.Matrix([[1.0, 2.0], [3.0, 4.0]]).sum()

    evaluate()
    expected = [*np.cross(a + b, a - b), a @ b, a @ a, (a + b).sum(), a[0] * b[1] - a[1] * b[0], 10]
    # small numbers in binary: nothing is rounded
    assert out.to_numpy().tolist() == expected


@taichi_alone
def test_vectors_of_unlike_lengths_are_refused():
    start_taichi(make_scene(), 1)

    @ti.kernel
    def evaluate() -> ti.f64:
        return ti.Vector([1.0, 2.0, 3.0]).dot(ti.Vector([1.0, 2.0]))

    with pytest.raises(ti.TaichiCompilationError, match="Tensor"):
        evaluate()


# Beginnings of the SHA-256 of the sources of what is patched, of Taichi 1.7.3 and 1.7.4.
SOURCES = {
    "ASTTransformerContext.get_pos_info": "fabeb718a3ea",
    "_get_tree_and_ctx": "aa0a0af9f3f8",
    "transform_tree": "e888203947a2",
    "Builder.__call__": "37fb69c0e9eb",
    "Struct._register_members": "d31c1ef66cad",
    "sum": "255098bef2f5",
    "dot": "047537bb6734",
    "norm_sqr": "3631ec6a62f2",
    "cross": "28b599489476",
}
NAMES = """
from dusttaichi.compute.taichi_internals import source_reading
import hashlib, inspect
for _, _, own, _ in source_reading.patches():
    print(own.__qualname__, hashlib.sha256(inspect.getsource(own).encode()).hexdigest()[:12])
"""


@taichi_alone
def test_what_is_patched_is_what_it_was():
    """In a new version of Taichi this names the functions that differ: read those and their
    patches again before the version is added to engine.PATCHED. In a process of its own, in which
    nothing is patched yet."""
    process = python("-c", NAMES, check=True)
    sources = dict(line.split() for line in process.stdout.splitlines())
    assert sources == SOURCES


@taichi_alone
def test_arrays_share_the_memory_of_fields():
    """Offsets of fields are private to Taichi: another layout in a new version ends here."""
    start_taichi(make_scene(), 1)
    x, k = ti.Vector.field(3, ti.f64), ti.field(ti.i32)
    ti.root.dense(ti.i, 5).place(x, k)
    table = ti.field(ti.f32, shape=(4, 2, 3))
    for field in (x, k, table):
        values = np.arange(np.prod(field.shape) * (3 if field is x else 1))
        field.from_numpy(values.reshape(*field.shape, *((3,) if field is x else ())))
    arrays = arrays_of({"x": x, "k": k, "table": table})
    for name, field in (("x", x), ("k", k), ("table", table)):
        np.testing.assert_array_equal(arrays[name], field.to_numpy())
    arrays["x"][3, 1] = -1.0
    assert x[3][1] == -1.0


# -- memory ---------------------------------------------------------------------------------------


FIELDS = """
import resource
from dusttaichi.compute.engine import ti
from dusttaichi.compute.taichi_internals.addresses import arrays_of
from dusttaichi.errors import DustError

ti.init(ti.cpu, offline_cache=False, log_level=ti.CRITICAL)
field = ti.field(ti.f64, shape=2**30)
resource.setrlimit(resource.RLIMIT_AS, (2**32, 2**32))
try:
    arrays_of({"field": field})
except DustError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="a limit on the memory of a process is needed")
def test_fields_that_a_process_cannot_have():
    process = python("-c", FIELDS)
    assert "need 8.59 GB in one piece" in process.stdout, process.stderr
