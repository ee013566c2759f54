"""Names that several subpackages share."""

from types import ModuleType

AXES = ("x", "y", "z")
WALLS = ("x_min", "x_max", "y_min", "y_max", "bottom", "top")
SPRINGS = ("normal", "rolling", "sliding", "twisting")
CHANNELS = ("forming", "breaking", "damping", "rolling", "sliding", "twisting")
EXTRA_CHANNELS = ("asperities",)  # channels of the ledger that only some scenes have, behind those
NEVER = 2**62  # a step that no run reaches


def exported(namespace):
    """Public names that the `__init__` of a package imports, for its `__all__`."""
    own = ("exported", *(name for name in namespace if name.startswith("_")))
    return [k for k, v in namespace.items() if k not in own and not isinstance(v, ModuleType)]
