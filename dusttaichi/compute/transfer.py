"""Rows of fields to NumPy and back, where kernels run in a memory of their own.

Taichi's own transfers copy whole fields. These copy the requested rows, and of a field with further
axes a slice of the second one.
"""

import numpy as np

from dusttaichi.compute.engine import ti

TYPES = {"f64": np.float64, "f32": np.float32, "i32": np.int32, "i64": np.int64}
_ROWS = ti.types.ndarray()


def type_of(field):
    """NumPy's type of the numbers of a field."""
    return TYPES[str(field.dtype).split(".")[-1]]


def lanes_of(field):
    """Numbers of an element: (n,) of a vector, () of a scalar."""
    return (field.n,) if hasattr(field, "n") else ()


# -- kernels: of scalars with any number of axes, and of vectors ---------------------------------


@ti.kernel
def _read(field: ti.template(), first: ti.i32, second: ti.i32, out: _ROWS):
    for at in ti.grouped(out):
        out[at] = field[_place(at, first, second)]


@ti.kernel
def _write(field: ti.template(), first: ti.i32, values: _ROWS):
    for at in ti.grouped(values):
        field[_place(at, first, 0)] = values[at]


@ti.func
def _place(index, first, second):
    """Index of an element of a field; first, second: where its rows and their slices begin."""
    index[0] += first
    if ti.static(index.n > 1):
        index[1] += second
    return index


@ti.kernel
def _read_vectors(field: ti.template(), first: ti.i32, second: ti.i32, out: _ROWS):
    for i in range(out.shape[0]):
        for k in ti.static(range(field.n)):
            out[i, k] = field[first + i][k]


@ti.kernel
def _write_vectors(field: ti.template(), first: ti.i32, values: _ROWS):
    for i in range(values.shape[0]):
        for k in ti.static(range(field.n)):
            field[first + i][k] = values[i, k]


@ti.kernel
def _take_3(field: ti.template(), index: _ROWS, out: _ROWS):
    for n in out:
        out[n] = field[index[0, n], index[1, n], index[2, n]]


# -- functions of tables ------------------------------------------------------------------------


def read(field, first, end, *slices):
    """Rows from `first` to before `end`; slices: one of the second axis, or none."""
    shape, second = [end - first, *field.shape[1:]], 0
    if slices:
        (columns,) = slices
        second, last, _ = columns.indices(field.shape[1])
        shape[1] = last - second
    out = np.empty((*shape, *lanes_of(field)), type_of(field))
    if out.size:
        kernel = _read_vectors if lanes_of(field) else _read
        kernel(field, first, second, out)
    return out


def write(field, first, values):
    """Rows from `first` on."""
    values = np.ascontiguousarray(values, type_of(field))
    if values.size:
        kernel = _write_vectors if lanes_of(field) else _write
        kernel(field, first, values)


def take(field, *index):
    """Elements of a field of three axes by indices that NumPy spreads to one length."""
    index = np.ascontiguousarray(np.broadcast_arrays(*index), np.int32)
    out = np.empty(index.shape[1], type_of(field))
    if out.size:
        _take_3(field, index, out)
    return out
