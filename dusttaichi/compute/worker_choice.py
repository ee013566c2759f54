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
        # the piece that is timed, made in one or several calls; its steps, None as long as no rate
        # is known
        self.pieces, self.made, self.seconds = self._choose(), 0, 0.0
        self.planned = next(self.pieces)

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
                    self.planned = self.pieces.send(self.made / max(self.seconds, 1e-9))
                    self.made, self.seconds = 0, 0.0

    def _to_make(self):
        return max(16, self.made) if self.planned is None else self.planned - self.made

    def _is_over(self):
        return self.seconds >= PIECE if self.planned is None else self.made >= self.planned

    # -- decisions: generators of the steps of each piece, to which its rate is sent [1/s] ---------

    def _choose(self):
        """Set the number of workers, after a trial of another one whenever one is due."""
        own, tried, wait, rises = self.sim.threads, self.clock(), 0.0, False
        rate = yield None
        while True:
            if self.clock() - tried >= wait:
                # up and down the ladder in turn
                here = self.ladder.index(own)
                rises = here == 0 or (here + 1 < len(self.ladder) and not rises)
                other = self.ladder[here + 1 if rises else here - 1]
                ratio, its_rate = yield from self._try(own, other, rate)
                if ratio > GAIN:
                    own, rate, wait = other, its_rate, EVERY
                else:
                    most = SELDOM if ratio < HOPELESS else OFTEN
                    wait = min(2.0 * wait, most) if wait else EVERY
                self.sim.threads, tried = own, self.clock()
            before, rate = rate, (yield _steps(SEGMENT, rate))
            if rate < FALLEN * before:
                wait = 0.0  # the machine has other work now

    def _try(self, own, other, rate):
        """A trial; rate: of the own number. Returns that of the other over it, and itself."""
        self.sim.threads = other
        first = yield _steps(FIRST_PIECE, rate)
        if first < HOPELESS * rate:
            return first / rate, first
        rates = []  # the other number first
        while True:
            rates.append((yield _steps(PIECE, rate)))
            ratios = [a / b for a, b in zip(rates[::2], rates[1::2], strict=False)]
            faster = sum(ratio > GAIN for ratio in ratios)
            if max(faster, len(ratios) - faster) > PAIRS // 2:
                return median(ratios), median(rates[::2])
            self.sim.threads = own if len(rates) % 2 else other


def _steps(seconds, rate):
    """Steps that take that long."""
    return max(1, int(seconds * rate))


def ladder(most):
    """Numbers of workers to choose among: 1, 2, 4 ... and all."""
    found = [1]
    while 2 * found[-1] < most:
        found.append(2 * found[-1])
    return found + [most] if most > 1 else found
