"""LAMMPS dump files, for OVITO and what else reads them, in LAMMPS's `units micro`.

Lengths in um, times in us, masses in pg, so velocities in m/s and spins in rad/us.
grains.dump is a `dump custom`, contacts.dump a `dump local` whose batom1 and batom2 are the ids
of the grains: OVITO takes it with the modifier "Load trajectory".
"""

import numpy as np

from dusttaichi.analysis.frame import grain_masses
from dusttaichi.units import LENGTH, MASS, SPEED, SPIN, TIME

GRAINS, CONTACTS = "grains.dump", "contacts.dump"
GRAIN_COLUMNS = "id type x y z vx vy vz radius mass omegax omegay omegaz"
CONTACT_COLUMNS = "index batom1 batom2 overlap twist approach"


def write(run, frames, folder):
    """Write the frames to `folder`. Returns the paths, that of the grains first."""
    masses = grain_masses(run) / MASS
    paths = [folder / GRAINS]
    contacts = None
    with paths[0].open("w", encoding="ascii") as grains:
        try:
            for frame in frames:
                bounds = _bounds(frame)
                header = _header(frame, bounds, "ATOMS")
                _item(grains, header, GRAIN_COLUMNS, _grains(frame, masses))
                if frame.contacts is None:
                    continue
                if contacts is None:
                    paths.append(folder / CONTACTS)
                    contacts = paths[-1].open("w", encoding="ascii")
                header = _header(frame, bounds, "ENTRIES")
                _item(contacts, header, CONTACT_COLUMNS, _contacts(frame))
        finally:
            if contacts is not None:
                contacts.close()
    return paths


def _header(frame, bounds, kind):
    """The lines above the columns as LAMMPS writes them with `dump_modify units yes time yes`; {}
    stands where the number of rows goes."""
    return (
        f"ITEM: UNITS\nmicro\nITEM: TIME\n{frame.time / TIME:.16g}\nITEM: TIMESTEP\n{frame.step}\n"
        f"ITEM: NUMBER OF {kind}\n{{}}\n{bounds}ITEM: {kind} "
    )


def _item(file, header, columns, rows):
    """One snapshot: its header and its rows."""
    file.write(f"{header.format(len(rows))}{columns}\n")
    whole = {"id", "type", "index", "batom1", "batom2"}
    formats = ["%d" if name in whole else "%.16g" for name in columns.split()]
    np.savetxt(file, rows, fmt=" ".join(formats))


def _bounds(frame):
    """BOX BOUNDS: p periodic, f at a wall, s (the outermost surface) where there is nothing."""
    low = (frame.position - frame.radius[:, None]).min(axis=0)
    high = (frame.position + frame.radius[:, None]).max(axis=0)
    kinds, lines = [], []
    for axis in range(3):
        ends = []
        for at, free in zip(frame.cell[axis], (low[axis], high[axis]), strict=True):
            ends.append(free if np.isnan(at) else at)
        walls = ["s" if np.isnan(at) else "f" for at in frame.cell[axis]]
        kinds.append("pp" if frame.periodic[axis] else "".join(walls))
        # of a cell that leans about its centre the bounds are those of all its corners
        wider = 0.5 * abs(frame.tilt) if axis == 0 else 0.0
        ends = [ends[0] - wider, ends[1] + wider]
        lines.append(f"{ends[0] / LENGTH:.16g} {ends[1] / LENGTH:.16g}\n")
    if frame.tilt:
        tilts = ("0", f"{frame.tilt / LENGTH:.16g}", "0")
        lines = [f"{line[:-1]} {tilt}\n" for line, tilt in zip(lines, tilts, strict=True)]
        kinds = ["xy xz yz", *kinds]
    return f"ITEM: BOX BOUNDS {' '.join(kinds)}\n" + "".join(lines)


def _grains(frame, masses):
    count = len(masses)
    return np.column_stack(
        [
            np.arange(1, count + 1),
            np.ones(count),
            frame.position / LENGTH,
            frame.velocity / SPEED,
            frame.radius / LENGTH,
            masses,
            frame.spin / SPIN,
        ]
    )


def _contacts(frame):
    contacts = frame.contacts
    return np.column_stack(
        [
            np.arange(1, len(frame.pairs) + 1),
            frame.pairs + 1,
            contacts.overlap.values / LENGTH,
            contacts.twist.values,
            contacts.approach.values / SPEED,
        ]
    )
