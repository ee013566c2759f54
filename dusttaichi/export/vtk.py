"""VTK for ParaView: a .vtu file a snapshot, and a .pvd file that gives them their times.

Everything is in SI, as in the result. Points are grains, or particles of a continuum: vertex cells,
and point data. Contacts are line cells between their grains, with cell data; vertex cells have "not
a number" there. Contacts with walls are points of files of their own, where they touch the wall.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import meshio
import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.frame import read_grain_masses
from dusttaichi.results import roles
from dusttaichi.results.outputs import check
from dusttaichi.results.variables import LABELS

if TYPE_CHECKING:
    from dusttaichi.analysis.frame import Frame
    from dusttaichi.analysis.run import Run


POINT_UNITS = {"radius": "m", "velocity": "m/s", "spin": "rad/s", "coordination": "1"}
MORE_POINTS = {
    "material": "number of the material, 0 the scene's material",
    "mass": "kg",
    "force": "N, of contacts and walls together",
    "orientation": "rotation since the start, a unit quaternion w x y z",
}
FORCE_UNITS = {
    "normal_force": "N, positive for repulsion",
    "sliding_force": "N, on the first grain",
    "rolling_moment": "N m, on the first grain",
    "twisting_moment": "N m, on the first grain",
}
CELL_UNITS = {
    "overlap": "m",
    "twist": "rad",
    "approach": "m/s",
    "rolling": "m, length of the rolling displacement R (n1 + n2)",
    "across": "1 if the contact crosses a periodic face, so that its line is too long",
}
PARTICLE_UNITS = {
    "density": "kg/m^3",
    "filling_factor": "1, not a number for other particles than dust",
    "pressure": "Pa",
    "deviator": "Pa, a tensor xx xy xz yx yy yz zx zy zz",
    "mass": "kg, kg/m in two dimensions",
    "size": "m, distance of particles in a close packing of such volumes",
    "role": roles.MEANING,
    "body": "number of the body",
}
COLLECTION = "grains.pvd"
WALLS = "wall_contacts.pvd"
_UNITS = {
    "points": "m",
    "time": "s",
    **POINT_UNITS,
    **MORE_POINTS,
    **CELL_UNITS,
    **FORCE_UNITS,
    **PARTICLE_UNITS,
    "wall": f"number of the wall: {', '.join((*LABELS['wall'], 'tube', 'surfaces'))}",
}
MARK = "<!-- Units, by dusttaichi"
_COMMENT = f"{MARK}\n" + "".join(f"{name}: {unit}\n" for name, unit in _UNITS.items()) + "-->"


def write(run: Run, frames: Iterable[Frame], folder: Path) -> list[Path]:
    """Write the frames to `folder`. Returns the paths, that of the collection first."""
    masses, frames = read_grain_masses(run), list(frames)
    paths = _write_collection(folder / COLLECTION, ((f, make_mesh(f, masses)) for f in frames))
    if any(f.wall_contacts is not None for f in frames):
        paths += _write_collection(folder / WALLS, ((f, make_wall_mesh(f)) for f in frames))
    return paths


def write_particles(run: Run, frames: Iterable[Any], folder: Path) -> list[Path]:
    """Write the frames of a run of the continuum to `folder`. Returns the paths."""
    return _write_collection(folder / "dust.pvd", ((f, make_particle_mesh(f)) for f in frames))


def _write_collection(path: Path, meshes: Iterable[tuple[Any, meshio.Mesh]]) -> list[Path]:
    """Write meshes, (frame, meshio.Mesh), and the collection at `path`. Returns the paths."""
    root = ET.Element("VTKFile", type="Collection", version="0.1")
    collection, paths = ET.SubElement(root, "Collection"), [path]
    for frame, mesh_of_frame in meshes:
        paths.append(path.with_name(f"{path.stem}_{frame.number:04d}.vtu"))
        mesh_of_frame.write(check(paths[-1], MARK))
        _insert_units(paths[-1])
        ET.SubElement(collection, "DataSet", timestep=repr(frame.time), file=paths[-1].name)
    check(path, MARK)
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    _insert_units(path)
    return paths


def _insert_units(path: Path) -> None:
    """Insert a comment below the XML declaration: VTK has no field for units."""
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("?>", f"?>\n{_COMMENT}", 1), encoding="utf-8")


def make_particle_mesh(frame: Any) -> meshio.Mesh:
    """Make a meshio.Mesh of a ParticleFrame, SI."""
    xx, yy, zz, xy, xz, yz = frame.deviator.T
    tensor = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1)
    points = {name: getattr(frame, name) for name in PARTICLE_UNITS} | {"velocity": frame.velocity}
    points |= {name: points[name].astype(float) for name in ("role", "body")}
    cells = [("vertex", np.arange(len(frame.position))[:, None])]
    return meshio.Mesh(frame.position, cells, point_data=points | {"deviator": tensor})


def make_mesh(frame: Frame, masses: NDArray[np.float64]) -> meshio.Mesh:
    """Make a meshio.Mesh of a Frame, SI; the masses of its grains [kg], (N,)."""
    grains, forces = len(frame.radius), frame.forces
    points: dict[str, NDArray[Any]] = {"radius": frame.radius, "velocity": frame.velocity}
    material = np.zeros(grains) if frame.material is None else frame.material.astype(float)
    points |= {"spin": frame.spin, "material": material, "mass": masses}
    points |= {} if frame.orientation is None else {"orientation": frame.orientation}
    points |= {} if forces is None else {"force": forces[0]}
    cells = [("vertex", np.arange(grains)[:, None])]
    data = {}
    if frame.contacts is not None:
        points["coordination"] = frame.coordination
        # a block without cells confuses readers
        if len(frame.pairs):
            cells.append(("line", frame.pairs))
            contact_data = _collect_contact_data(frame) | ({} if forces is None else forces[1])
            data = {
                name: [np.full((grains, *values.shape[1:]), np.nan), values]
                for name, values in contact_data.items()
            }
    return meshio.Mesh(frame.position, cells, point_data=points, cell_data=data)


def make_wall_mesh(frame: Frame) -> meshio.Mesh:
    """Make a meshio.Mesh of the wall contacts of a Frame: points on the walls, SI."""
    contacts, forces = frame.require_wall_contacts(), frame.forces
    points = {name: contacts[name].values.astype(float) for name in ("grain", "wall", "overlap")}
    points |= {} if forces is None else forces.walls or {}
    positions = frame.wall_points
    return meshio.Mesh(
        positions, [("vertex", np.arange(len(positions))[:, None])], point_data=points
    )


def _collect_contact_data(frame: Frame) -> dict[str, NDArray[np.float64]]:
    """Cell data of the lines, each (C,) float."""
    contacts, (i, j) = frame.require_contacts(), frame.pairs.T
    separation = frame.position[i] - frame.position[j]
    return {
        "overlap": contacts.overlap.values,
        "twist": contacts.twist.values,
        "approach": contacts.approach.values,
        "rolling": frame.rolling,
        "across": (frame.nearest(separation) != separation).any(axis=1).astype(float),
    }
