"""LAMMPS dump files (also for OVITO), in `units micro` of LAMMPS.

Lengths in µm, times in µs, masses in pg, hence velocities in m/s and spins in rad/µs. grains.dump
is a `dump custom`, contacts.dump a `dump local` whose batom1 and batom2 are the ids of the grains:
OVITO reads it with the modifier "Load trajectory"; wall_contacts.dump has the grain and the number
of the wall of every wall contact. Forces are in nN: the sum over all contacts of a grain, and those
of each contact, on its first grain. The type is the number of the material, from 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.frame import read_grain_masses
from dusttaichi.results.outputs import check
from dusttaichi.units import FORCE, LENGTH, MASS, SPEED, SPIN, TIME

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


GRAINS, CONTACTS, WALL_CONTACTS = "grains.dump", "contacts.dump", "wall_contacts.dump"
GRAIN_COLUMNS = "id type x y z vx vy vz radius mass omegax omegay omegaz"
UNITS = "ITEM: UNITS\nmicro"
CONTACT_COLUMNS = "index batom1 batom2 overlap twist approach"
WALL_COLUMNS = "index id wall overlap twist approach"
TOTAL, OF_EACH = " fx fy fz", " normal fx fy fz"  # where the result has forces


def write(run: Run, frames: Iterable[Frame], folder: Path) -> list[Path]:
    """Write the frames to `folder`. Returns the paths, that of the grains first."""
    masses = read_grain_masses(run) / MASS
    with ExitStack() as stack:
        files = {}

        def file(name: str) -> TextIO:
            if name not in files:
                path = check(folder / name, UNITS)
                files[name] = stack.enter_context(path.open("w", encoding="ascii"))
            return files[name]

        for frame in frames:
            bounds, forces = _format_bounds(frame), frame.forces
            header = _format_header(frame, bounds, "ATOMS")
            rows, has_forces = _append_forces(
                _tabulate_grains(frame, masses), None if forces is None else forces[0]
            )
            _write_item(file(GRAINS), header, GRAIN_COLUMNS + TOTAL * has_forces, rows)
            header = _format_header(frame, bounds, "ENTRIES")
            if frame.contacts is not None:
                pushes = None if forces is None else _collect_forces(frame.contacts, forces[1])
                rows, has_forces = _append_forces(
                    _tabulate_contacts(frame.contacts, frame.pairs + 1), pushes
                )
                _write_item(file(CONTACTS), header, CONTACT_COLUMNS + OF_EACH * has_forces, rows)
            if frame.wall_contacts is not None:
                parts = None if forces is None else forces.walls
                pushes = None if parts is None else _collect_forces(frame.wall_contacts, parts)
                wall_contacts = frame.wall_contacts
                ends = np.column_stack([wall_contacts.grain.values + 1, wall_contacts.wall.values])
                rows, has_forces = _append_forces(_tabulate_contacts(wall_contacts, ends), pushes)
                _write_item(file(WALL_CONTACTS), header, WALL_COLUMNS + OF_EACH * has_forces, rows)
    return [folder / name for name in files]


def _append_forces(
    rows: NDArray[np.float64], forces: NDArray[np.float64] | None
) -> tuple[NDArray[np.float64], bool]:
    """(rows with forces [N] as further columns [nN], True); or (rows, False) without any."""
    if forces is None:
        return rows, False
    return np.column_stack([rows, forces / FORCE]), True


def _collect_forces(
    contacts: xr.Dataset, force_components: Mapping[str, NDArray[np.float64]]
) -> NDArray[np.float64]:
    return np.column_stack([force_components["normal_force"], contacts.force.values.astype(float)])


def _format_header(frame: Frame, bounds: str, entry_name: str) -> str:
    """Header of LAMMPS with `dump_modify units yes time yes`; {} for the number of rows."""
    return (
        f"{UNITS}\nITEM: TIME\n{frame.time / TIME:.16g}\nITEM: TIMESTEP\n{frame.step}\n"
        f"ITEM: NUMBER OF {entry_name}\n{{}}\n{bounds}ITEM: {entry_name} "
    )


def _write_item(file: TextIO, header: str, columns: str, rows: NDArray[np.float64]) -> None:
    """Write a snapshot: its header and its rows."""
    file.write(f"{header.format(len(rows))}{columns}\n")
    integer_columns = {"id", "type", "index", "batom1", "batom2", "wall"}
    formats = ["%d" if name in integer_columns else "%.16g" for name in columns.split()]
    np.savetxt(file, rows, fmt=" ".join(formats))


def _format_bounds(frame: Frame) -> str:
    """BOX BOUNDS: of a cell that is sheared about its centre those of all its corners."""
    ends, styles = find_box_ends(frame), choose_boundary_styles(frame)
    ends[0] += 0.5 * abs(frame.tilt) * np.array([-1.0, 1.0])
    lines = [f"{low:.16g} {high:.16g}\n" for low, high in ends / LENGTH]
    if frame.tilt:
        tilts = ("0", f"{frame.tilt / LENGTH:.16g}", "0")
        lines = [f"{line[:-1]} {tilt}\n" for line, tilt in zip(lines, tilts, strict=True)]
        styles = ["xy xz yz", *styles]
    return f"ITEM: BOX BOUNDS {' '.join(styles)}\n" + "".join(lines)


def find_box_ends(frame: Frame) -> NDArray[np.float64]:
    """Lower and upper end of the box along each axis [m], (3, 2).

    Walls and faces of the cell, or the outermost surface of a grain.
    """
    low = (frame.position - frame.radius[:, None]).min(axis=0)
    high = (frame.position + frame.radius[:, None]).max(axis=0)
    return np.where(np.isnan(frame.cell), np.stack([low, high], axis=1), frame.cell)


def number_types(frame: Frame) -> NDArray[np.integer]:
    """Type of each grain, (N,): the number of its material, from 1."""
    single: NDArray[np.integer] = np.zeros(len(frame.radius), int)
    return (single if frame.material is None else frame.material) + 1


def choose_boundary_styles(frame: Frame) -> list[str]:
    """Boundary style of LAMMPS along each axis: p periodic, f a wall, s open."""
    walls = np.where(np.isnan(frame.cell), "s", "f")
    return [
        "pp" if periodic else "".join(ends)
        for periodic, ends in zip(frame.periodic, walls, strict=True)
    ]


def _tabulate_grains(frame: Frame, masses: NDArray[np.float64]) -> NDArray[np.float64]:
    ids, atom_type = np.arange(1, len(masses) + 1), number_types(frame)
    state = frame.position / LENGTH, frame.velocity / SPEED, frame.radius / LENGTH
    return np.column_stack([ids, atom_type, *state, masses, frame.spin / SPIN])


def _tabulate_contacts(contacts: xr.Dataset, ends: NDArray[np.integer]) -> NDArray[np.float64]:
    numbers, overlap = np.arange(1, len(ends) + 1), contacts.overlap.values / LENGTH
    twist, approach = contacts.twist.values, contacts.approach.values / SPEED
    return np.column_stack([numbers, ends, overlap, twist, approach])
