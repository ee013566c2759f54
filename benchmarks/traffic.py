"""Bytes that a step of grains moves (part of `python -m benchmarks counts`).

A step passes over the contacts and over the grains. What each pass reads and writes stands here;
how wide it is follows from the declared fields. A number that a pass needs twice counts once: the
grains of neighbouring pairs are the same.
"""

from math import prod

import numpy as np

from dusttaichi.grains.kernels.declare import declare
from dusttaichi.grains.kernels.store import LOADS

# what the pass over contacts and that over grains do with it: r reads, w writes
PASSES = {
    "history": ("rw", ""),
    "loads": ("w", "r"),
    "own constants": ("r", ""),
    "touch": ("r", ""),
    "shift": ("r", ""),
    "pair_i": ("r", "r"),
    "pair_j": ("r", ""),
    "entry": ("", "r"),
    "entry_start": ("", "r"),
    "pair_start": ("", "r"),
    "x": ("r", "rw"),
    "v": ("r", "rw"),
    "w": ("r", "rw"),
    "x_search": ("", "r"),
    "orientation": ("", "rw"),
    "mass": ("", "r"),
    "inertia": ("", "r"),
}
BYTES = {"f64": 8, "f32": 4, "i32": 4}
LISTS = ("pair_i", "pair_j", "entry", "entry_start", "pair_start")


def traffic(sim) -> dict[str, tuple[float, float, float]]:
    """Bytes per listed pair and step of a Simulation without walls, by the number moved.

    Three values: of the pass over contacts, of that over grains, of one pass over both, where
    grains find what they need in the cache. The last entry is the sum.
    """
    bytes_by_group = {}
    for name, width in _list_widths(sim).items():
        of_contacts, of_grains = PASSES[name]
        # what the first pass writes without reading, the second has in the cache
        both = of_contacts + ("r" if not of_contacts else "") + ("w" if "w" in of_grains else "")
        moved = np.array([len(access) * width for access in (of_contacts, of_grains, both)])
        group = "lists" if name in LISTS else name
        bytes_by_group[group] = bytes_by_group.get(group, 0.0) + moved
    bytes_by_group["sum"] = sum(bytes_by_group.values())
    return {name: tuple(moved.tolist()) for name, moved in bytes_by_group.items()}


def _list_widths(sim):
    """Name -> bytes per listed pair, once read or written, of all in PASSES that a scene has."""
    layout, pairs = sim.layout, sim.state.pair_count
    row = BYTES[layout.law_name]
    rows = {"history": layout.state_rows, "loads": LOADS, "own constants": len(layout.stored)}
    out = {name: n * row for name, n in rows.items() if n}
    for variable in declare(sim.grains, layout, sim.box is not None):
        if variable.name in PASSES:
            (data_type, components), shape = variable.element, variable.shape
            count = prod(shape[1:]) * sim.grains
            if variable.name == "entry":
                count = int(sim.state["entry_start"][-1])
            elif shape[-1] == layout.width:  # numbers of pairs are in blocks
                count = prod(shape[1:]) // layout.width * pairs
            out[variable.name] = BYTES[data_type] * max(components, 1) * count / pairs
    return out
