"""Load control: speeds of walls and faces from the measured pressure or stress.

Every EVERY steps, a time T, the load is measured as its mean over them, and e is its relative
error. The speed v of approach follows from it as that of a proportional-integral controller,

    v = r e + v_0,    v_0 += r e T / T_i,    r = g / (k T),    T_i = 4 DAMPED^2 T / g,

within the largest speed. g is the gain, and k the measured stiffness, from the last MEMORY
intervals or so: the slope of the change of e over the strain, and a share SCATTER of the scatter
about it, since a load also changes by itself. That makes the servo slower but does not stop it. So
a load on a spring approaches its value with the damping ratio DAMPED for any spring, and where dust
yields at a steady rate, as in shear, the mean error is zero. k is that of the intervals before, and
the proportional part is not summed up: both would shift the mean where k and e change together.

A sample that yields slowly is stiff at short times (waves, unloading), and the servo can stop no
faster than a stiff sample allows. |v| is at most LIMIT r, the speed for that relative error, where
there is no load yet, growing to LOADED r under the prescribed load; more, RELIEF r |e| times the
share of the load that is there, while the error is large.

A stage continues the motion of the one before: sample and wall carry a load together that falls
where the wall stops, and dust that yields needs microseconds to carry it at rest. v and v_0 are the
speed of the last stage, |v| may be as large for some time, and g is IN_MOTION at first, from which
it goes to AT_REST within FADING intervals or so. A wall that changes its speed also pushes the
particles that touch it, which the next interval measures as a load: v follows from e averaged over
the last SMOOTH intervals. k is FIRM until it has been measured (constant speed does not measure
it), or that of the last stage if this controlled a load by the same walls or faces and k was
larger. Walls and faces that were at rest start at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from dusttaichi.domain.cell import Cell
    from dusttaichi.domain.drives import Drive
    from dusttaichi.domain.walls import Box
    from dusttaichi.units import Units


EVERY, MEMORY = 25, 80
DAMPED, LIMIT, LOADED, RELIEF, SCATTER = 1.0, 0.5, 2.0, 5.0, 0.3
STIFF, SOFT = 1e7, 1.0  # k at first, stiffer than any sample, and at least
FIRST = 0.01  # change of e in the first estimate of k
AT_REST, IN_MOTION = 0.15, 0.4  # default gain, by what the stage begins with
FIRM, SMOOTH, FADING = 5e3, 4, 320  # of a stage that begins in motion
TINY = 1e-300
WALL, CELL, EVEN, SURFACE = "wall", "cell", "even", "surface"


@dataclass(frozen=True, eq=False)
class Servo:
    """Load control of one stage.

    mode: WALL moves the top wall, CELL edges of a cell one by one, EVEN all edges by the same
    factor, SURFACE a surface. axes: numbers of the edges, or of the surface. load: prescribed,
    positive in compression, (n,). scale: reference of its relative error. gain: g. largest: speed
    or rate of approach, (n,). length: of
    the box, or 1, by which displacements are divided, (n,). speed: current, (n,). steady: v_0,
    (n,). missing: e at the last change, (n,), NaN before the first. averaged_intervals: number over
    which e is averaged; mean_error: that average, (n,). late_gain: that g goes to. entry: size of
    the speed that the stage continues, which fades, (n,). squared_changes, squared_strains,
    products: mean squares of the changes of e and of the strains, and the mean of their products,
    (n,). next_change: its step. every: steps between two. load_integral: time integral of the
    measured load at the last change, (n,). per_area: the load of a SURFACE is a pressure.
    """

    mode: str
    axes: tuple[int, ...]
    load: NDArray[np.float64]
    scale: float
    gain: float
    largest: NDArray[np.float64]
    length: NDArray[np.float64]
    speed: NDArray[np.float64]
    steady: NDArray[np.float64]
    missing: NDArray[np.float64]
    squared_changes: NDArray[np.float64]
    squared_strains: NDArray[np.float64]
    products: NDArray[np.float64]
    next_change: int
    every: int
    load_integral: NDArray[np.float64]
    averaged_intervals: int
    mean_error: NDArray[np.float64]
    late_gain: float
    entry: NDArray[np.float64]
    per_area: bool = False

    @property
    def presses(self) -> bool:
        """True where the load is a pressure, False where it is a tension."""
        return bool(self.load.sum() >= 0.0)

    def controls_as(self, other: Servo) -> bool:
        """True where both control the same kind of load by the same motion."""
        theirs = other.mode, other.axes, other.per_area
        return (self.mode, self.axes, self.per_area) == theirs

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Measured stiffness: change of the relative load per strain, (n,)."""
        squares = np.maximum(self.squared_strains, TINY)
        slope = self.products / squares
        scatter = np.maximum(self.squared_changes / squares - slope**2, 0.0)
        return np.maximum(np.sqrt(slope**2 + SCATTER**2 * scatter), SOFT)

    def update(self, load: NDArray[np.float64], integral: NDArray[np.float64], dt: float) -> Servo:
        """The Servo after a change of speed.

        load: mean since the last change, (n,). integral: the next `load_integral`. dt: of a step.
        """
        missing, time = (self.load - load) / self.scale, self.every * dt
        change = np.where(np.isnan(self.missing), 0.0, missing - self.missing)
        strain = self.speed * time / self.length
        response = self.gain / (self.stiffness * time) * self.length
        steady = self.steady + response * self.gain / (4.0 * DAMPED**2) * missing
        load_fraction = np.abs(load) / self.scale
        limit = LIMIT + (LOADED - LIMIT) * np.minimum(load_fraction, 1.0)
        speed_factor = np.maximum(limit, RELIEF * np.abs(missing) * load_fraction)
        speed_limit = np.minimum(self.largest, np.maximum(speed_factor * response, self.entry))
        mean_error = self.mean_error + (missing - self.mean_error) / self.averaged_intervals
        speed = np.clip(response * mean_error + steady, -speed_limit, speed_limit)
        measured = self._measure_stiffness(change, strain)
        return replace(
            measured,
            speed=speed,
            gain=self.gain + (self.late_gain - self.gain) / FADING,
            steady=speed - response * mean_error,
            missing=missing,
            mean_error=mean_error,
            entry=self.entry * (1.0 - 1.0 / MEMORY),
            next_change=self.next_change + self.every,
            load_integral=np.array(integral, float),
        )

    def _measure_stiffness(self, change: NDArray[np.float64], strain: NDArray[np.float64]) -> Servo:
        """The Servo with the stiffness after a change of the relative load over a strain, (n,).

        At the largest speed it does not fall: constant speed does not measure it.
        """
        updated = replace(
            self,
            squared_changes=self.squared_changes + (change**2 - self.squared_changes) / MEMORY,
            squared_strains=self.squared_strains + (strain**2 - self.squared_strains) / MEMORY,
            products=self.products + (change * strain - self.products) / MEMORY,
        )
        is_kept = (np.abs(self.speed) >= self.largest) & (updated.stiffness < self.stiffness)
        return replace(
            self,
            squared_changes=np.where(is_kept, self.squared_changes, updated.squared_changes),
            squared_strains=np.where(is_kept, self.squared_strains, updated.squared_strains),
            products=np.where(is_kept, self.products, updated.products),
        )


