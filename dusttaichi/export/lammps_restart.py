"""LAMMPS restart files, one a snapshot: written by LAMMPS itself from its data file.

`read_restart` takes them on the version of LAMMPS that has written them. They hold what the data
file holds (see lammps_data): grains in a box, `atom_style sphere`, `units micro`.
"""

import shutil
import tempfile
from pathlib import Path

from dusttaichi.analysis.frame import grain_masses
from dusttaichi.export import lammps_data
from dusttaichi.export.lammps import boundary_words
from dusttaichi.processes import lammps_program, run_lammps
from dusttaichi.results.outputs import check
from dusttaichi.units import MASS

MADE = "LammpS RestartT"  # how LAMMPS begins the file

SCRIPT = """units micro
atom_style sphere
boundary {boundary}
read_data grains.data
write_restart grains.restart
"""


def write(run, frames, folder):
    """Write the frames to `folder`. Returns the paths. Raises DustError without LAMMPS."""
    lammps_program()
    masses, paths = grain_masses(run) / MASS, []
    for frame in frames:
        paths.append(check(folder / f"grains_{frame.number:04d}.restart", MADE))
        with tempfile.TemporaryDirectory() as scratch:
            own = Path(scratch)
            lammps_data.write_one(frame, masses, own / "grains.data")
            words = " ".join(boundary_words(frame))
            (own / "in").write_text(SCRIPT.format(boundary=words), encoding="ascii")
            run_lammps(own, "-in", "in")
            shutil.move(own / "grains.restart", paths[-1])
    return paths
