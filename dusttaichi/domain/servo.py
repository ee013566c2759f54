"""Load control: the speeds of walls and faces from the measured pressure or stress.

Every EVERY steps, a time T, the load is known as its mean over them, and e, the share of it that is
missing. The speed v of approach changes by that of a proportional and integral controller,

    v += g / (k T) (e - e_before + e T / T_i),    T_i = 4 DAMPED^2 T / g,

within the largest speed. g is the gain, and k the stiffness as it is measured: what e has changed
by over the way, roots of mean squares of the last MEMORY changes or so; a load that changes by
itself makes it larger and the servo slower, never the other way. So a load on a spring approaches
its value with the damping ratio DAMPED whatever the spring, and where dust gives way at a steady
rate, as in shear, nothing is missing on average: v is the sum of e.

What yields slowly is stiff at once (its waves, and when it is let go), and the servo can stop no
faster than a stiff sample allows: |v| is no more than LIMIT g / (k T), a speed that a load missing
by that share would bring. Walls and faces are at rest when a stage begins to hold a load.
"""

from dataclasses import asdict, dataclass, replace

import numpy as np

from dusttaichi import units
from dusttaichi.scene import drive as given

EVERY, MEMORY = 25, 40
DAMPED, LIMIT = 1.0, 0.5
STIFF, SOFT = 1e5, 1.0  # k at first, stiffer than dust is (1e3 times its load), and at least
FIRST = 0.01  # change of e that the first k is worth
TINY = 1e-300
WALL, CELL, EVEN = "wall", "cell", "even"
ARRAYS = ("load", "largest", "length", "speed", "missing", "changes", "ways", "before")


@dataclass(frozen=True, eq=False)
class Servo:
    """Of one stage. kind: of what it moves: WALL, the top one; CELL, edges of a cell one by one;
    EVEN, all edges alike. axes: numbers of the edges.

    load: wanted, positive in compression [kPa], (n,); scale: what its missing share is a share of.
    gain: g. largest: speed [um/us] or rate [1/us] of approach, (n,). length: what makes strains of
    ways: of the room [um], or 1, (n,). speed: that of now, (n,). missing: e of the last change,
    (n,), not a number before the first. changes, ways: mean squares of what e has changed by and of
    the strains, (n,). due: step of the next change. every: steps between two. before: integral of
    what the load is measured by, as it was at the last change, (n,).
    """

    kind: str
    axes: tuple
    load: np.ndarray
    scale: float
    gain: float
    largest: np.ndarray
    length: np.ndarray
    speed: np.ndarray
    missing: np.ndarray
    changes: np.ndarray
    ways: np.ndarray
    due: int
    every: int
    before: np.ndarray

    @property
    def presses(self):
        """True where the load is a pressure, False where it is a tension."""
        return bool(self.load.sum() >= 0.0)

    @property
    def stiffness(self):
        """Measured: share of the load for a strain, (n,)."""
        return np.maximum(np.sqrt(self.changes / np.maximum(self.ways, TINY)), SOFT)

    def changed(self, load, integral, dt):
        """The same after a change of speed; load [kPa]: the mean since the last, (n,); integral:
        what `before` is going to be; dt: of a step [us]."""
        missing, time = (self.load - load) / self.scale, self.every * dt
        change = np.where(np.isnan(self.missing), 0.0, missing - self.missing)
        way = self.speed * time / self.length
        new = replace(
            self,
            missing=missing,
            changes=self.changes + (change**2 - self.changes) / MEMORY,
            ways=self.ways + (way**2 - self.ways) / MEMORY,
            due=self.due + self.every,
            before=np.array(integral, float),
        )
        response = self.gain / (new.stiffness * time) * self.length
        speed = self.speed + response * (change + self.gain / (4.0 * DAMPED**2) * missing)
        most = np.minimum(self.largest, LIMIT * response)
        return replace(new, speed=np.clip(speed, -most, most))

    def halved(self):
        """The same, counted in steps of half the length."""
        return replace(self, due=2 * self.due, every=2 * self.every)

    def to_numbers(self):
        """State as JSON."""
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
    n = len(load)
    first = Servo(
        kind=kind,
        axes=tuple(axes),
        load=load,
        scale=float(np.abs(load).max()),
        gain=drive.gain or given.GAIN,
        largest=_largest(drive, kind, axes),
        length=_height(domain, step) if kind == WALL else np.ones(n),
        speed=np.zeros(n),
        missing=np.full(n, np.nan),
        changes=np.full(n, FIRST**2),
        ways=np.full(n, (FIRST / STIFF) ** 2),
        due=step + EVERY,
        every=EVERY,
        before=np.zeros(n),
    )
    return first if integral is None else replace(first, before=integral(first))


def _height(domain, step):
    """Of the room below the top wall [um], (1,), whether it has a bottom or not."""
    planes = domain.box.planes(domain.dt * step)
    return planes[5:] - planes[4:5]


def _largest(drive, kind, axes):
    """Largest speed [um/us] or rates [1/us] of what a Servo of that kind moves, (n,)."""
    if kind == WALL:
        return np.array([drive.wall_speed or given.WALL_SPEED]) / units.SPEED
    least = max(given.STRAIN_RATE, 2.0 * abs(drive.shear_rate or 0.0))
    rates = np.abs(drive.strain_rate or (least,) * 3) * units.TIME
    return rates[:1] if kind == EVEN else rates[list(axes)]
