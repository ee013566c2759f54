"""LAMMPS data files (`atom_style sphere`, `units micro`) for `read_data`, and restart files.

Lengths in µm, times in µs, masses in pg: diameter in µm, density in pg/µm^3, velocities in m/s,
spins in rad/µs. The type is the number of the material, from 1. They have no contacts: LAMMPS finds
those of its own law. Restart files are written by LAMMPS itself from a data file, for
`read_restart` of the same version.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.frame import read_grain_masses
from dusttaichi.export.lammps import choose_boundary_styles, find_box_ends, number_types
from dusttaichi.results.outputs import check
from dusttaichi.samples.formats.lammps import lammps_program, run_lammps
from dusttaichi.units import LENGTH, MASS, SPEED, SPIN, TIME

if TYPE_CHECKING:
    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


MARK = "units micro, written by dusttaichi"


def write(run: Run, frames: Iterable[Frame], folder: Path) -> list[Path]:
    """Write the frames to `folder`. Returns the paths."""
    masses = read_grain_masses(run) / MASS
    return [
        write_data_file(frame, masses, folder / f"grains_{frame.number:04d}.data")
        for frame in frames
    ]


def write_data_file(frame: Frame, masses: NDArray[np.float64], path: Path) -> Path:
    """Write a Frame, the masses of its grains [pg] (N,), to `path`; returns it."""
    radius, count = frame.radius / LENGTH, len(masses)
    ids = np.arange(1, count + 1)
    atom_type = number_types(frame)
    density = masses / (4.0 / 3.0 * np.pi * radius**3)
    atoms = np.column_stack([ids, atom_type, 2.0 * radius, density, frame.position / LENGTH])
    moves = np.column_stack([ids, frame.velocity / SPEED, frame.spin / SPIN])
    ends = find_box_ends(frame)
    ends[0] -= 0.5 * frame.tilt  # lower corner of a cell that is sheared about its centre
    with check(path, MARK).open("w", encoding="ascii") as file:
        file.write(f"LAMMPS data file, {MARK}, time {frame.time / TIME:.12g} us\n\n")
        file.write(f"{count} atoms\n{int(atom_type.max())} atom types\n\n")
        for axis, (low, high) in zip("xyz", ends / LENGTH, strict=True):
            file.write(f"{low:.16g} {high:.16g} {axis}lo {axis}hi\n")
        if frame.tilt:
            file.write(f"0 {frame.tilt / LENGTH:.16g} 0 xy xz yz\n")
        file.write("\nAtoms # sphere\n\n")
        np.savetxt(file, atoms, fmt="%d %d" + 5 * " %.16g")
        file.write("\nVelocities\n\n")
        np.savetxt(file, moves, fmt="%d" + 6 * " %.16g")
    return path


RESTART = "LammpS RestartT"  # the start of the file

SCRIPT = """units micro
atom_style sphere
boundary {boundary}
read_data grains.data
write_restart grains.restart
"""


def write_restart(run: Run, frames: Iterable[Frame], folder: Path) -> list[Path]:
    """Write the frames to `folder`. Returns the paths. Raises DustError without LAMMPS."""
    lammps_program()
    masses, paths = read_grain_masses(run) / MASS, []
    for frame in frames:
        paths.append(check(folder / f"grains_{frame.number:04d}.restart", RESTART))
        with tempfile.TemporaryDirectory() as scratch:
            folder_of_run = Path(scratch)
            write_data_file(frame, masses, folder_of_run / "grains.data")
            styles = " ".join(choose_boundary_styles(frame))
            (folder_of_run / "in").write_text(SCRIPT.format(boundary=styles), encoding="ascii")
            run_lammps(folder_of_run, "-in", "in")
            shutil.move(folder_of_run / "grains.restart", paths[-1])
    return paths
