"""Grain-by-grain simulation of porous dust with JKR contacts."""

import os

__version__ = "0.1.0"

# Taichi greets on import; the output of a run belongs to the user
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
