"""LAMMPS data files (`atom_style sphere`, `units micro`), one a snapshot, for its `read_data`.

Lengths in um, times in us, masses in pg: diameter in um, density in pg/um^3, velocities in m/s,
spins in rad/us. The type is the number of the material, from 1 on. Contacts are not in it: LAMMPS
finds those of its own law.
"""

import numpy as np

from dusttaichi.analysis.frame import grain_masses
from dusttaichi.export.lammps import box_ends
from dusttaichi.results.outputs import check
from dusttaichi.units import LENGTH, MASS, SPEED, SPIN, TIME

MADE = "units micro, written by dusttaichi"


def write(run, frames, folder):
    """Write the frames to `folder`. Returns the paths."""
    masses = grain_masses(run) / MASS
    return [
        write_one(frame, masses, folder / f"grains_{frame.number:04d}.data") for frame in frames
    ]


def write_one(frame, masses, path):
    """Write a Frame, the masses of its grains [pg] (N,), to `path`; returns it."""
    radius, count = frame.radius / LENGTH, len(masses)
    ids = np.arange(1, count + 1)
    kind = frame.material + 1
    density = masses / (4.0 / 3.0 * np.pi * radius**3)
    atoms = np.column_stack([ids, kind, 2.0 * radius, density, frame.position / LENGTH])
    moves = np.column_stack([ids, frame.velocity / SPEED, frame.spin / SPIN])
    ends = box_ends(frame)
    with check(path, MADE).open("w", encoding="ascii") as file:
        file.write(f"LAMMPS data file, {MADE}, time {frame.time / TIME:.12g} us\n\n")
        file.write(f"{count} atoms\n{int(kind.max())} atom types\n\n")
        for axis, (low, high) in zip("xyz", ends / LENGTH, strict=True):
            file.write(f"{low:.16g} {high:.16g} {axis}lo {axis}hi\n")
        if frame.tilt:
            file.write(f"0 {frame.tilt / LENGTH:.16g} 0 xy xz yz\n")
        file.write("\nAtoms # sphere\n\n")
        np.savetxt(file, atoms, fmt="%d %d" + 5 * " %.16g")
        file.write("\nVelocities\n\n")
        np.savetxt(file, moves, fmt="%d" + 6 * " %.16g")
    return path
