"""Arrays that share the memory of fields, where this process can read it.

A kernel returns the address of the fields of a contiguous piece, and Taichi knows their layout.
"""

import ctypes
import re

import numpy as np

from dusttaichi.compute.engine import ti
from dusttaichi.compute.taichi_internals import are_allowed
from dusttaichi.compute.transfer import lanes_of, type_of
from dusttaichi.errors import DustError


def arrays_of(fields):
    """Arrays that share the memory of fields (a dict by name); none where they are switched off.

    Raises DustError if there is not enough memory.
    """
    bases = {}
    for field in fields.values():
        if (piece := field.snode._snode_tree_id) in bases:
            continue
        address = _find_address(field)  # the first one allocates all
        if not are_allowed():
            return {}
        bases[piece] = address - _offset(field)[0]
    return {name: _memory(f, bases[f.snode._snode_tree_id]) for name, f in fields.items()}


def _find_address(field):
    """Address of a field; the first launch allocates all fields that have none."""
    origin = [0] * len(field.shape)

    @ti.kernel
    def address() -> ti.u64:
        return ti.get_addr(field, origin)

    try:
        return address()
    except RuntimeError as error:
        size = re.search(r"allocation \((\d+) B\) failed", str(error))
        if size is None:
            raise
        raise DustError(
            f"The fields of this scene need {int(size[1]) / 1e9:.3g} GB in one piece, more than "
            "this process can have. Try fewer grains, a longer numerics.spacing or smaller "
            "bodies, or a higher limit of memory (ulimit -v, container, batch system)."
        ) from error


def _offset(field):
    """Bytes from the beginning of all fields to this one, and from one element to the next."""
    leaf = field.snode
    dense = leaf.parent()
    offset = leaf._offset_bytes_in_parent_cell + dense._offset_bytes_in_parent_cell
    return offset, dense._cell_size_bytes


def _memory(field, base):
    """Array of a field (rows, ..., elements) that shares its memory."""
    dtype, lanes = np.dtype(type_of(field)), lanes_of(field)
    offset, size = _offset(field)
    elements = int(np.prod(field.shape, dtype=np.int64))
    memory = (ctypes.c_char * (size * elements)).from_address(base + offset)
    strides = (size, *[dtype.itemsize] * len(lanes))
    rows = np.ndarray((elements, *lanes), dtype, buffer=memory, strides=strides)
    return rows.reshape(*field.shape, *lanes)  # a view of the same memory
