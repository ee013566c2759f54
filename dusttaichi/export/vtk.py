"""VTK for ParaView: a .vtu file a snapshot, and a .pvd file that gives them their times.

Everything is in SI, as in the result. Points are grains, or particles of a continuum: vertex cells,
and point data. Contacts are line cells between their grains, with cell data; vertex cells have "not
a number" there.
"""

import xml.etree.ElementTree as ET

import meshio
import numpy as np

from dusttaichi.physics.contact.constants import reduced_radius

POINT_UNITS = {"radius": "m", "velocity": "m/s", "spin": "rad/s", "coordination": "1"}
CELL_UNITS = {
    "overlap": "m",
    "twist": "rad",
    "approach": "m/s",
    "rolling": "m, length of the rolling displacement R (n1 + n2)",
    "across": "1 where the contact passes through a periodic face, so that its line is too long",
}
PARTICLE_UNITS = {
    "density": "kg/m^3",
    "filling_factor": "1, not a number of what is not dust",
    "pressure": "Pa",
    "deviator": "Pa, a tensor xx xy xz yx yy yz zx zy zz",
    "mass": "kg, kg/m in two dimensions",
    "size": "m, distance of particles in a close packing of such volumes",
    "role": "0 dust, 1 rigid, 2 held, 3 wall",
    "body": "number of the body",
}
COLLECTION = "grains.pvd"
_UNITS = {"points": "m", "time": "s", **POINT_UNITS, **CELL_UNITS, **PARTICLE_UNITS}
_COMMENT = "<!-- Units\n" + "".join(f"{name}: {unit}\n" for name, unit in _UNITS.items()) + "-->"


def write(run, frames, folder):
    """Write the frames to `folder`. Returns the paths, that of the collection first."""
    listed = ET.Element("VTKFile", type="Collection", version="0.1")
    collection = ET.SubElement(listed, "Collection")
    paths = [folder / ("dust.pvd" if run.is_continuum else COLLECTION)]
    for frame in frames:
        name, drawn = ("dust", particles) if run.is_continuum else ("grains", mesh)
        paths.append(folder / f"{name}_{frame.number:04d}.vtu")
        drawn(frame).write(paths[-1])
        _state_units(paths[-1])
        ET.SubElement(collection, "DataSet", timestep=repr(frame.time), file=paths[-1].name)
    ET.indent(listed)
    ET.ElementTree(listed).write(paths[0], encoding="utf-8", xml_declaration=True)
    _state_units(paths[0])
    return paths


def _state_units(path):
    """A comment below the XML declaration: VTK has no place for units."""
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("?>", f"?>\n{_COMMENT}", 1), encoding="utf-8")


def particles(frame):
    """A ParticleFrame as a meshio.Mesh, SI."""
    xx, yy, zz, xy, xz, yz = frame.deviator.T
    tensor = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1)
    points = {name: getattr(frame, name) for name in PARTICLE_UNITS} | {"velocity": frame.velocity}
    points |= {name: points[name].astype(float) for name in ("role", "body")}
    cells = [("vertex", np.arange(len(frame.position))[:, None])]
    return meshio.Mesh(frame.position, cells, point_data=points | {"deviator": tensor})


def mesh(frame):
    """A Frame as a meshio.Mesh, SI."""
    grains = len(frame.radius)
    points = {"radius": frame.radius, "velocity": frame.velocity, "spin": frame.spin}
    cells = [("vertex", np.arange(grains)[:, None])]
    data = {}
    if frame.contacts is not None:
        points["coordination"] = frame.coordination
        # a block without cells confuses readers
        if len(frame.pairs):
            cells.append(("line", frame.pairs))
            blank = np.full(grains, np.nan)
            data = {name: [blank, values] for name, values in _contact_data(frame).items()}
    return meshio.Mesh(frame.position, cells, point_data=points, cell_data=data)


def _contact_data(frame):
    """Cell data of the lines, each (C,) float."""
    contacts, (i, j) = frame.contacts, frame.pairs.T
    separation = frame.position[i] - frame.position[j]
    reach = reduced_radius(frame.radius[i], frame.radius[j])
    sum_of_pointers = contacts.pointer_i.values + contacts.pointer_j.values
    return {
        "overlap": contacts.overlap.values,
        "twist": contacts.twist.values,
        "approach": contacts.approach.values,
        "rolling": reach * np.linalg.norm(sum_of_pointers, axis=1),
        "across": (frame.nearest(separation) != separation).any(axis=1).astype(float),
    }
