"""What holds a pressure or a stress: how fast walls and faces move, from what is measured.

Every EVERY steps the load, its mean over these steps, tells the speed that is wanted: the largest
speed times gain times the share of the load that is missing; the speed then goes the part SHARE of
the way there, within the largest. So the wall is a piston that the load drives, with a
damper (the gain) and an inertia (the lag of EVERY / SHARE steps). Where grains give way at a share
f of the largest speed the load that is held is lower by f / gain.

What has been pressed is elastic when it is let go, with a modulus of some STIFF times the pressure
(docs, Loads and shear), and piston and dust swing unless the damper holds them: with c the damper,
T the time between two changes and k the modulus their damping ratio is sqrt(SHARE c / (k T)) / 2,
and the gain is never more than makes that DAMPED.
"""

from dataclasses import asdict, dataclass, replace

import numpy as np

from dusttaichi import units
from dusttaichi.scene import drive as given

EVERY, SHARE = 50, 0.15
STIFF, DAMPED = 1000.0, 0.7
WALL, CELL, EVEN = "wall", "cell", "even"
ARRAYS = ("load", "gain", "largest", "speed", "before")


@dataclass(frozen=True, eq=False)
class Servo:
    """Of one stage. kind: of what it moves: WALL, the top one; CELL, edges of a cell one by one;
    EVEN, all edges alike. axes: numbers of the edges.

    load: wanted, positive in compression [kPa], (n,); scale: what its missing share is a share of.
    gain: (n,). largest: speed [um/us] or rate [1/us] of approach, (n,). speed: that of now. due:
    step of the next change. every: steps between two. before: integral of what the load is measured
    by, as it was at the last change, (n,).
    """

    kind: str
    axes: tuple
    load: np.ndarray
    scale: float
    gain: np.ndarray
    largest: np.ndarray
    speed: np.ndarray
    due: int
    every: int
    before: np.ndarray

    @property
    def presses(self):
        """True where the load is a pressure, False where it is a tension."""
        return bool(self.load.sum() >= 0.0)

    def changed(self, load, integral):
        """The same after a change of speed; load [kPa]: the mean since the last, (n,); integral:
        what `before` is going to be."""
        missing = (self.load - load) / self.scale
        wanted = self.gain * missing * self.largest
        # within bounds after the mean, not before: the load of few contacts swings about its mean
        speed = np.clip(self.speed + SHARE * (wanted - self.speed), -self.largest, self.largest)
        return replace(
            self,
            speed=speed,
            due=self.due + self.every,
            before=np.array(integral, float),
        )

    def halved(self):
        """The same, counted in steps of half the length."""
        return replace(self, due=2 * self.due, every=2 * self.every)

    def to_numbers(self):
        """What JSON can hold."""
        return {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in asdict(self).items()}

    @classmethod
    def from_numbers(cls, numbers):
        own = {n: np.array(numbers[n]) for n in ARRAYS}
        return cls(**(numbers | own | {"axes": tuple(numbers["axes"])}))


def make_servo(drive, domain, step, integral):
    """The Servo of a Drive from that step on, None where no load is held.

    integral(servo): what its load is measured by, up to now (Servo.before); nothing yet if None.
    """
    if not drive.held:
        return None
    if drive.stress is not None:
        kind, axes = CELL, drive.held_axes
        load = -np.array([drive.stress[n] for n in axes]) / units.PRESSURE
    else:
        kind = WALL if domain.has_top else EVEN
        axes = () if kind == WALL else (0, 1, 2)
        load = np.array([drive.pressure]) / units.PRESSURE
    if kind == WALL:
        largest = np.array([drive.wall_speed or given.WALL_SPEED]) / units.SPEED
    else:
        rates = np.abs(drive.strain_rate or (given.STRAIN_RATE,) * 3) * units.TIME
        largest = rates[:1] if kind == EVEN else rates[list(axes)]
    lengths = domain.lengths(step)[2:] if kind == WALL else np.ones(len(largest))
    steady = SHARE / (4.0 * DAMPED**2 * STIFF * EVERY * domain.dt) * lengths / largest
    at_first = Servo(
        kind=kind,
        axes=tuple(axes),
        load=load,
        scale=float(np.abs(load).max()),
        gain=np.minimum(drive.gain or given.GAIN, steady),
        largest=largest,
        speed=np.zeros(len(load)),
        due=step + EVERY,
        every=EVERY,
        before=np.zeros(len(load)),
    )
    speed = np.clip(domain.approach(at_first, step), -largest, largest)
    before = at_first.before if integral is None else integral(at_first)
    return replace(at_first, speed=speed, before=before)
