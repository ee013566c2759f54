"""How many workers the steps get: all, or one where another process has the cores."""

import time as real_time

EVERY = 10.0  # s between two trials
LEAST = 0.1  # s of steps that tell a rate
GAIN = 1.03  # by which the other number must be faster


class WorkerChoice:
    """Tries the other number of workers now and then and takes the faster.

    The bits do not depend on it. Workers that wait for one which the system does not run lose more
    than they gain.
    """

    def __init__(self, sim, fixed):
        self.sim, self.most = sim, sim.threads
        self.alone = fixed or self.most == 1
        self.tried = real_time.perf_counter()
        self.before = None  # (workers, rate) that a trial is compared with

    def after(self, steps, seconds):
        """Told what so many steps took; may change sim.threads for the next ones."""
        if self.alone or seconds < LEAST:
            return
        rate, now = steps / seconds, real_time.perf_counter()
        if self.before is not None:
            workers, known = self.before
            if rate < GAIN * known:
                self.sim.threads = workers
            self.before, self.tried = None, now
        elif now - self.tried > EVERY:
            self.before = (self.sim.threads, rate)
            self.sim.threads = 1 if self.sim.threads > 1 else self.most
