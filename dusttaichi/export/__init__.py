"""Snapshots in the formats that other programs read: ParaView, OVITO, ASE, LAMMPS."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from dusttaichi.analysis.frame import count_frames
from dusttaichi.errors import DustError
from dusttaichi.results.files import explain

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


__all__ = ["export"]

_NEEDS = {"vtk": "meshio", "extxyz": "ase"}


def export(
    run: Run, to: str, output: str | Path | None = None, snapshot: int | str = "all"
) -> list[Path]:
    """Write snapshots of a run for another program; files of the same names are overwritten.

    Parameters
    ----------
    run : Run
    to : str
        "vtk" for ParaView, "extxyz" for ASE and OVITO, "lammps" (dumps) for LAMMPS
        and OVITO, "lammps-data" and "lammps-restart" for LAMMPS; runs of the continuum "vtk" only.
    output : path, optional
        Directory. Default: one of the format's name beside the result.
    snapshot : int or str
        Number, from the end if negative, or "all".

    Returns
    -------
    list of pathlib.Path
        The files, the main file first.

    Raises
    ------
    DustError
        The format or the snapshot does not exist, the library of the format is not installed, or
        the files cannot be written.
    """
    write = _get_writer(run, to)
    numbers = range(count_frames(run)) if snapshot == "all" else [snapshot]
    frames = (run.method.read(run, number) for number in numbers)
    folder = Path(output) if output is not None else run.path.parent / to
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return write(run, frames, folder)
    except OSError as error:
        problem = explain(error, folder / to)
        raise DustError(f"Cannot write to {folder}: {problem}.") from error


def _get_writer(run: Run, to: str) -> Callable[..., list[Path]]:
    run_method = run.method
    if to not in run_method.exports:
        allowed = ", ".join(run_method.exports) or "none"
        raise DustError(
            f'A run of method: {run_method.name} has no format "{to}"; allowed: {allowed}.'
        )
    try:
        return run_method.writer(to)
    except ModuleNotFoundError as error:
        library = _NEEDS.get(to)
        if error.name != library:
            raise
        raise DustError(
            f"{library} is not installed, and only the export to {to} needs it; to get it: "
            "pip install 'dusttaichi[export]'"
        ) from None
