"""Drives of surfaces: their velocities in a stage, and their changes by load control."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from dusttaichi.domain.servo import SURFACE, Servo, continue_motion, start_servo

if TYPE_CHECKING:
    from dusttaichi.domain.moving_surfaces import Surfaces
    from dusttaichi.domain.walls import Box
    from dusttaichi.physics.surfaces.surface_motion import SurfaceDrive, SurfaceMotion
    from dusttaichi.units import Units


class Room(Protocol):
    """Surfaces of a domain.Domain, and the room around them."""

    @property
    def dt(self) -> float: ...
    @property
    def units(self) -> Units: ...
    @property
    def box(self) -> Box | None: ...
    @property
    def surfaces(self) -> Surfaces | None: ...
    def surface_area(self, n: int, step: int) -> float: ...


Integral = Callable[[Servo], NDArray[np.float64]]


def drive_surfaces(
    domain: Room, drives: Mapping[str, SurfaceDrive], step: int, integral: Integral | None
) -> Surfaces | None:
    """Surfaces of a Domain with the motion of a stage from that step on; None without any.

    drives: by the names of the surfaces. integral: see servo.make_servo.
    """
    surfaces, servos = domain.surfaces, []
    if surfaces is None:
        return None
    velocities, spins = surfaces.velocities.copy(), surfaces.spins.copy()
    for n, (name, motion) in enumerate(zip(surfaces.names, surfaces.motions, strict=True)):
        if motion is None:  # the tube, which the boundary moves
            continue
        stage = motion.driven(drives.get(name))
        velocities[n] = np.array(stage.velocity) / domain.units("m/s")
        spins[n] = np.array(stage.spin) / domain.units("rad/s")
        if stage.load is not None:
            servo = _make_servo(domain, n, stage, step, integral)
            servos.append(servo)
            velocities[n] += servo.speed[0] * surfaces.directions[n]
    moved = surfaces.with_velocities(velocities, domain.dt * step)
    return replace(moved.with_spins(spins), servos=tuple(servos))


def _make_servo(
    domain: Room, n: int, motion: SurfaceMotion, step: int, integral: Integral | None
) -> Servo:
    """The Servo of surface n of a Domain, whose load a SurfaceMotion has, from that step on."""
    surfaces, per_area = domain.surfaces, motion.pressure is not None
    assert surfaces is not None and domain.box is not None and motion.load is not None
    direction, ends = surfaces.directions[n], domain.box.planes(domain.dt * step)
    first = start_servo(
        (SURFACE, (n,)),
        np.array([motion.load]) / domain.units("Pa" if per_area else "N"),
        gain=motion.gain,
        largest=np.array([motion.largest]) / domain.units("m/s"),
        # as long as the sample is along it
        length=np.array([np.abs(direction) @ np.abs(ends[1::2] - ends[0::2])]),
        step=step,
        per_area=per_area,
    )
    if integral is None:
        return first
    first = replace(first, load_integral=integral(first))
    speed = np.array([surfaces.velocities[n] @ direction])
    last = next((servo for servo in surfaces.servos if servo.axes == first.axes), None)
    widens = motion.widens
    return continue_motion(first, last, speed, gain=motion.gain, widens=widens, dt=domain.dt)


def steer_surfaces(domain: Room, step: int, integral: Integral) -> Surfaces:
    """Surfaces of a Domain after the changes of speed that their servos are due for at a step."""
    surfaces, servos = domain.surfaces, []
    assert surfaces is not None
    velocities = surfaces.velocities.copy()
    for servo in surfaces.servos:
        (n,), now = servo.axes, integral(servo)
        load = (now - servo.load_integral) / (servo.every * domain.dt)
        if servo.per_area:
            load = load / domain.surface_area(n, step)
        updated = servo.update(load, now, domain.dt)
        velocities[n] += (updated.speed[0] - servo.speed[0]) * surfaces.directions[n]
        servos.append(updated)
    return replace(surfaces.with_velocities(velocities, domain.dt * step), servos=tuple(servos))
