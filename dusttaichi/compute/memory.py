"""Capacity of fields, and transfer of their used part to NumPy and back.

Fields have a larger capacity than a scene has particles (capacity_for), and Taichi's own transfers
copy whole fields and compile a kernel for each. On a CPU the arrays share the memory of the fields:
one kernel returns its address, Taichi knows its layout. From a device the requested rows are copied
(compute.transfer).
"""

import ctypes
import re
from math import floor, log2

import numpy as np

from dusttaichi.compute import transfer
from dusttaichi.compute.engine import program, ti
from dusttaichi.compute.transfer import TYPES, lanes_of, type_of
from dusttaichi.errors import DustError

__all__ = ["TYPES", "FieldAccess", "Table", "arrays_of", "capacity_for"]

SMALLEST = 1024  # capacity, particles
COARSE = 16384  # particles up to which capacities grow fourfold


def capacity_for(particles):
    """Capacity of the fields of a scene of this many particles.

    Kernels are compiled for the shapes of their fields, so scenes of one capacity share them. It is
    coarse where memory is no concern, and at most a quarter too large beyond.
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
        self._program, self._ended = program(), False

    def end(self):
        """Another simulation gets the fields."""
        self._ended = True

    def check(self):
        """Raises RuntimeError if it has ended."""
        if self._ended or program() is not self._program:
            raise RuntimeError("The memory of this simulation is gone: another one was built.")


class Table:
    """The first `rows` rows of a Taichi field; a matrix or vector element adds an axis.

    memory: array of the whole field that shares its memory, None on a device with its own. access:
    that of the simulation, None if it has its fields as long as Taichi runs.
    """

    def __init__(self, field, rows, memory=None, access=None):
        self.field, self.rows, self.memory = field, rows, memory
        self.access = access or FieldAccess()

    def to_numpy(self, rows=None, *rest):
        """A copy of the used rows, or of the first `rows` of them; rest: slices of further axes."""
        return self.part(0, self.rows if rows is None else min(rows, self.rows), *rest)

    def part(self, first, end, *rest):
        """A copy of the rows from `first` to before `end`; rest: slices of further axes."""
        self.access.check()
        if self.memory is None:
            return transfer.read(self.field, first, end, *rest)
        return self.memory[(slice(first, end), *rest)].copy()

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

    def fill(self, value):
        """Set every number of the whole field."""
        self.access.check()
        if self.memory is not None:
            self.memory[...] = value
        else:
            self.field.fill(value)


def arrays_of(fields):
    """Arrays that share the memory of fields (a dict by name), which this process can read.

    Raises DustError if there is not enough memory.
    """
    base = _base(next(iter(fields.values())))
    return {name: _memory(field, base) for name, field in fields.items()}


def _offset(field):
    """Bytes from the beginning of all fields to this one, and from one element to the next."""
    leaf = field.snode
    dense = leaf.parent()
    offset = leaf._offset_bytes_in_parent_cell + dense._offset_bytes_in_parent_cell
    return offset, dense._cell_size_bytes


def _base(field):
    """Address of the first byte of all fields, which are contiguous."""
    place = [0] * len(field.shape)

    @ti.kernel
    def address() -> ti.u64:
        return ti.get_addr(field, place)

    try:
        return address() - _offset(field)[0]
    except RuntimeError as error:  # the first launch allocates the fields
        size = re.search(r"allocation \((\d+) B\) failed", str(error))
        if size is None:
            raise
        raise DustError(
            f"The fields of this scene need {int(size[1]) / 1e9:.3g} GB in one piece, more than "
            "this process can have. Try fewer grains, a longer numerics.spacing or smaller "
            "bodies, or a higher limit of memory (ulimit -v, container, batch system)."
        ) from error


def _memory(field, base):
    """Array of a field (rows, ..., elements) that shares its memory."""
    dtype, lanes = np.dtype(type_of(field)), lanes_of(field)
    offset, size = _offset(field)
    elements = int(np.prod(field.shape, dtype=np.int64))
    whole = (ctypes.c_char * (size * elements)).from_address(base + offset)
    strides = (size, *[dtype.itemsize] * len(lanes))
    rows = np.ndarray((elements, *lanes), dtype, buffer=whole, strides=strides)
    return rows.reshape(*field.shape, *lanes)  # a view of the same memory
