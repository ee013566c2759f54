"""Search for the sticking speed of a collision by batches of speeds."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.scene import quantities
from dusttaichi.studies.sticking.collision import Collision

TOGETHER = 16  # speeds of a batch
ROUNDS = 12  # most batches of a search
WIDER = 10.0  # growth of a bracket without the sticking speed


@dataclass(frozen=True)
class Sticking:
    """The lowest speed at which the bodies of a collision do not stick.

    low, high [m/s]: two neighbouring speeds, of which only the first leads to sticking. closed
    [m/s]: `closed_form`. speeds [m/s], bound: all simulated ones, in ascending order. time_step
    [s]. start: remark on the initial positions, or "".
    """

    low: float
    high: float
    closed: float
    speeds: np.ndarray
    bound: np.ndarray
    time_step: float
    start: str = ""

    @property
    def speed(self):
        """Middle of the bracket [m/s]."""
        return 0.5 * (self.low + self.high)

    @property
    def again(self):
        """Simulated speeds above the bracket that lead to sticking, too [m/s]."""
        return self.speeds[(self.speeds > self.high) & self.bound]


def sticking(scene, tolerance=1e-3, low=None, high=None, *, log=lambda text: None):
    """The Sticking of a scene: sample kind pair or collision, or explicit grains at a wall.

    tolerance: largest width of the bracket over its lower end. low, high [m/s]: first bracket, by
    default about the closed form. log: called with a line on each batch. The stop of the scene
    is relative to the first contact. Raises DustError for a scene without two bodies, without a
    time of the stop, whose bodies miss each other, or without a sticking speed.
    """
    collision = Collision(scene, tolerance)
    few = len(collision.sample) <= 2
    low = collision.closed * (0.25 if few else 1.0) if low is None else low
    high = max(collision.closed * (4.0 if few else 100.0), 4.0 * low) if high is None else high
    if not 0.0 < low < high:
        raise DustError(
            f"--low {low:g} m/s, --high {high:g} m/s: both must be above 0, and the second above "
            "the first."
        )
    tried = {}
    inside = slice(None)  # of the speeds from low to high, without the ends once they are known
    for _ in range(ROUNDS):
        count = TOGETHER if inside == slice(None) else TOGETHER + 2
        speeds = np.geomspace(low, high, count)[inside]
        found = collision.outcomes(speeds)
        tried |= {float(v): outcome.bound for v, outcome in zip(speeds, found, strict=True)}
        all_speeds = np.array(sorted(tried))
        bound = np.array([tried[v] for v in all_speeds])
        first = int(np.argmin(bound))
        log(
            f"{len(speeds)} speeds from {speeds[0]:.5g} to {speeds[-1]:.5g} m/s: "
            f"{sum(outcome.bound for outcome in found)} bound"
        )
        if bound.all():
            low, high, inside = high, high * WIDER, slice(None)
        elif first == 0:
            low, high, inside = low / WIDER, low, slice(None)
        else:
            low, high = float(all_speeds[first - 1]), float(all_speeds[first])
            inside = slice(1, -1)
            if high - low <= tolerance * low:
                own = collision.closed, all_speeds, bound, collision.time_step, collision.start
                return Sticking(low, high, *own)
    raise DustError(
        f"No sticking speed was found: between {all_speeds[0]:.3g} and {all_speeds[-1]:.3g} m/s "
        f"{'all' if bound.all() else 'none' if not bound.any() else 'some'} of the collisions "
        "lead to sticking. Try another --low and --high, or a longer stop.time."
    )


def rows(found):
    """Rows (name, value) of text of a Sticking."""
    lines = [
        ("sticking speed", f"{found.speed:.6g} ± {0.5 * (found.high - found.low):.1g} m/s"),
        ("two grains (or grain and wall), no damping", f"{found.closed:.6g} m/s"),
        ("time step", f"{found.time_step * 1e12:.4g} ps"),
        ("simulated speeds", str(len(found.speeds))),
    ]
    if found.start:
        lines.append(("initial positions", found.start))
    if len(found.again):
        lines.append(("sticking also at", ", ".join(f"{v:.4g}" for v in found.again)))
    return lines


def speed_of(name, text):
    """The speed [m/s] of an option; None without it. Raises DustError."""
    return None if text is None else quantities.parse(text, "speed", name)
