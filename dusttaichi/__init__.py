"""Grain-by-grain simulation of porous dust with JKR contacts."""

import inspect
import os

__version__ = "0.1.0"

# Taichi greets on import; the output of a run belongs to the user
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

# Taichi asks of each function it decorates at import who imports it; that this is Python's own
# importer, and no module, is found only after all modules have been searched: half a second in all
inspect.modulesbyfile["<frozen importlib._bootstrap>"] = "importlib._bootstrap"
