"""Names that several rooms share, each written once."""

AXES = ("x", "y", "z")
WALLS = ("x_min", "x_max", "y_min", "y_max", "bottom", "top")
SPRINGS = ("normal", "rolling", "sliding", "twisting")
CHANNELS = ("forming", "breaking", "damping", "rolling", "sliding", "twisting")
EXTRA_CHANNELS = ("asperities",)  # channels of the ledger that only some scenes have, behind those
NEVER = 2**62  # a step that no run reaches
