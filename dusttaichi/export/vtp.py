"""VTP for ParaView and Blender: the surfaces of the grains with their colours, SI, one a snapshot.

Unlike the points of `vtk` they need no filter to be seen. Every point has the `grain` that it
belongs to, its `radius`, `speed` and `coordination`, and an RGB `colour` by one of these.
"""

import base64

import numpy as np

from dusttaichi.export.colours import colours_of
from dusttaichi.export.spheres import surfaces
from dusttaichi.results.outputs import check

MARK = "<!-- spheres in m, written by dusttaichi -->"
TYPES = {"f4": "Float32", "i4": "Int32", "u1": "UInt8"}


def write(run, frames, folder):
    """Write the frames to `folder`. Returns the paths."""
    return [_write_one(run, frame, folder / f"grains_{frame.number:04d}.vtp") for frame in frames]


def _write_one(run, frame, path):
    points, triangles = surfaces(frame)
    count, each = points.shape[:2]
    corners = (each * np.arange(count)[:, None, None] + triangles).reshape(-1, 3)
    of_grains = {
        "grain": np.arange(count),
        "radius": frame.radius,
        "speed": np.linalg.norm(frame.velocity, axis=1),
        "coordination": None if frame.contacts is None else frame.coordination,
        "colour": np.round(255 * colours_of(run, frame)).astype("u1"),
    }
    data = [
        _array(name, np.repeat(values, each, axis=0))
        for name, values in of_grains.items()
        if values is not None
    ]
    ends = 3 * np.arange(1, len(corners) + 1)
    text = [
        '<?xml version="1.0"?>',
        MARK,
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        f'<PolyData><Piece NumberOfPoints="{count * each}" NumberOfPolys="{len(corners)}">',
        f"<Points>{_array('points', points.reshape(-1, 3))}</Points>",
        f"<Polys>{_array('connectivity', corners.ravel())}{_array('offsets', ends)}</Polys>",
        f'<PointData Scalars="colour">{"".join(data)}</PointData>',
        "</Piece></PolyData></VTKFile>",
    ]
    check(path, MARK).write_text("\n".join(text), encoding="ascii")
    return path


def _array(name, values):
    """A DataArray of an array, (rows,) or (rows, 3), in base64."""
    kind = "f4" if values.dtype.kind == "f" else "u1" if values.dtype == np.uint8 else "i4"
    values = np.ascontiguousarray(values, dtype=f"<{kind}")
    raw = np.uint64(values.nbytes).tobytes() + values.tobytes()
    across = values.shape[1] if values.ndim > 1 else 1
    about = f'type="{TYPES[kind]}" Name="{name}" NumberOfComponents="{across}" format="binary"'
    return f"<DataArray {about}>{base64.b64encode(raw).decode()}</DataArray>"
