"""Search for the sticking speed of a collision by bundles of speeds."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.scene import quantities
from dusttaichi.studies.sticking.collision import Collision

TOGETHER = 16  # speeds of a bundle
ROUNDS = 12  # most bundles of a search
WIDER = 10.0  # growth of a bracket without the sticking speed


@dataclass(frozen=True)
class Sticking:
    """The lowest speed at which the bodies of a collision do not stick.

    low, high [m/s]: two neighbouring speeds, of which only the first leads to sticking. closed
    [m/s]: `closed_form`. speeds [m/s], bound: all simulated ones, in ascending order. time_step
    [s]: of the fastest. start: remark on the initial positions, or "".
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


class Search:
    """Study of the sticking speed of a scene, by bundles of speeds.

    The sample is a pair, a collision, or explicit grains at a wall; its stop is relative to the
    first contact. tolerance: largest width of the bracket over its lower end. low, high [m/s]:
    first bracket, by default about the closed form. log: called with a line on each bundle.
    `points` and the constructor raise DustError for a scene without two bodies, without a time of
    the stop, or without a sticking speed.
    """

    directory = file = None  # nothing is written
    timed = False

    def __init__(self, scene, tolerance=1e-3, low=None, high=None, *, log=lambda text: None):
        self.scene, self.tolerance, self.log = scene, tolerance, log
        self.collision = collision = Collision(scene, tolerance)
        few = len(collision.sample) <= 2
        low = collision.closed * (0.25 if few else 1.0) if low is None else low
        high = max(collision.closed * (4.0 if few else 100.0), 4.0 * low) if high is None else high
        if not 0.0 < low < high:
            raise DustError(
                f"--low {low:g} m/s, --high {high:g} m/s: both must be above 0, and the second "
                "above the first."
            )
        self.bracket, self._rounds, self._asked = (low, high), 0, np.geomspace(low, high, TOGETHER)

    def points(self, found):
        """The next bundle, none where the bracket is narrow enough."""
        wanted = [self.collision.request(speed) for speed in self._asked]
        if not all(point.label in found for point in wanted):
            return wanted
        for failed in (one for one in found.values() if not one.ok):
            raise DustError(failed.text)
        self._rounds += 1
        speeds, bound = _all_speeds(found)
        own = sum(found[point.label].measured["bound"] for point in wanted)
        self.log(
            f"{len(wanted)} speeds from {self._asked[0]:.5g} to {self._asked[-1]:.5g} m/s: "
            f"{own} bound"
        )
        low, high = self.bracket
        first = int(np.argmin(bound))
        if bound.all():
            self.bracket, count, inside = (high, high * WIDER), TOGETHER, slice(None)
        elif first == 0:
            self.bracket, count, inside = (low / WIDER, low), TOGETHER, slice(None)
        else:  # its ends are known
            self.bracket = float(speeds[first - 1]), float(speeds[first])
            if self.bracket[1] - self.bracket[0] <= self.tolerance * self.bracket[0]:
                return wanted
            count, inside = TOGETHER + 2, slice(1, -1)
        if self._rounds == ROUNDS:
            what = "all" if bound.all() else "none" if not bound.any() else "some"
            raise DustError(
                f"No sticking speed was found: between {speeds[0]:.3g} and {speeds[-1]:.3g} m/s "
                f"{what} of the collisions lead to sticking. Try another --low and --high, or a "
                "longer stop.time."
            )
        self._asked = np.geomspace(*self.bracket, count)[inside]
        return [self.collision.request(speed) for speed in self._asked]

    def result(self, found):
        """The Sticking, once all points are found."""
        steps = [one.measured["time_step"] for one in found.values()]
        own = self.collision.closed, *_all_speeds(found), min(steps), self.collision.start
        return Sticking(*self.bracket, *own)


def _all_speeds(found):
    """(speeds [m/s], bound), in ascending order."""
    tried = {one.point.arguments["speed"]: one.measured["bound"] for one in found.values()}
    speeds = np.array(sorted(tried))
    return speeds, np.array([tried[speed] for speed in speeds])


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
