"""How many workers the steps get: as many as are fastest on the cores that are free just now."""

from time import perf_counter

LOOK, LOOK_CLOSER = 0.03, 0.2  # s of steps that tell a rate roughly, and well
EVERY, SELDOM = 5.0, 80.0  # s between two trials: at first, and after many in vain
GAIN = 1.03  # by which another number must be faster
FALLEN = 0.7  # share of the rate before that says: the machine has other work now


class WorkerChoice:
    """Makes the steps of a simulation, with the number of workers that is fastest.

    Now and then another number is tried: half of it or twice as many, down to one and up to all.
    Workers that wait for one which the system does not run lose more than they gain, tenfold where
    they share a core; so steps are made in pieces, and a trial that goes wrong is short. The bits
    do not depend on any of it. sim: with `advance(steps)` and `threads`; fixed: never change it.
    """

    def __init__(self, sim, fixed, clock=perf_counter):
        self.sim, self.clock = sim, clock
        self.ladder = ladder(sim.threads)
        self.fixed = fixed or len(self.ladder) == 1
        self.rate = None  # steps a second, with the number of now
        self.before = None  # (workers, rate) that a trial is compared with
        self.closer = False  # the trial has had its first look
        self.tried, self.wait = clock(), 0.0  # the first trial comes as soon as a rate is known
        self.rises = False  # which way the last trial went
        self._begin(None)

    def advance(self, steps):
        """Make so many steps."""
        while steps > 0:
            piece = steps if self.fixed else min(steps, self._to_make())
            began = self.clock()
            self.sim.advance(piece)
            steps -= piece
            if not self.fixed:
                self.made, self.seconds = self.made + piece, self.seconds + self.clock() - began
                if self._is_over():
                    self._decide(self.made / max(self.seconds, 1e-9))

    # -- what is timed now, which may be made in several calls ------------------------------------

    def _begin(self, seconds):
        """Time as many steps as take that long at the rate known; None: none is known."""
        self.planned = None if seconds is None else max(1, int(seconds * self.rate))
        self.made, self.seconds = 0, 0.0

    def _to_make(self):
        return max(16, self.made) if self.planned is None else self.planned - self.made

    def _is_over(self):
        return self.seconds >= LOOK if self.planned is None else self.made >= self.planned

    # -- what follows from it --------------------------------------------------------------------

    def _decide(self, rate):
        if self.before is None:
            if self.rate is not None and rate < FALLEN * self.rate:
                self.wait = 0.0
            self.rate = rate
            if self.clock() - self.tried >= self.wait:
                self.before, self.closer = (self.sim.threads, rate), False
                self.sim.threads = self._other()
                self._begin(LOOK)
            else:
                self._begin(LOOK_CLOSER)
            return
        workers, known = self.before
        if not self.closer and rate > FALLEN * known:
            self.closer = True
            self._begin(LOOK_CLOSER)
            return
        better = rate > GAIN * known
        if better:
            self.rate = rate
        else:
            self.sim.threads = workers
        self.wait = EVERY if better or self.wait == 0.0 else min(2.0 * self.wait, SELDOM)
        self.before, self.tried = None, self.clock()
        self._begin(LOOK_CLOSER)

    def _other(self):
        """The number that the next trial is of: up and down the ladder in turn."""
        here = self.ladder.index(self.sim.threads)
        self.rises = here == 0 or (here + 1 < len(self.ladder) and not self.rises)
        return self.ladder[here + 1 if self.rises else here - 1]


def ladder(most):
    """Numbers of workers to choose among: 1, 2, 4 ... and all."""
    found = [1]
    while 2 * found[-1] < most:
        found.append(2 * found[-1])
    return found + [most] if most > 1 else found
