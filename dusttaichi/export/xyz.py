"""Plain XYZ, which every viewer of atoms reads: all snapshots in one file, positions in Angstrom.

An `X` a grain, and nothing but its position: radii, cells and colours are in `extxyz`.
"""

import numpy as np

from dusttaichi.results.outputs import check

FILE = "grains.xyz"
ANGSTROM = 1e-10  # [m]
UNITS = "positions in Angstrom, written by dusttaichi"


def write(run, frames, folder):
    """Write the frames to one file in `folder`. Returns its path in a list."""
    path = check(folder / FILE, UNITS)
    with path.open("w", encoding="ascii") as file:
        for frame in frames:
            file.write(f"{len(frame.position)}\ntime {frame.time:.9g} s; {UNITS}\n")
            np.savetxt(file, frame.position / ANGSTROM, fmt="X %.10g %.10g %.10g")
    return [path]
