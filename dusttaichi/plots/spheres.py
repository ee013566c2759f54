"""Shaded spheres and straight lines in one picture, in parallel projection, with a depth buffer.

Each pixel is sampled SAMPLES x SAMPLES times; each sample takes the sphere that is nearest to the
viewer, and its shade from the sphere's normal there. The picture is made in bands of rows, so that
the buffers stay small at any size.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import NDArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


Reals = NDArray[np.floating[Any]]  # of 32 or 64 bits

SAMPLES = 3  # per pixel and direction: edges in ten steps
BAND = 64  # rows of pixels at a time
LIGHT = np.array([-0.4, 0.55, 0.73])  # right, up, to the viewer: from the upper left
AMBIENT, DIFFUSE, GLOSS, SHARPNESS = 0.52, 0.68, 0.18, 24.0
UPPER = 0.15  # excess of the ambient light from above
RIM = 0.45  # darkening at the rim of a sphere, as a contrast to its neighbours
OCCLUSION = 0.9  # strength, and
OCCLUSION_REACH = 6.0  # reach, in radii of the largest sphere, of the shade of neighbours
SHADOW = 0.5  # share of the direct light that a sphere blocks; the rest is scattered light
SOFTNESS = 0.06  # of the edge of a shadow, in radii
HALO = (2.4, 0.6)  # of lines in front of spheres: width over that of the line, paleness
PAPER = np.array([1.0, 1.0, 1.0])


@dataclass(frozen=True)
class Camera:
    """A parallel projection. axes: (3, 3), rows right, up and towards the viewer.

    low, high: (2,) ends of the picture along right and up [m]. width, height: in pixels.
    """

    axes: Reals
    low: Reals
    high: Reals
    width: int
    height: int

    @property
    def scale(self) -> float:
        """Pixels a metre."""
        return float(self.width / (self.high[0] - self.low[0]))

    def project(self, points: Reals, samples: int = 1) -> Reals:
        """Column, row (downwards) and depth (towards the viewer) of points [m], (..., 3).

        In pixels, or in samples of a pixel.
        """
        seen = points @ self.axes.T
        scale = self.scale * samples
        return np.stack(
            [
                (seen[..., 0] - self.low[0]) * scale,
                (self.high[1] - seen[..., 1]) * scale,
                seen[..., 2] * scale,
            ],
            axis=-1,
        )


def compute_camera_axes(view: ArrayLike) -> Reals:
    """Compute the axes of a Camera that looks from the direction `view`, (3,): z upwards or y."""
    towards = np.asarray(view, dtype=float) / np.linalg.norm(view)
    up = np.array([0.0, 1.0, 0.0]) if abs(towards[2]) > 0.999 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


@dataclass(frozen=True)
class Lines:
    """Straight lines: ends (L, 2, 3) [m]; dashed (L,) bool; colour (3,); width [pixels]."""

    ends: Reals
    dashed: NDArray[np.bool_]
    colour: tuple[float, float, float] = (0.25, 0.25, 0.25)
    width: float = 2.0


def render_spheres(
    camera: Camera,
    position: Reals,
    radius: Reals,
    colour: Reals,
    *,
    lines: Lines | None = None,
    samples: int = SAMPLES,
) -> Reals:
    """Render spheres and lines in the view of a camera: (height, width, 3) floats from 0 to 1.

    position (N, 3), radius (N,) [m]; colour (N, 3). Nearer objects hide farther ones, spheres and
    lines.
    """
    centre = camera.project(position, samples)
    size = radius * camera.scale * samples
    hidden = compute_occlusion(position, radius)
    hidden[:, 1:] = hidden[:, 1:] @ camera.axes.T  # shades are computed in the camera's axes
    shadows = Shadows(centre / samples, size / samples, samples)
    spheres = (centre, size, np.asarray(colour, np.float32), hidden.astype(np.float32), shadows)
    if lines is not None:
        core, halo = (_sample_lines(camera, lines, samples, wider) for wider in (1.0, HALO[0]))
    image = np.empty((camera.height, camera.width, 3), dtype=np.float32)
    for first in range(0, camera.height, BAND):
        last = min(first + BAND, camera.height)
        band = _render_band(first * samples, last * samples, camera.width * samples, spheres)
        if lines is not None:
            _draw_halo(*band, halo, first * samples)
            band[0][_find_visible(band[1], core, first * samples)] = lines.colour
        rows = band[0].reshape(last - first, samples, camera.width, samples, 3)
        image[first:last] = rows.mean(axis=(1, 3))
    return np.clip(image, 0.0, 1.0)


def compute_occlusion(position: Reals, radius: Reals) -> Reals:
    """Ambient occlusion of each sphere by its neighbours: (N, 4), a mean and a vector.

    A point of the surface with normal n sees exp(-OCCLUSION (mean + vector . n)) of the light from
    all around. A sphere of radius r at distance d and direction e hides (r/d)^2 max(0, n . e) of
    it, taken to first order in n: (r/d)^2 (1/4 + n . e/2).
    """
    reach = OCCLUSION_REACH * float(radius.max())
    i, j = scipy.spatial.cKDTree(position).query_pairs(reach, output_type="ndarray").T
    between = position[j] - position[i]
    # no nearer than half of touching: spheres in each other have no direction
    distance = np.maximum(np.linalg.norm(between, axis=1), 0.5 * (radius[i] + radius[j]))
    towards = between / distance[:, None]
    out = np.zeros((len(radius), 4))
    for shaded, shading, sign in ((i, j, 1.0), (j, i, -1.0)):
        # decreases to 0 at the end of the reach
        hidden = (radius[shading] / distance) ** 2 * (1.0 - distance / reach)
        out[:, 0] += np.bincount(shaded, 0.25 * hidden, minlength=len(radius))
        for axis in range(3):
            component = 0.5 * sign * hidden * towards[:, axis]
            out[:, 1 + axis] += np.bincount(shaded, component, minlength=len(radius))
    return out


class Shadows:
    """Shadow map: the depth buffer of a second camera, which looks along the light.

    centre (N, 3): column, row, depth in pixels of the first camera; size (N,) in pixels.
    """

    def __init__(self, centre: Reals, size: Reals, samples: int) -> None:
        self.samples, self.softness = samples, max(1.0, SOFTNESS * float(size.max()))
        flipped = centre * (1.0, -1.0, 1.0)
        self.axes = compute_camera_axes(LIGHT)
        seen = flipped @ self.axes.T
        low, high = (seen[:, :2] - size[:, None]).min(axis=0), (seen[:, :2] + size[:, None]).max(0)
        self.corner = low - 4.0 * self.softness
        columns, rows = np.ceil(high - low + 8.0 * self.softness).astype(int)
        self.depth = np.full((rows, columns), -np.inf, dtype=np.float32)
        owner = np.empty(self.depth.shape, dtype=np.int32)
        seen[:, :2] -= self.corner
        for k in range(len(size)):
            _draw_sphere(self.depth, owner, k, seen[k], size[k])

    def sample_shadow(self, column: Reals, row: Reals, depth: Reals, bias: Reals) -> Reals:
        """Shadow of samples of the picture, (S,), from 0 to 1."""
        scale = np.float32(1.0 / self.samples)
        x, y, z = column * scale, -row * scale, depth * scale
        axes = self.axes.astype(np.float32)
        across, up, towards = (a[0] * x + a[1] * y + a[2] * z for a in axes)
        dark = np.zeros(len(x), dtype=np.float32)
        limit = self.depth.shape
        for turn in ((0.4, 1.0), (1.0, -0.4), (-0.4, -1.0), (-1.0, 0.4)):
            i = (up - np.float32(self.corner[1] + turn[1] * self.softness)).astype(np.int32)
            j = (across - np.float32(self.corner[0] + turn[0] * self.softness)).astype(np.int32)
            # samples of a sphere are always inside, up to rounding
            i, j = np.clip(i, 0, limit[0] - 1), np.clip(j, 0, limit[1] - 1)
            dark += self.depth[i, j] > towards + bias
        return np.float32(0.25) * dark


# centres, sizes, colours, occlusions of all spheres (N, ...), and their shadows
Spheres = tuple[Reals, Reals, Reals, Reals, Shadows]


def _render_band(top: int, bottom: int, width: int, spheres: Spheres) -> tuple[Reals, Reals]:
    """Colours (rows, width, 3) and depths (rows, width) of the samples of rows top to bottom."""
    centre, size = spheres[:2]
    depth = np.full((bottom - top, width), -np.inf, dtype=np.float32)
    owner = np.full((bottom - top, width), -1, dtype=np.int32)
    inside = np.flatnonzero((centre[:, 1] + size > top) & (centre[:, 1] - size < bottom))
    for k in inside:
        _draw_sphere(depth, owner, int(k), centre[k] - (0.0, top, 0.0), size[k])
    image = np.empty((*depth.shape, 3), dtype=np.float32)
    image[:] = PAPER
    hit = np.nonzero(owner >= 0)
    column, row = hit[1].astype(np.float32) + 0.5, hit[0].astype(np.float32) + (top + 0.5)
    image[hit] = _shade(column, row, depth[hit], owner[hit], spheres)
    return image, depth


def _draw_sphere(
    depth: Reals, owner: NDArray[np.integer], number: int, centre: Reals, size: float
) -> None:
    """Draw a sphere into the buffers; samples are at half-integer positions."""
    rows, columns = depth.shape
    first_column, last_column = (
        max(int(centre[0] - size), 0),
        min(int(centre[0] + size) + 1, columns),
    )
    first_row, last_row = max(int(centre[1] - size), 0), min(int(centre[1] + size) + 1, rows)
    if first_column >= last_column or first_row >= last_row:
        return
    across = np.arange(first_column, last_column, dtype=np.float32) + np.float32(0.5 - centre[0])
    down = np.arange(first_row, last_row, dtype=np.float32) + np.float32(0.5 - centre[1])
    square = np.float32(size**2) - across**2 - (down**2)[:, None]
    height = np.sqrt(np.maximum(square, 0.0)) + np.float32(centre[2])
    depth_of_region = depth[first_row:last_row, first_column:last_column]
    nearer = (square > 0.0) & (height > depth_of_region)
    np.copyto(depth_of_region, height, where=nearer)
    np.copyto(owner[first_row:last_row, first_column:last_column], number, where=nearer)


def _shade(
    column: Reals, row: Reals, depth: Reals, owner: NDArray[np.integer], spheres: Spheres
) -> Reals:
    """Colours of samples, (S, 3): light from the upper left, gloss, and shade of neighbours."""
    centre, size, colour, hidden, shadows = spheres
    centres, radius = centre[owner].astype(np.float32), size[owner].astype(np.float32)
    x, y = (column - centres[:, 0]) / radius, (centres[:, 1] - row) / radius
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    near = hidden[owner]
    covered = near[:, 0] + near[:, 1] * x + near[:, 2] * y + near[:, 3] * z
    sky = np.exp(-OCCLUSION * np.maximum(covered, 0.0))
    light = (LIGHT / np.linalg.norm(LIGHT)).astype(np.float32)
    facing = np.maximum(light[0] * x + light[1] * y + light[2] * z, 0.0)
    dark = shadows.sample_shadow(column, row, depth, 0.15 * radius / shadows.samples + 1.0)
    half = light + np.array([0.0, 0.0, 1.0], dtype=np.float32)
    half /= np.linalg.norm(half)
    mirrored = np.maximum(half[0] * x + half[1] * y + half[2] * z, 0.0)
    glint = GLOSS * mirrored**SHARPNESS * (1.0 - dark)
    shade = AMBIENT * sky * (1.0 + UPPER * y) + DIFFUSE * facing * (1.0 - SHADOW * dark)
    shade *= 1.0 - RIM * (1.0 - z) ** 2
    shaded: Reals = colour[owner] * shade[:, None] + glint[:, None]
    return shaded


def _sample_lines(camera: Camera, lines: Lines, samples: int, wider: float) -> Reals:
    """Samples on the lines: column, row, depth, (P, 3), half a sample apart, by rising row.

    wider: widths of the line.
    """
    points: list[Reals] = []
    width = lines.width * samples
    aside = np.arange(-0.5 * wider * width, 0.5 * wider * width + 0.25, 0.5)
    for ends, dashed in zip(camera.project(lines.ends, samples), lines.dashed, strict=True):
        along = ends[1, :2] - ends[0, :2]
        length = np.linalg.norm(along)
        if length < 1.0:  # seen end on
            continue
        fractions = np.linspace(0.0, 1.0, int(2 * length) + 2)
        if dashed:
            dashes = max(1, round(length / (12.0 * width)))  # whole ones: both ends are drawn
            fractions = fractions[np.abs((fractions * dashes + 0.5) % 1.0 - 0.5) < 0.3]
        line = ends[0] + fractions[:, None] * (ends[1] - ends[0])
        normal = np.array([-along[1], along[0], 0.0]) / length
        points.append((line[:, None] + aside[:, None] * normal).reshape(-1, 3))
    if not points:
        return np.empty((0, 3))
    all_points = np.concatenate(points)
    return all_points[np.argsort(all_points[:, 1])]


def _find_visible(
    depth: Reals, points: Reals, top: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of a band where points are inside it and nearer than the spheres."""
    rows, columns = depth.shape
    points = points[slice(*np.searchsorted(points[:, 1], (top, top + rows)))]
    points = points[(points[:, 0] >= 0.0) & (points[:, 0] < columns)]
    column, row = points[:, :2].astype(np.int64).T
    row -= top
    seen = points[:, 2] > depth[row, column]
    return row[seen], column[seen]


def _draw_halo(image: Reals, depth: Reals, points: Reals, top: int) -> None:
    """Make the samples paler that are next to a line, so that it shows on dark spheres."""
    row, column = _find_visible(depth, points, top)
    near = np.zeros(depth.shape, dtype=bool)
    near[row, column] = True
    image[near] += HALO[1] * (PAPER - image[near])
