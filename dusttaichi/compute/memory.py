"""Capacity of fields, and transfer of their used part to NumPy and back.

Fields have a larger capacity than a scene has particles (capacity_for), and Taichi's own transfers
copy whole fields and compile a kernel for each. On a CPU the arrays share the memory of the fields
(compute.taichi_internals.addresses); else the requested rows are copied (compute.transfer).
"""

import ctypes
from math import floor, log2

import numpy as np

from dusttaichi.compute import transfer
from dusttaichi.compute.engine import program
from dusttaichi.compute.pages import release
from dusttaichi.compute.transfer import TYPES, lanes_of, type_of

__all__ = ["TYPES", "FieldAccess", "Table", "capacity_for"]

SMALLEST = 1024  # capacity, particles
COARSE = 16384  # particles up to which capacities grow fourfold


def capacity_for(particles):
    """Capacity of the fields of a scene of this many particles.

    Kernels are compiled for the shapes of their fields, so scenes of one capacity share them. It is
    coarse for small scenes, and at most a quarter too large for others.
    """
    capacity = SMALLEST
    while capacity < particles and capacity < COARSE:
        capacity *= 4
    if capacity >= particles:
        return capacity
    step = 2 ** (floor(log2(particles)) - 2)
    return -(-particles // step) * step


class FieldAccess:
    """Access of one simulation to its fields.

    It ends with their Taichi program or when the next simulation gets them.
    """

    def __init__(self):
        self._program, self._has_ended = program(), False

    def end(self):
        """Another simulation gets the fields."""
        self._has_ended = True

    def check(self):
        """Raises RuntimeError if it has ended."""
        if self._has_ended or program() is not self._program:
            raise RuntimeError("The memory of this simulation is gone: another one was built.")


class Table:
    """The first `rows` rows of a Taichi field; a matrix or vector element adds an axis.

    memory: array of the whole field that shares its memory, None on a device with its own. access:
    that of the simulation, None if it has its fields as long as Taichi runs. Raises ValueError for
    more rows than the field has: kernels would write beyond its memory.
    """

    def __init__(self, field, rows, memory=None, access=None):
        if rows > field.shape[0]:
            raise ValueError(f"{rows} rows of a field of {field.shape[0]}")
        self.field, self.rows, self.memory = field, rows, memory
        self.access = access or FieldAccess()

    def to_numpy(self, rows=None, *slices):
        """A copy of the used rows, or of the first `rows`; slices: of further axes."""
        return self.copy_rows(0, self.rows if rows is None else min(rows, self.rows), *slices)

    def copy_rows(self, first, end, *slices):
        """A copy of the rows from `first` to before `end`; slices: of further axes."""
        self.access.check()
        if self.memory is None:
            return transfer.read(self.field, first, end, *slices)
        return self.memory[(slice(first, end), *slices)].copy()

    def take(self, *index):
        """A copy of the elements at these indices, one array of them for each axis."""
        self.access.check()
        if self.memory is None:
            return transfer.take(self.field, *index)
        return self.memory[index]

    def from_numpy(self, values, first=0):
        """Write rows from `first` on; other rows stay as they are."""
        self.access.check()
        end = first + len(values)
        if end > self.rows:
            raise ValueError(f"{end} rows for a field of {self.rows}")
        if self.memory is not None:
            self.memory[first:end] = values
        else:
            transfer.write(self.field, first, values)

    @property
    def nbytes(self):
        """Bytes of the whole field."""
        shape = (*self.field.shape, *lanes_of(self.field))
        return int(np.prod(shape, dtype=np.int64)) * np.dtype(type_of(self.field)).itemsize

    def clear(self):
        """Set every number of the whole field to 0; unused rows then take no memory."""
        if self.memory is None or not release(self.memory):
            self.fill(0)

    def fill(self, value):
        """Set every number of the whole field."""
        self.access.check()
        if self.memory is not None:
            self.memory[...] = value
        else:
            self.field.fill(value)


def view_cells(tables, rows):
    """The first rows of fields that are adjacent in memory, each of them one void: (rows,).

    It shares their memory. None on a device with memory of its own. tables: Table of all fields of
    one block of memory.
    """
    arrays = [table.memory for table in tables]
    if any(array is None for array in arrays):
        return None
    for table in tables:
        table.access.check()
    first = min(arrays, key=lambda array: array.ctypes.data)
    size = first.strides[0]
    memory = (ctypes.c_char * (size * rows)).from_address(first.ctypes.data)
    return np.ndarray((rows,), f"V{size}", buffer=memory)


class FieldState:
    """The state of a scene in its fields.

    fields: Table by name. layout: the options that are compiled in.
    """

    def __init__(self, fields, layout):
        self.fields, self.layout = fields, layout

    def __contains__(self, name):
        return name in self.fields

    def __getitem__(self, name):
        """A copy of the used rows of a field."""
        return self.fields[name].to_numpy()

    def __setitem__(self, name, values):
        self.fields[name].from_numpy(values)
