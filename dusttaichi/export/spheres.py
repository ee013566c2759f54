"""Spheres as triangles, for programs that know no spheres: an icosahedron made rounder."""

import numpy as np

FINE = 2000  # grains up to which a sphere has 320 triangles; of more each has 80


def unit_sphere(rounds):
    """Points (P, 3) and triangles (T, 3) of a sphere of radius 1, 20 * 4 ** rounds triangles.

    Triangles are numbers of points, outwards.
    """
    golden = 0.5 * (1.0 + 5.0**0.5)
    flat = [(x, y * golden, 0.0) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    points = np.array([np.roll(p, turn) for turn in range(3) for p in flat])
    points /= np.linalg.norm(points[0])
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    near = (apart < 1.1) & (apart > 0.0)
    triangles = np.array(
        [(i, j, k) for i in range(12) for j in range(i) for k in range(j)
         if near[i, j] and near[j, k] and near[i, k]]
    )  # fmt: skip
    for _ in range(rounds):
        points, triangles = _halved(points, triangles)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return points, triangles


def _halved(points, triangles):
    """Each edge halved and its middle put onto the sphere: four triangles of each."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    single, number = np.unique(edges, axis=0, return_inverse=True)
    middles = points[single].mean(axis=1)
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    ab, bc, ca = (len(points) + number.reshape(-1, 3)).T
    a, b, c = triangles.T
    finer = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.concatenate([points, middles]), np.concatenate([np.stack(t, axis=1) for t in finer])


def surfaces(frame):
    """(points (N, P, 3) [m], triangles (T, 3)): the same triangles of the points of each grain."""
    points, triangles = unit_sphere(2 if len(frame.radius) <= FINE else 1)
    return frame.position[:, None] + frame.radius[:, None, None] * points, triangles
