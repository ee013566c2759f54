"""Environment of the particles: walls and periodic cell, and their motion.

Walls and cell are placed around the sample (layout.py) and moved by the drive of the stage. Times
count from the start of the run: a change of drive does not change positions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.domain.cell import Cell
from dusttaichi.domain.clock import NEVER, Clock
from dusttaichi.domain.moving_surfaces import Surfaces
from dusttaichi.domain.servo import WALL, Servo, make_servo
from dusttaichi.domain.surface_drives import drive_surfaces, steer_surfaces
from dusttaichi.domain.walls import TOP, Box
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.physics.geometry import AXES
from dusttaichi.units import SI, Units

if TYPE_CHECKING:
    from dusttaichi.domain.drives import Drive


def lengths(
    box: Box | None, cell: Cell | None, time: float, surfaces: Surfaces | None = None
) -> NDArray[np.float64]:
    """Lengths, (3,), between the walls of a Box and of the edges of a Cell at a time.

    Either may be None; NaN along open axes. In a tube of Surfaces that of a square of its area.
    """
    out = np.full(3, np.nan)
    if box is not None:
        low, high = box.planes(time).reshape(3, 2).T
        out = np.where(box.present.reshape(3, 2).all(axis=1), high - low, out)
        if surfaces is not None and surfaces.tube is not None:
            out[:2] = SQUARE * surfaces.tube_radius(time)
    if cell is not None:
        axes = list(cell.axes)
        out[axes] = cell.edges(time)[axes]
    return out


SQUARE = sqrt(pi)  # edge of a square over the radius of a circle of the same area


@dataclass(frozen=True, eq=False)
class Domain:
    """Walls and periodic cell of a run, or neither, in its `units`.

    dt: time step. volume: of all particles. radius: of the largest of them. t_c: unit of time of a
    compression_rate (scene.Drive). servo: load control, or None. surfaces: beside the walls, or
    None; where there are any, there is a box too.
    """

    dt: float
    volume: float = 0.0
    radius: float = 0.0
    box: Box | None = None
    cell: Cell | None = None
    t_c: float = 1.0
    servo: Servo | None = None
    units: Units = SI
    surfaces: Surfaces | None = None

    def driven(
        self,
        drive: Drive,
        step: int,
        integral: Callable[[Servo], NDArray[np.float64]] | None = None,
    ) -> Domain:
        """The domain with the motion of `drive` (scene.Drive) from that step on.

        integral: see servo.make_servo; needed where a load is controlled.
        """
        servo = make_servo(drive, self, step, integral)
        time, box, cell = self.dt * step, self.box, self.cell
        if box is not None:
            unit = self.units("m/s")
            speed = (drive.wall_speed or 0.0) / unit
            if servo is not None and servo.mode == WALL:
                speed = servo.speed[0]
            box = box.driven(speed, (drive.shear_speed or 0.0) / unit, time)
        if cell is not None:
            cell = cell.driven(time, **self._face_motion(drive, servo))
        surfaces = drive_surfaces(self, drive.surfaces, step, integral)
        return replace(self, servo=servo, box=box, cell=cell, surfaces=surfaces)

    def steer(self, integral: NDArray[np.float64]) -> Domain:
        """The domain after the change of speeds by the servo that is due at this step.

        integral: see Servo.load_integral. Raises GuardStop where the box has its smallest length.
        """
        assert self.servo is not None, "no load is controlled"
        servo, step = self.servo, self.servo.next_change
        load = (
            (integral - servo.load_integral) / (servo.every * self.dt) / self._measured_over(step)
        )
        servo = servo.update(load, integral, self.dt)
        time, domain = self.dt * step, replace(self, servo=servo)
        if servo.mode == WALL:
            assert self.box is not None
            box = self.box.driven(servo.speed[0], self.box.along[TOP, 0], time)
            domain = replace(domain, box=box)
        else:
            assert self.cell is not None
            growth, controlled = self.cell.growth.copy(), np.isin(np.arange(3), servo.axes)
            growth[controlled] = -servo.speed
            moved = self.cell.driven(time, growth=growth, shear=self.cell.shear_rate)
            # other edges stay bitwise identical: intervals may depend on their strain
            start = np.where(controlled, moved.start, self.cell.start)
            domain = replace(domain, cell=replace(moved, start=start))
        domain._check_narrow(step)
        return domain

    def steer_surfaces(self, step: int, integral: Callable[[Servo], NDArray[np.float64]]) -> Domain:
        """The domain after the changes of speed by the servos of its surfaces at a step."""
        return replace(self, surfaces=steer_surfaces(self, step, integral))

    @property
    def next_change(self) -> int:
        """Step of the next change of speed by a servo; NEVER without one."""
        servos = [self.servo, *(() if self.surfaces is None else self.surfaces.servos)]
        return min((servo.next_change for servo in servos if servo is not None), default=NEVER)

    def surface_area(self, n: int, step: int) -> float:
        """Area that a pressure of surface n refers to, NaN without: its own, or the room's."""
        assert self.surfaces is not None
        motion = self.surfaces.motions[n]
        if motion is None:
            return np.nan
        if motion.area is not None:
            return motion.area / self.units("m") ** 2
        return float(self.wall_areas(step)[2 * np.argmax(np.abs(self.surfaces.directions[n]))])

    def _measured_over(self, step: int) -> np.floating:
        """Area or volume over which the load is averaged."""
        if self.servo is not None and self.servo.mode == WALL:
            area: np.float64 = self.wall_areas(step)[TOP]
            return area
        return np.prod(self.lengths(step))

    def _check_narrow(self, step: int) -> None:
        clock, lengths, um = self.clock(step), self.lengths(step), self.units("m") * 1e6
        for axis in range(3):
            if clock.narrows(axis) and lengths[axis] <= clock.least[axis]:
                time_us = self.dt * step * self.units("s") * 1e6
                raise GuardStop(
                    f"At {time_us:.6g} µs the box is {lengths[axis] * um:.4g} µm along "
                    f"{AXES[axis]}, two grains, and the prescribed load is not reached. "
                    "Try a larger sample or a lower pressure or stress."
                )

    # -- positions -------------------------------------------------------------------------------

    @property
    def there(self) -> bool:
        """True where there is a wall or a cell."""
        return self.box is not None or self.cell is not None

    @property
    def is_round(self) -> bool:
        """True where there is a tube."""
        return self.surfaces is not None and self.surfaces.tube is not None

    @property
    def has_top(self) -> bool:
        """True where there is a top wall, on which the pressure is measured."""
        return self.box is not None and bool(self.box.present[TOP])

    def room(self, step: int) -> NDArray[np.float64]:
        """Coordinates of walls and faces, (6,); NaN where there is neither."""
        time = self.dt * step
        planes = np.full(6, np.nan)
        if self.box is not None:
            planes = np.where(self.box.present == 1, self.box.planes(time), np.nan)
        if self.cell is not None:
            low = self.cell.low(time)
            for n in self.cell.axes:
                planes[2 * n : 2 * n + 2] = low[n], low[n] + self.cell.edges(time)[n]
        return planes

    def lengths(self, step: int) -> NDArray[np.float64]:
        """Lengths of the box, (3,); NaN where it is open."""
        return lengths(self.box, self.cell, self.dt * step, self.surfaces)

    @property
    def bounded(self) -> bool:
        """True where the box is finite along all axes."""
        return not np.isnan(self.lengths(0)).any()

    def wall_areas(self, step: int) -> NDArray[np.float64]:
        """Area of each wall, (6,): of the box, or of the sample where it is open."""
        assert self.box is not None, "there are no walls"
        planes, lengths = self.box.planes(self.dt * step), self.lengths(step)
        a, b, c = np.where(np.isnan(lengths), planes[1::2] - planes[0::2], lengths)
        return np.array([b * c, b * c, a * c, a * c, a * b, a * b])

    def nearest(self, d: NDArray[np.float64], step: int) -> NDArray[np.float64]:
        """Distance vectors, (n, 3), to the nearest periodic image."""
        return d if self.cell is None else self.cell.nearest(d, self.dt * step)

    # -- motion ----------------------------------------------------------------------------------

    @property
    def wall_speed(self) -> float:
        """Speed of the top wall downwards, 0 without one."""
        return float(self.box.speed[TOP]) if self.box is not None and self.has_top else 0.0

    @property
    def fastest_wall(self) -> float:
        """Largest normal speed of a wall, now or allowed by its servo."""
        if self.box is None:
            return 0.0
        fastest = float(np.max(np.abs(self.box.speed)))
        if self.surfaces is not None:
            fastest = max(fastest, self.surfaces.fastest)
        if self.servo is not None and self.servo.mode == WALL:
            return max(fastest, float(self.servo.largest[0]))
        return fastest

    def closing_speed(self, step: int) -> float:
        """Speed at which faces may bring particles together, now or allowed by a servo."""
        if self.cell is None:
            return 0.0
        time = self.dt * step
        speeds = np.abs(self.cell.speeds(time))
        if self.servo is not None and self.servo.mode != WALL:
            axes = list(self.servo.axes)
            speeds[axes] = self.servo.largest * self.cell.edges(time)[axes]
        return float(speeds.sum()) + abs(self.cell.tilt_rate)

    def shear_strain(self, step: int) -> float:
        """Shear strain since the start; 0 where nothing is sheared.

        It is that of the cell, or the displacement of the top wall along x over the current height.
        """
        time = self.dt * step
        if self.cell is not None and self.cell.tilted:
            return self.cell.compute_shear_strain(time)
        height = self.lengths(step)[2]
        if self.box is None or not self.has_top:
            return 0.0
        return float(self.box.tangential_displacements(time)[TOP, 0] / height)

    def tilt(self, step: int) -> float:
        """Shift of the image above the cell along x."""
        return 0.0 if self.cell is None else self.cell.offset(self.dt * step)

    def check_start(self) -> None:
        """Raise DustError where walls or faces have their smallest distance at the start."""
        clock, um = self.clock(), self.units("m") * 1e6
        for axis, word in enumerate(("wide", "deep", "high")):
            if clock.narrows(axis) and clock.step_of_length(clock.least[axis], axis) == 0:
                raise DustError(
                    f"boundary: the box is {clock.start[axis] * um:.4g} µm {word}, no more than "
                    f"two grains ({clock.least[axis] * um:.4g} µm), so it cannot be compressed; "
                    "use a larger sample or box, or leave it at rest"
                )

    def clock(self, first: int = 0) -> Clock:
        """The Clock of the stage that begins at step `first`, at which the drive has been set.

        The smallest distance of faces is slightly more than two particles, so that no particle
        meets another across both, which the search needs; that of walls is two particles. Walls at
        a given speed that are as near when the stage begins, as on both sides of a single layer,
        have none: the guards alone end a run.
        """
        start, rate, growth = [np.nan] * 3, [0.0] * 3, [0.0] * 3
        least, controlled = [4.0 * self.radius] * 3, self._controlled_axes()
        if self.box is not None:
            offset, speed, present = self.box.offset, self.box.speed, self.box.present
            for n in range(3):
                if present[2 * n] and present[2 * n + 1]:
                    # upper plane: x = -(offset + speed t), lower: x = offset + speed t
                    start[n] = -float(offset[2 * n] + offset[2 * n + 1])
                    rate[n] = -float(speed[2 * n] + speed[2 * n + 1])
                    height = start[n] + rate[n] * self.dt * first
                    if height <= least[n] and n not in controlled:
                        least[n] = 0.0
            if self.surfaces is not None and self.is_round:
                start[:2] = [SQUARE * self.surfaces.tube_radius(0.0)] * 2
                rate[:2] = [SQUARE * self.surfaces.tube_rate] * 2
                least[:2] = [SQUARE * self.radius if rate[0] < 0.0 else 0.0] * 2
        if self.cell is not None:
            for n in self.cell.axes:
                start[n], rate[n] = float(self.cell.start[n]), float(self.cell.rate[n])
                growth[n] = float(self.cell.growth[n])
                least[n] = 4.1 * self.radius
        return Clock(
            self.dt,
            self.volume,
            tuple(start),
            tuple(rate),
            tuple(growth),
            tuple(least),
            first,
            controlled=controlled,
            shear=self._shear_rate(start[2] + rate[2] * self.dt * first),
            units=self.units,
        )

    def plan_stages(self, scene: Any) -> list[tuple[str, float, str]]:
        """(name, largest number of steps, reason) of every stage, before anything is computed.

        Steps are infinite where only a measured quantity ends the stage; there the list ends.
        """
        first, domain, out = 0, self, []
        for plan in scene.stage_plans:
            domain = domain.driven(plan.drive, first)
            end, reason = domain.clock(first).last_step(plan.stop)
            out.append((plan.name, end - first if end < NEVER else inf, reason))
            if end == NEVER:
                break
            first = end
        return out

    def _face_motion(self, drive: Drive, servo: Servo | None) -> dict[str, Any]:
        """Motion of the edges of a cell, arguments of Cell.driven."""
        growth, rate, time = np.zeros(3), np.zeros(3), self.units("s")
        if drive.compression_rate is not None:
            growth[:] = -2.0 * drive.compression_rate / self.t_c
        elif drive.strain_rate is not None:
            growth = np.array(drive.strain_rate) * time
        elif drive.face_speed is not None:
            rate = 2.0 * np.array(drive.face_speed) / self.units("m/s")
        if servo is not None and servo.mode != WALL:
            growth[list(servo.axes)] = -servo.speed
        return {"rate": rate, "growth": growth, "shear": (drive.shear_rate or 0.0) * time}

    def _controlled_axes(self) -> tuple[int, ...]:
        """Numbers of the axes along which a servo moves walls or faces."""
        if self.servo is None:
            return ()
        return (2,) if self.servo.mode == WALL else self.servo.axes

    def _shear_rate(self, height: float) -> float:
        """Rate of shear, between walls relative to the height at the start."""
        if self.cell is not None and self.cell.tilted:
            return self.cell.shear_rate
        if self.box is None or not self.has_top or np.isnan(height):
            return 0.0
        return float(self.box.along[TOP, 0] / height)
