"""A rigid sphere that goes into dust, of grains or of a continuum: depth, velocity, force, and the
filling factor below it, measured alike for both."""

from dataclasses import dataclass

import numpy as np

from dusttaichi import geometry
from dusttaichi.analysis.continuum import read_particles
from dusttaichi.analysis.continuum.intrusion import Stop, first_stop
from dusttaichi.analysis.continuum.particles import sample_info
from dusttaichi.analysis.frame import read_frame
from dusttaichi.errors import DustError


@dataclass(frozen=True)
class Penetration:
    """The way of a sphere into dust, SI, from the moment at which its lowest point is at `surface`,
    the height of the dust's upper end at the start.

    time (n,); depth (n,) of its lowest point below the surface; velocity (n,) upwards; force (n,)
    upwards: as the run has it, or mass times acceleration. radius, mass. speed: downwards at time
    0. stop: the Stop (analysis.continuum), or None where the run ends before.
    """

    time: np.ndarray
    depth: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    radius: float
    mass: float
    surface: float
    speed: float
    stop: Stop | None


def penetration(run):
    """The Penetration of a Run of grains with a sphere, or of the continuum with a rigid body.

    Raises DustError where there is none.
    """
    time, place, velocity, force, (radius, mass) = _way(run)
    surface = _surface(run)
    depth = surface - place[:, 2] + radius
    inside = np.flatnonzero(depth >= 0.0)
    if not len(inside):
        raise DustError(f"{run.path}: the sphere never reaches the dust below it.")
    first = int(inside[0])
    speed = -float(velocity[max(first - 1, 0), 2])
    touch = time[first] - depth[first] / speed if speed > 0.0 else time[first]
    own = slice(first, None)
    time, depth, up, force = time[own] - touch, depth[own], velocity[own, 2], force[own, 2]
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
        surface=surface,
        speed=speed,
        stop=first_stop(time, -depth, up),
    )


def _way(run):
    """time (n,), position, velocity, force (n, 3) of the sphere, its (radius, mass), SI."""
    series = run.whole.series
    time = series.time.values
    if "sphere_position" in series:
        own = float(run.attrs["sphere_radius"]), float(run.attrs["sphere_mass"])
        names = ("sphere_position", "sphere_velocity", "sphere_force")
        return time, *(series[name].values for name in names), own
    bead = sample_info(run).get("projectile", {})
    if "body_position" not in series or bead.get("shape") != "sphere":
        raise DustError(f"{run.path} has no rigid sphere.")
    way = series.sel(rigid=bead["name"])
    velocity = way.body_velocity.values
    force = bead["mass"] * np.gradient(velocity, time, axis=0)
    own = 0.5 * bead["diameter"], bead["mass"]
    return time, way.body_position.values, velocity, force, own


def _surface(run):
    if run.is_continuum:
        return float(sample_info(run)["surface"])
    frame = read_frame(run, 0, contacts=False)
    return float(np.max(frame.position[:, 2] + frame.radius))


@dataclass(frozen=True)
class Column:
    """Filling factor of an upright cylinder below a sphere in horizontal slices: depth of their
    middles below the surface of the start (bins,) [m], filling_factor (bins,); sphere: depth of the
    sphere's lowest point [m]."""

    depth: np.ndarray
    filling_factor: np.ndarray
    sphere: float


def column(run, snapshot=-1, *, width=0.7, slices=0.25):
    """The Column of a snapshot: `width` times the sphere's radius wide, in slices that are `slices`
    times it high.

    Grains count with the volume that is inside; of a continuum it is the mean of the particles
    whose centre is inside.
    """
    way = penetration(run)
    frames = run.snapshots.isel(snapshot=snapshot)
    if "sphere_position" in frames:
        place = frames.sphere_position.values
    else:
        series, name = run.whole.series, sample_info(run)["projectile"]["name"]
        record = int(np.argmin(np.abs(series.time.values - float(frames.snapshot_time))))
        place = series.body_position.sel(rigid=name).values[record]
    lowest, reach = place[2] - way.radius, width * way.radius
    count = int((lowest - _floor(run)) / (slices * way.radius) + 1e-6)
    edges = lowest - slices * way.radius * np.arange(count + 1)
    phi = _filling(run, snapshot, place[:2], reach, edges)
    return Column(way.surface - 0.5 * (edges[:-1] + edges[1:]), phi, way.surface - lowest)


def _floor(run):
    if run.is_continuum:
        found = read_particles(run, 0)
        return float(found.position[found.is_dust][:, 2].min() - 0.5 * run.attrs["spacing"])
    frame = read_frame(run, 0, contacts=False)
    low = frame.cell[2, 0]
    return float(low if np.isfinite(low) else np.min(frame.position[:, 2] - frame.radius))


def _filling(run, snapshot, axis, reach, edges):
    """Filling factor in the slices of a cylinder; edges: heights, falling."""
    if run.is_continuum:
        found = read_particles(run, snapshot)
        x = found.position[found.is_dust]
        way = x[:, :2] - axis
        inside = np.hypot(*way.T) <= reach
        volume, phi = (a[found.is_dust][inside] for a in (found.volume, found.filling_factor))
        weights = (volume * phi, volume)
        solid, all_ = (np.histogram(x[inside, 2], edges[::-1], weights=a)[0] for a in weights)
        return (solid / np.where(all_ > 0.0, all_, np.nan))[::-1]
    frame = read_frame(run, snapshot, contacts=False)
    around = np.append(axis, 0.0)
    x = frame.nearest(frame.position - around) + around
    pairs = zip(edges[1:], edges[:-1], strict=True)
    volume = np.array(
        [geometry.cylinder_volume(x, frame.radius, axis, reach, low=a, high=b) for a, b in pairs]
    )
    return volume / (np.pi * reach**2 * -np.diff(edges))


UNITS = {
    "sphere_depth": "m",
    "sphere_stopping_time": "s",
    "sphere_largest_depth": "m",
    "sphere_force": "N",
}
"""Of the numbers of `numbers`."""


def numbers(run):
    """Of a sphere that goes into grains: depth and time of its stop, or how deep it has come; the
    largest force upwards, a mean between two records."""
    found = dict.fromkeys(UNITS)
    try:
        way = penetration(run) if run.has_sphere else None
    except DustError:  # it flies, or there is no dust below it
        way = None
    if way is None:
        return found
    found |= {"sphere_force": float(way.force.max())}
    driven = "speed" in run.scene.get("sphere", {})
    if driven or way.stop is None:
        return found | {"sphere_largest_depth": float(way.depth.max())}
    return found | {"sphere_depth": way.stop.depth, "sphere_stopping_time": way.stop.time}


def rows(n, row):
    """Rows of the final table; row: as `analysis.summary.table` has it."""
    stops = n["sphere_stopping_time"]
    row(
        "depth of the sphere",
        n["sphere_depth"],
        lambda v: f"{v * 1e6:.4g} um, where it stops after {stops * 1e6:.4g} us",
    )
    row("largest depth of the sphere", n["sphere_largest_depth"], lambda v: f"{v * 1e6:.4g} um")
    row("largest force on the sphere", n["sphere_force"], lambda v: f"{v * 1e6:.4g} uN")
