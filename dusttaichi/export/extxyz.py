"""Extended XYZ for ASE and OVITO: all snapshots in one file, in ASE's units.

Positions, radii and cell in Angstrom, masses in u, momenta in ASE's units, so that
`atoms.get_velocities()` is right, in addition `velocity_m_per_s` and `spin_rad_per_s`. `Origin` is
the lower corner of the cell for OVITO; cells of ASE begin at 0. The format has no contacts; each
grain has its `coordination`, its number of `wall_contacts`, and the `force_N` of all of them;
`material` is the number of its material; OVITO applies `radius` and `color` by default.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ase import Atoms
from ase import units as ase_units
from ase.io import write as ase_write
from numpy.typing import NDArray

from dusttaichi.analysis.frame import read_grain_masses
from dusttaichi.plots.grain_picture import choose_appearance, colour_grains, number_bodies
from dusttaichi.results.outputs import check

if TYPE_CHECKING:
    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


FILE = "grains.extxyz"
ANGSTROM = 1e-10  # [m]
DALTON = 1.0 / ase_units.kg  # [kg]
UNITS = "pos, radius, Lattice, Origin: Angstrom; masses: u; momenta: ASE; time_s: s"


def write(run: Run, frames: Iterable[Frame], folder: Path) -> list[Path]:
    """Write the frames to one file in `folder`. Returns its path in a list."""
    masses = read_grain_masses(run)
    images = []
    for frame in frames:
        image = make_atoms(frame, masses)
        image.set_array("color", np.round(_compute_colours(run, frame), 3))  # for OVITO
        images.append(image)
    ase_write(check(folder / FILE, UNITS), images, format="extxyz")
    return [folder / FILE]


def make_atoms(frame: Frame, masses: NDArray[np.float64]) -> Atoms:
    """Make ase.Atoms of a Frame; the masses of its grains [kg], (N,)."""
    bounded = np.isfinite(frame.edges)
    shift = np.array([0.5 * frame.tilt, 0.0, 0.0])  # a cell is sheared about its centre
    image = Atoms(
        numbers=np.zeros(len(masses), dtype=int),  # "X": no chemical element
        positions=frame.position / ANGSTROM,
        masses=masses / DALTON,
        cell=_compute_cell(frame, bounded) / ANGSTROM,
        pbc=frame.periodic,
        info={
            "Origin": (np.where(bounded, frame.cell[:, 0], 0.0) - shift) / ANGSTROM,
            "time_s": frame.time,
            "step": frame.step,
            "units": UNITS,
        },
    )
    image.set_velocities(frame.velocity * ase_units.m / ase_units.second)
    image.set_array("radius", frame.radius / ANGSTROM)
    image.set_array("velocity_m_per_s", frame.velocity)
    image.set_array("spin_rad_per_s", frame.spin)
    image.set_array("material", frame.material)
    if frame.orientation is not None:
        image.set_array("orientation", frame.orientation)
    if frame.contacts is not None:
        image.set_array("coordination", frame.coordination)
    if frame.wall_contacts is not None:
        touching = frame.wall_contacts.grain.values.astype(int)
        image.set_array("wall_contacts", np.bincount(touching, minlength=len(masses)))
    if (forces := frame.forces) is not None:
        image.set_array("force_N", forces[0])
    return image


def _compute_colours(run: Run, frame: Frame) -> NDArray[np.float64]:
    """Colours of the grains of a Frame, (N, 3) of 0 to 1.

    By body for a collision, else by coordination number, or height without contacts.
    """
    color = "body" if run.collides else "height" if frame.contacts is None else "coordination"
    appearance = choose_appearance([frame], color, "front", bodies=number_bodies(run, color))
    return np.asarray(colour_grains(frame, appearance, None).colours)


def _compute_cell(frame: Frame, bounded: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Vectors of the cell [m], (3, 3), with the tilt of a sheared cell."""
    vectors = np.diag(np.where(bounded, frame.edges, 0.0))
    vectors[2, 0] = frame.tilt
    return vectors