class Environment(Protocol):
    """Walls and cell of a domain.Domain."""

    @property
    def dt(self) -> float: ...
    @property
    def units(self) -> Units: ...
    @property
    def box(self) -> Box | None: ...
    @property
    def cell(self) -> Cell | None: ...
    @property
    def servo(self) -> Servo | None: ...
    @property
    def has_top(self) -> bool: ...
    @property
    def wall_speed(self) -> float: ...


def make_servo(
    drive: Drive,
    domain: Environment,
    step: int,
    integral: Callable[[Servo], NDArray[np.float64]] | None,
) -> Servo | None:
    """The Servo of a Drive from that step on, None where no load is controlled.

    integral(servo): time integral of its measured load (Servo.load_integral); zero if None.
    """
    if not drive.controls_load:
        return None
    if drive.stress is not None:
        mode, axes = CELL, drive.controlled_axes
        load = -np.array([drive.stress[n] for n in axes]) / domain.units("Pa")
    else:
        mode = WALL if domain.has_top else EVEN
        axes = () if mode == WALL else (0, 1, 2)
        load = np.array([drive.pressure]) / domain.units("Pa")
    box, largest = domain.box, _find_largest_speed(drive, mode, axes, domain.units)
    # the height below the top wall, whether it has a bottom or not
    length = np.ones(len(load))
    if mode == WALL and box is not None:
        length = np.diff(box.planes(domain.dt * step)[4:])
    first = start_servo(
        (mode, tuple(axes)), load, gain=drive.gain, largest=largest, length=length, step=step
    )
    if integral is None:  # a plan, in which the motion is not known
        return first
    first = replace(first, load_integral=integral(first))
    speed, last = _measure_approach(domain, mode, axes, step), domain.servo
    widens = (drive.wall_speed if mode == WALL else drive.strain_rate) is None
    return continue_motion(first, last, speed, gain=drive.gain, widens=widens, dt=domain.dt)


