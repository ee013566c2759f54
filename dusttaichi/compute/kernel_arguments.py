"""Structs of numbers as arguments of kernels.

Taichi checks and converts them member by member at every call, which takes a millisecond for the
numbers of contacts and walls: as long as hundreds of steps of a small scene. Here a struct is
converted once; it must not be changed after its first call.
"""

from dusttaichi.compute.engine import ti

StructType = ti.lang.struct.StructType
_checked, _set_one_by_one = StructType.__instancecheck__, StructType.set_kernel_struct_args


def patches():
    """(class, name in it, replacement) of the passing of structs; patching.py applies them."""
    return [
        (StructType, "__instancecheck__", _is_of),
        (StructType, "set_kernel_struct_args", _set_all),
    ]


def _is_of(self, instance):
    """True if a struct is of this type."""
    known = getattr(instance, "__dict__", {}).get("_known_types", ())
    if any(kind is self for kind in known):
        return True
    if not _checked(self, instance):
        return False
    object.__setattr__(instance, "_known_types", (*known, self))
    return True


def _set_all(self, struct, launch_ctx, ret_index=()):
    """Passes the members of a struct, the argument number `ret_index`, to a launch."""
    if len(ret_index) != 1:
        _set_one_by_one(self, struct, launch_ctx, ret_index)
        return
    recorded = struct.__dict__.setdefault("_recorded", {})
    if ret_index not in recorded:
        recorded[ret_index] = _Recorded(self, struct, ret_index)
    recorded[ret_index].pass_to(launch_ctx)


class _Recorded:
    """Stand-in of the context of a launch, which records the members of a struct."""

    def __init__(self, kind, struct, ret_index):
        self.floats, self.integers, self.naturals = [], [], []
        _set_one_by_one(kind, struct, self, ret_index)

    def set_struct_arg_float(self, index, value):
        self.floats.append((index, float(value)))

    def set_struct_arg_int(self, index, value):
        self.integers.append((index, int(value)))

    def set_struct_arg_uint(self, index, value):
        self.naturals.append((index, int(value)))

    def pass_to(self, launch_ctx):
        for index, value in self.floats:
            launch_ctx.set_struct_arg_float(index, value)
        for index, value in self.integers:
            launch_ctx.set_struct_arg_int(index, value)
        for index, value in self.naturals:
            launch_ctx.set_struct_arg_uint(index, value)
