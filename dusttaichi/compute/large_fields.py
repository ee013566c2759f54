"""Fields of which a scene uses the first part alone, each in a piece of memory of its own."""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.pages import release
from dusttaichi.compute.taichi_internals.addresses import arrays_of

AXES = {1: ti.i, 2: ti.ij}


def place_apart(lists):
    """Fields, by name, of (dtype, shape) each, of which unused pages take no memory.

    The compiler writes zeros to all memory that it allocates. These are allocated one after
    another, and give it back before the next: to be called before any other field is made.
    """
    fields = {}
    for name, (dtype, shape) in lists.items():
        builder, fields[name] = ti.FieldsBuilder(), ti.field(dtype)
        builder.dense(AXES[len(shape)], shape).place(fields[name])
        builder.finalize()
        for array in arrays_of({name: fields[name]}).values():
            release(array)
    return fields
