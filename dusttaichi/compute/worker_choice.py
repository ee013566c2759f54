"""Number of workers of the steps: the fastest with the cores that are free at the moment."""

from statistics import median
from time import perf_counter

from dusttaichi.compute.affinity import POOL

FIRST_PIECE, PIECE = 0.01, 0.03  # s of steps of the first piece of a trial, and of each other
SEGMENT = 0.2  # s of steps between two measurements of the rate
PAIRS = 5  # most pieces of a trial with each of the two numbers: more than half of them decide
# s between trials: the first interval, and the longest after a close and after a clear result
EVERY, OFTEN, SELDOM = 5.0, 20.0, 80.0
GAIN = 1.01  # factor by which another number must be faster
FALLEN = 0.7  # share of the previous rate below which the machine must have other work
HOPELESS = 0.5  # share of the rate below which the first piece ends a trial


class WorkerChoice:
    """Makes the steps of a simulation with the fastest number of workers.

    At intervals another number is tried: half of it or twice as many, down to one and up to all.
    The two alternate, because other work on the machine changes the rate of both; the median of the
    ratios decides. Workers that wait for one which the system does not run lose more than they
    gain, tenfold if they share a core. Steps are therefore made in pieces, and a short first piece
    ends a hopeless trial. Results do not depend on the number. sim: with `advance(steps)` and
    `threads`; fixed: never change the number.
    """

    def __init__(self, sim, fixed, clock=perf_counter):
        self.sim, self.clock = sim, clock
        self.ladder = ladder(sim.threads)
        self.fixed = fixed or len(self.ladder) == 1
        self.own = sim.threads  # the number chosen
        self.rate = None  # steps a second, with that number
        self.other = None  # the number on trial; None: there is no trial
        self.rates = None  # of the pieces of a trial, the other number first; None before these
        self.tried, self.wait = clock(), 0.0  # the first trial comes as soon as a rate is known
        self.rises = False  # whether the last trial was of a larger number
        self._begin(None)

    def advance(self, steps):
        """Make that many steps."""
        while steps > 0:
            piece = steps if self.fixed else min(steps, self._to_make())
            POOL.serve(self.sim.threads)
            began = self.clock()
            self.sim.advance(piece)
            steps -= piece
            if not self.fixed:
                self.made, self.seconds = self.made + piece, self.seconds + self.clock() - began
                if self._is_over():
                    self._decide(self.made / max(self.seconds, 1e-9))

    # -- the piece that is timed, made in one or several calls ------------------------------------

    def _begin(self, seconds):
        """Time as many steps as take that long at the known rate; None: no rate is known."""
        self.planned = None if seconds is None else max(1, int(seconds * self.rate))
        self.made, self.seconds = 0, 0.0

    def _to_make(self):
        return max(16, self.made) if self.planned is None else self.planned - self.made

    def _is_over(self):
        return self.seconds >= PIECE if self.planned is None else self.made >= self.planned

    # -- decisions --------------------------------------------------------------------

    def _decide(self, rate):
        if self.other is None:
            self._look(rate)
        elif self.rates is None:
            if rate < HOPELESS * self.rate:
                self._end_trial(rate / self.rate)
            else:
                self.rates = []
                self._begin(PIECE)
        else:
            self.rates.append(rate)
            ratios = [a / b for a, b in zip(self.rates[::2], self.rates[1::2], strict=False)]
            faster = sum(ratio > GAIN for ratio in ratios)
            if max(faster, len(ratios) - faster) > PAIRS // 2:
                self._end_trial(median(ratios))
            else:
                self.sim.threads = self.own if len(self.rates) % 2 else self.other
                self._begin(PIECE)

    def _look(self, rate):
        """Note the rate of the chosen number; begin a trial if one is due."""
        if self.rate is not None and rate < FALLEN * self.rate:
            self.wait = 0.0  # the machine has other work now
        self.rate = rate
        if self.clock() - self.tried < self.wait:
            self._begin(SEGMENT)
            return
        self.sim.threads = self.other = self._next()
        self._begin(FIRST_PIECE)

    def _end_trial(self, ratio):
        """The other number is `ratio` times as fast as the chosen one."""
        if ratio > GAIN:
            self.own, self.rate, self.wait = self.other, median(self.rates[::2]), EVERY
        else:
            most = SELDOM if ratio < HOPELESS else OFTEN
            self.wait = min(2.0 * self.wait, most) if self.wait else EVERY
        self.sim.threads, self.tried = self.own, self.clock()
        self.other = self.rates = None
        self._begin(SEGMENT)

    def _next(self):
        """Number of the next trial: up and down the ladder in turn."""
        here = self.ladder.index(self.own)
        self.rises = here == 0 or (here + 1 < len(self.ladder) and not self.rises)
        return self.ladder[here + 1 if self.rises else here - 1]


def ladder(most):
    """Numbers of workers to choose among: 1, 2, 4 ... and all."""
    found = [1]
    while 2 * found[-1] < most:
        found.append(2 * found[-1])
    return found + [most] if most > 1 else found