def start_servo(
    moved: tuple[str, tuple[int, ...]],
    load: NDArray[np.float64],
    *,
    gain: float | None,
    largest: NDArray[np.float64],
    length: NDArray[np.float64],
    step: int,
    per_area: bool = False,
) -> Servo:
    """The Servo of what is at rest at a step; moved: its mode and axes; gain: None for AT_REST."""
    n, (mode, axes) = len(load), moved
    return Servo(
        mode=mode,
        axes=axes,
        load=load,
        scale=float(np.abs(load).max()),
        gain=gain or AT_REST,
        largest=largest,
        length=length,
        speed=np.zeros(n),
        steady=np.zeros(n),
        missing=np.full(n, np.nan),
        squared_changes=np.full(n, FIRST**2),
        squared_strains=np.full(n, (FIRST / STIFF) ** 2),
        products=np.full(n, -(FIRST**2) / STIFF),
        next_change=step + EVERY,
        every=EVERY,
        load_integral=np.zeros(n),
        averaged_intervals=1,
        mean_error=np.zeros(n),
        late_gain=gain or AT_REST,
        entry=np.zeros(n),
        per_area=per_area,
    )


def _measure_approach(
    domain: Environment, mode: str, axes: tuple[int, ...], step: int
) -> NDArray[np.float64]:
    """Speed or rates (n,) at which walls or faces approach each other at a step."""
    if mode == WALL:
        return np.array([domain.wall_speed])
    time, cell = domain.dt * step, domain.cell
    assert cell is not None
    rates = -cell.speeds(time) / cell.edges(time)
    return np.array([rates.mean()]) if mode == EVEN else rates[list(axes)]


def continue_motion(
    first: Servo,
    last: Servo | None,
    speed: NDArray[np.float64],
    *,
    gain: float | None,
    widens: bool,
    dt: float,
) -> Servo:
    """The Servo `first` of a stage that continues a motion at that speed or rates (n,), if any.

    last: of the stage before, or None. gain: None for IN_MOTION. widens: the largest speed may grow
    to that of the motion. dt: of a step.
    """
    if not speed.any():
        return first
    largest = np.maximum(first.largest, np.abs(speed)) if widens else first.largest
    speed = np.clip(speed, -largest, largest)
    servo = replace(
        first,
        gain=gain or IN_MOTION,
        largest=largest,
        speed=speed,
        steady=speed,
        averaged_intervals=SMOOTH,
        entry=np.abs(speed),
    )
    stiffness: float | NDArray[np.float64] = FIRM
    strains = (speed * servo.every * dt / servo.length) ** 2
    if last is not None and last.controls_as(servo):
        missing = (servo.load - last.load + last.missing * last.scale) / servo.scale
        stiffness = np.maximum(FIRM, last.stiffness * last.scale / servo.scale)
        strains, servo = np.maximum(strains, last.squared_strains), replace(servo, missing=missing)
    strains = np.maximum(strains, first.squared_strains)
    changes, products = stiffness**2 * strains, -stiffness * strains
    return replace(servo, squared_changes=changes, squared_strains=strains, products=products)


def _find_largest_speed(
    drive: Drive, mode: str, axes: tuple[int, ...], units: Units
) -> NDArray[np.float64]:
    """Largest speed or rates of the motion by a Servo of that mode, (n,)."""
    if mode == WALL:
        return np.array([drive.largest_wall_speed]) / units("m/s")
    rates = np.abs(drive.largest_rates) * units("s")
    return rates[:1] if mode == EVEN else rates[list(axes)]
