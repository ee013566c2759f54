"""STL for CAD and 3-D printers: the surfaces of the grains, a binary file a snapshot, in µm."""

import numpy as np

from dusttaichi.export.spheres import surfaces
from dusttaichi.results.outputs import check
from dusttaichi.units import LENGTH

MARK = "spheres in um, written by dusttaichi"
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])


def write(run, frames, folder):
    """Write the frames to `folder`. Returns the paths."""
    return [_write_one(frame, folder / f"grains_{frame.number:04d}.stl") for frame in frames]


def _write_one(frame, path):
    points, triangles = surfaces(frame)
    corners = (points / LENGTH)[:, triangles].reshape(-1, 3, 3)
    facets = np.zeros(len(corners), FACET)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets["normal"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    facets["corners"] = corners
    with check(path, MARK).open("wb") as file:
        file.write(MARK.encode("ascii").ljust(80))
        file.write(np.uint32(len(facets)).tobytes())
        file.write(facets.tobytes())
    return path
