"""Motion of a surface: at a velocity, or along a direction under a load that a servo controls."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

Vector = tuple[float, float, float]
LOADS = ("force", "pressure")  # keys of a controlled load
REPLACING = (*LOADS, "velocity")  # keys of a stage, each of which replaces the load of the block


class SurfaceDrive(Protocol):
    """Motion of a surface in a stage (scene.SurfaceDrive); None: as its own block has it."""

    @property
    def velocity(self) -> Vector | None: ...
    @property
    def spin(self) -> Vector | None: ...
    @property
    def force(self) -> float | None: ...
    @property
    def pressure(self) -> float | None: ...
    @property
    def largest_speed(self) -> float | None: ...
    @property
    def gain(self) -> float | None: ...


@dataclass(frozen=True)
class SurfaceMotion:
    """Motion of a surface [SI].

    velocity: across `direction` where a load is controlled. force or pressure: controlled, or
    neither. direction: along which it presses, a unit vector, or None. area: that the pressure
    refers to, None for the cross section of the room, NaN without any. largest: speed
    under a load; widens: it may grow to that of the stage before. gain: of the servo, None for the
    default.
    """

    velocity: Vector
    spin: Vector
    force: float | None
    pressure: float | None
    direction: Vector | None
    area: float | None
    largest: float
    widens: bool
    gain: float | None

    @property
    def load(self) -> float | None:
        """Controlled force [N] or pressure [Pa], None without."""
        return self.pressure if self.force is None else self.force

    def driven(self, drive: SurfaceDrive | None) -> SurfaceMotion:
        """The motion in a stage; keys that the block of the stage leaves out are of this one."""
        if drive is None:
            return self
        replaced = any(getattr(drive, key) is not None for key in REPLACING)
        return replace(
            self,
            velocity=self.velocity if drive.velocity is None else drive.velocity,
            spin=self.spin if drive.spin is None else drive.spin,
            force=drive.force if replaced else self.force,
            pressure=drive.pressure if replaced else self.pressure,
            largest=drive.largest_speed or self.largest,
            widens=self.widens and drive.largest_speed is None,
            gain=drive.gain or self.gain,
        )
