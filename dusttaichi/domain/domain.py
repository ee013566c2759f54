"""What surrounds the particles and how it moves: the one place that answers for it.

Walls and cell are laid out from the scene and the sample (layout.py), move as the drive of the
stage says, and tell where they are at a step. Times count from the start of the run: a change of
drive keeps every place.
"""

from dataclasses import dataclass, replace

import numpy as np

from dusttaichi.domain.cell import Cell
from dusttaichi.domain.clock import Clock
from dusttaichi.domain.walls import TOP, Box
from dusttaichi.errors import DustError


@dataclass(frozen=True, eq=False)
class Domain:
    """Walls and periodic cell of a run, or neither.

    dt: time step [us]. volume: of all particles [um^3]. radius: of the largest of them [um].
    t_c: time that a compression_rate counts in [us] (scene.Drive).
    """

    dt: float
    volume: float = 0.0
    radius: float = 0.0
    box: Box | None = None
    cell: Cell | None = None
    t_c: float = 1.0

    def driven(self, drive, step):
        """The same domain, moving as `drive` (scene.Drive) says from that step on."""
        time = self.dt * step
        box = None if self.box is None else self.box.driven(drive, time)
        cell = None if self.cell is None else self.cell.driven(drive, time, self.t_c)
        return replace(self, box=box, cell=cell)

    # -- where it is -----------------------------------------------------------------------------

    @property
    def there(self):
        """True where there is a wall or a cell."""
        return self.box is not None or self.cell is not None

    @property
    def has_top(self):
        """True where there is a top wall, whose pressure is that of the run."""
        return self.box is not None and bool(self.box.present[TOP])

    def room(self, step):
        """Coordinates of walls and faces [um], (6,); not a number where there is neither."""
        time = self.dt * step
        planes = np.full(6, np.nan)
        if self.box is not None:
            planes = np.where(self.box.present == 1, self.box.planes(time), np.nan)
        if self.cell is not None:
            low = self.cell.low(time)
            for n in self.cell.axes:
                planes[2 * n : 2 * n + 2] = low[n], low[n] + self.cell.edges(time)[n]
        return planes

    def lengths(self, step):
        """Edges of the room for the particles [um], (3,); not a number where it is open."""
        time = self.dt * step
        out = np.full(3, np.nan)
        if self.box is not None:
            planes, present = self.box.planes(time), self.box.present
            for n in range(3):
                if present[2 * n] and present[2 * n + 1]:
                    out[n] = planes[2 * n + 1] - planes[2 * n]
        if self.cell is not None:
            axes = list(self.cell.axes)
            out[axes] = self.cell.edges(time)[axes]
        return out

    @property
    def bounded(self):
        """True where the room is finite along all axes."""
        return not np.isnan(self.lengths(0)).any()

    def wall_areas(self, step):
        """Area of each wall [um^2], (6,): of the room, or of the sample where it is open."""
        planes, lengths = self.box.planes(self.dt * step), self.lengths(step)
        a, b, c = np.where(np.isnan(lengths), planes[1::2] - planes[0::2], lengths)
        return np.array([b * c, b * c, a * c, a * c, a * b, a * b])

    def nearest(self, d, step):
        """Distance vectors [um], (n, 3), to the nearest periodic image."""
        if self.cell is None:
            return d
        edges = self.cell.edges(self.dt * step)
        whole = np.where(edges > 0.0, edges, 1.0)
        return d - np.where(edges > 0.0, edges * np.round(d / whole), 0.0)

    # -- how it moves ----------------------------------------------------------------------------

    @property
    def wall_speed(self):
        """Speed of the top wall downwards [um/us], as the drive's; 0 without one."""
        return float(self.box.speed[TOP]) if self.has_top else 0.0

    @property
    def fastest_wall(self):
        """Speed of the fastest wall [um/us]."""
        return 0.0 if self.box is None else float(np.max(np.abs(self.box.speed)))

    def closing_speed(self, step):
        """Speed at which faces may bring particles together [um/us]."""
        return 0.0 if self.cell is None else float(np.abs(self.cell.speeds(self.dt * step)).sum())

    def check_way(self):
        """Raises DustError where the drive ends at once: walls or faces are as near to each other
        as they may come."""
        clock = self.clock()
        for axis, way in enumerate(("wide", "deep", "high")):
            if clock.narrows(axis) and clock.step_of_length(clock.least[axis], axis) == 0:
                raise DustError(
                    f"boundary: the room is {clock.start[axis]:.4g} um {way}, no more than two "
                    f"grains ({clock.least[axis]:.4g} um), so nothing can be pressed; take a "
                    "larger sample or room, or let it rest"
                )

    def clock(self, first=0):
        """The Clock of the stage that begins at step `first`, at which the drive has been set.

        Walls are not brought closer than two particles, faces not to where a particle would meet
        another across both.
        """
        start, rate, growth = [np.nan] * 3, [0.0] * 3, [0.0] * 3
        least = [4.0 * self.radius] * 3
        if self.box is not None:
            offset, speed, present = self.box.offset, self.box.speed, self.box.present
            for n in range(3):
                if present[2 * n] and present[2 * n + 1]:
                    # upper plane: x = -(offset + speed t), lower: x = offset + speed t
                    start[n] = -float(offset[2 * n] + offset[2 * n + 1])
                    rate[n] = -float(speed[2 * n] + speed[2 * n + 1])
        if self.cell is not None:
            for n in self.cell.axes:
                start[n], rate[n] = float(self.cell.start[n]), float(self.cell.rate[n])
                growth[n] = float(self.cell.growth[n])
                least[n] = 4.1 * self.radius
        return Clock(
            self.dt, self.volume, tuple(start), tuple(rate), tuple(growth), tuple(least), first
        )
