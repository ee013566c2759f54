"""Names that several subpackages share."""

from types import ModuleType

AXES = ("x", "y", "z")
WALLS = ("x_min", "x_max", "y_min", "y_max", "bottom", "top")
SPRINGS = ("normal", "rolling", "sliding", "twisting")
CHANNELS = ("forming", "breaking", "damping", "rolling", "sliding", "twisting")
EXTRA_CHANNELS = ("asperities",)  # further channels of the ledger, of some scenes only
LYING = "lying cylinder"  # shape of a sample between two plates
NEVER = 2**62  # a step that no run reaches


def exported(namespace):
    """Public names of the namespace of a package, without those of other packages: `__all__`."""
    package = namespace["__name__"]
    return [
        name
        for name, value in namespace.items()
        if name[0] != "_" and not isinstance(value, ModuleType)
        if getattr(value, "__module__", package).startswith(package)
    ]
