"""Penetration of a rigid sphere into dust of grains or of a continuum.

Its motion, the force on it and the filling factor below it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dusttaichi.analysis.frame import find_surface
from dusttaichi.analysis.stopping import Stop, find_first_stop
from dusttaichi.errors import DustError
from dusttaichi.results.datasets import read_at

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


WIDTH, SLICE = 0.7, 0.25  #: Radius and height of a slice below a sphere, over its radius.


@dataclass(frozen=True)
class Penetration:
    """Motion of a sphere into dust, SI, from where its lowest point is at `surface`."""

    time: NDArray[np.float64]  #: (n,).
    depth: NDArray[np.float64]  #: Depth of its lowest point below the surface, (n,).
    velocity: NDArray[np.float64]  #: Upwards, (n,).
    force: NDArray[np.float64]  #: Upwards, (n,): from the result, or mass times acceleration.
    radius: float  #: Radius of the sphere.
    mass: float  #: Mass of the sphere.
    surface: float  #: Height of the upper end of the dust at the start.
    speed: float  #: Downwards at time 0.
    stop: Stop | None  #: Stop, or None where the run ends before.


def measure_penetration(run: Run) -> Penetration:
    """Penetration of a sphere into grains, or of a rigid body into the continuum.

    Raises
    ------
    DustError
        The run has neither, or the sphere does not reach the dust.
    """
    time, position, velocity, force, (radius, mass) = _read_motion(run)
    if not np.any(force):
        raise DustError(f"{run.path}: the sphere has not touched the dust.")
    top = find_surface(run)
    depth = top - position[:, 2] + radius
    inside = np.flatnonzero(depth >= 0.0)
    if not len(inside):
        raise DustError(f"{run.path}: the sphere never reaches the dust below it.")
    first = int(inside[0])
    speed = -float(velocity[max(first - 1, 0), 2])
    touch = time[first] - depth[first] / speed if speed > 0.0 else time[first]
    time, depth = time[first:] - touch, depth[first:]
    up, force = velocity[first:, 2], force[first:, 2]
    if time[0] > 0.0:  # the moment at the surface, between two records
        time, depth = np.append(0.0, time), np.append(0.0, depth)
        up, force = np.append(-speed, up), np.append(0.0, force)
    return Penetration(
        time=time,
        depth=depth,
        velocity=up,
        force=force,
        radius=radius,
        mass=mass,
        surface=top,
        speed=speed,
        stop=find_first_stop(time, -depth, up),
    )


def _read_motion(
    run: Run,
) -> tuple[
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    tuple[float, float],
]:
    """time (n,), position, velocity, force (n, 3) of the sphere, and (radius, mass), SI."""
    series = run.whole.series
    time = series.time.values
    if "sphere_position" in series:
        size = float(run.attrs["sphere_radius"]), float(run.attrs["sphere_mass"])
        names = ("sphere_position", "sphere_velocity", "sphere_force")
        return time, *(series[name].values for name in names), size
    bead = run.sample.get("projectile", {})
    if "body_position" not in series or bead.get("shape") != "sphere":
        raise DustError(f"{run.path} has no rigid sphere.")
    position, velocity = (
        read_at(series[name], rigid=bead["name"]) for name in ("body_position", "body_velocity")
    )
    force = bead["mass"] * np.gradient(velocity, time, axis=0)
    size = 0.5 * bead["diameter"], bead["mass"]
    return time, position, velocity, force, size


@dataclass(frozen=True)
class Column:
    """Filling factor of an upright cylinder below a sphere in horizontal slices."""

    #: Depth of the middles of the slices below the initial surface [m], (bins,).
    depth: NDArray[np.float64]
    filling_factor: NDArray[np.float64]  #: (bins,).
    sphere: float  #: Depth of the lowest point of the sphere [m].


def measure_column(run: Run, snapshot: int = -1) -> Column:
    """Filling factor below the sphere in a snapshot.

    The cylinder has WIDTH radii of the sphere, a slice SLICE of them. Grains count with their
    volume inside the cylinder; of a continuum it is the mean of the particles with their centre
    inside.

    Parameters
    ----------
    run : Run
    snapshot : int
    """
    motion = measure_penetration(run)
    frames = run.snapshots
    if frames is None:
        raise DustError(f"{run.path} has no snapshots: set output: snapshots in the scene.")
    frames = frames.isel(snapshot=snapshot)
    if "sphere_position" in frames:
        position = frames.sphere_position.values
    else:
        series, name = run.whole.series, run.sample["projectile"]["name"]
        record = int(np.argmin(np.abs(series.time.values - float(frames.snapshot_time))))
        position = read_at(series.body_position, rigid=name)[record]
    lowest, reach = position[2] - motion.radius, WIDTH * motion.radius
    count = int((lowest - run.method.read(run, 0).floor) / (SLICE * motion.radius) + 1e-6)
    edges = lowest - SLICE * motion.radius * np.arange(count + 1)
    phi = run.method.read(run, snapshot).filling_below(position[:2], reach, edges)
    return Column(motion.surface - 0.5 * (edges[:-1] + edges[1:]), phi, motion.surface - lowest)
