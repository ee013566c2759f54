"""Motion of a rigid body into dust: intrusion, stopping time, depth, deceleration curve (G09)."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.restitution import UNTOUCHED
from dusttaichi.analysis.stopping import Stop, find_first_stop
from dusttaichi.errors import DustError
from dusttaichi.results.datasets import read_at


@dataclass(frozen=True)
class Intrusion:
    """Penetration of a rigid body into dust, from the first touch on, in SI.

    name: of the body. time (n,); height h (n,), 0 at the first touch; velocity (n,) upwards.
    speed: downwards at the first touch. mass [kg, or kg/m], diameter [m], dimension. momentum:
    m v / A [kg/(m s)] as of a sphere, see `momentum_per_area`. stop: the Stop, or None where the
    run ends before; without_gravity: the same with g t^2 / 2 taken away, as G09 section 3.3.2 does.
    rebound: largest speed upwards after the stop [m/s], 0 without a stop.
    """

    name: str
    time: np.ndarray
    height: np.ndarray
    velocity: np.ndarray
    speed: float
    mass: float
    diameter: float
    dimension: int
    momentum: float
    stop: Stop | None
    without_gravity: Stop | None
    rebound: float


def momentum_per_area(mass, speed, diameter, dimension):
    """m v / A of a sphere [kg/(m s)], its momentum over its cross-section.

    For a disc the 3D value of the same density and diameter: 8 / (3 pi) of m_2D v / (2 r) (G09
    eq 16).
    """
    if dimension == 2:
        return 8.0 / (3.0 * np.pi) * mass * speed / diameter
    return mass * speed / (np.pi / 4.0 * diameter**2)


def at_zero_spacing(spacing, values):
    """(value, slope) of the straight line through values over spacing [m], (n,) each, at spacing 0.

    By least squares. What particles of finite size do to a bead that sinks into dust is of first
    order: the layer that touches it is one spacing thick.
    """
    slope, value = np.polyfit(spacing, values, 1)
    return float(value), float(slope)


def projectile_of(run):
    """Rigid body that falls on dust, from the result: a dict with name, diameter ...

    Raises DustError where there is none.
    """
    bead = run.sample.get("projectile", {})
    if "density" not in bead or "body_position" not in run.series:
        raise DustError(f"{run.path} has no rigid projectile: sample kind impact, with kind rigid.")
    return bead


def intrusion(run):
    """The Intrusion of the projectile of a Run with one rigid body that falls on dust.

    Raises DustError where there is none, or it has not met the dust.
    """
    bead, series = projectile_of(run), run.whole.series
    time = series.time.values
    height, velocity = (
        read_at(series[name], rigid=bead["name"], xyz="z")
        for name in ("body_position", "body_velocity")
    )
    spacing, gravity = float(run.attrs["spacing"]), float(run.attrs.get("gravity", 0.0))
    free_fall = velocity[0] - gravity * (time - time[0])
    if not np.any(np.abs(velocity - free_fall) > UNTOUCHED * np.abs(free_fall)):
        raise DustError("the body has not met the dust; let the run continue")
    # the surface of the body meets that of the dust when it has fallen the gap between them
    speed = -float(velocity[0])
    fall = run.sample.get("gap", spacing)
    touch = fall / speed if speed > 0.0 else 0.0
    from_touch = time >= touch
    time = time[from_touch] - touch
    height = height[from_touch] - height[0] + fall
    velocity = velocity[from_touch]
    dimension = int(run.attrs["dimension"])
    stop = find_first_stop(time, height, velocity)
    falling = height + 0.5 * gravity * time**2, velocity + gravity * time
    speeds_after_stop = velocity[time > stop.time] if stop is not None else np.zeros(0)
    return Intrusion(
        name=bead["name"],
        time=time,
        height=height,
        velocity=velocity,
        speed=speed,
        mass=bead["mass"],
        diameter=bead["diameter"],
        dimension=dimension,
        momentum=momentum_per_area(bead["mass"], speed, bead["diameter"], dimension),
        stop=stop,
        without_gravity=find_first_stop(time, *falling),
        rebound=float(max(speeds_after_stop.max(initial=0.0), 0.0)),
    )
