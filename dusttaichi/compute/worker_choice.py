"""Number of workers of the steps: the fastest with the cores that are free at the moment."""

from dataclasses import dataclass
from statistics import fmean, harmonic_mean, median
from time import perf_counter

from dusttaichi.compute.affinity import POOL

FIRST_PIECE, PIECE = 0.01, 0.03  # s of steps of the first piece of a trial, and of each other
SEGMENT, CHECKS = 0.2, 4  # s of steps between two measurements of the rate; pieces of them
PAIRS = 5  # most pieces of a trial with each of the two numbers: more than half of them decide
# s between trials: the first interval, and the longest after a close and after a clear result
EVERY, OFTEN, SELDOM = 5.0, 20.0, 80.0
GAIN = 1.01  # factor by which another number must be faster
FALLEN = 0.7  # share of the previous rate below which the machine must have other work
HOPELESS = 0.5  # share of the rate below which the first piece ends a trial
# share of the time in which one of several workers waits for a core, and all others for it: from
# there on fewer are faster. Share for a single one that says that no core is free for another
CROWDED, TAKEN = 0.3, 0.1


@dataclass(frozen=True)
class Timing:
    """Steps per second of a piece, and the share of its time in which workers waited for a core."""

    rate: float
    waiting: float = 0.0


class WorkerChoice:
    """Computes the steps of a simulation with the fastest number of workers.

    At intervals another number is tried: half of it or twice as many, down to one and up to all.
    The two alternate, because other work on the machine changes the rate of both; the median of the
    ratios decides. Workers that wait for one which the system does not run lose more than they
    gain, tenfold if they share a core. A trial therefore has several pieces, and a short first one
    ends a hopeless trial. Where the system measures how long threads wait for cores, a number of
    workers that wait is given up without a trial, whose result would be long in coming and
    uncertain beside other programs. Results do not depend on the number. sim: with
    `advance(steps)` and `threads`; fixed: never change the number; clock, measure_waiting: time,
    and time that the threads have waited for cores [s].
    """

    def __init__(self, sim, fixed, clock=perf_counter, measure_waiting=POOL.measure_waiting):
        self.sim, self.clock, self.measure_waiting = sim, clock, measure_waiting
        self.worker_numbers = list_worker_numbers(sim.threads)
        self.fixed = fixed or len(self.worker_numbers) == 1
        # the piece that is timed, in one or several calls; its steps, None as long as no rate
        # is known
        self.pieces, self.steps_done, self.seconds, self.waiting = self._choose(), 0, 0.0, 0.0
        self.planned = next(self.pieces)

    def advance(self, steps):
        """Compute that many steps."""
        while steps > 0:
            piece = steps if self.fixed else min(steps, self._to_make())
            POOL.serve(self.sim.threads)
            steps -= piece
            if self.fixed:
                self.sim.advance(piece)
                continue
            began, waited = self.clock(), self.measure_waiting()
            self.sim.advance(piece)
            self.steps_done, self.seconds = (
                self.steps_done + piece,
                self.seconds + self.clock() - began,
            )
            self.waiting += self.measure_waiting() - waited
            if self._is_over():
                seconds = max(self.seconds, 1e-9)
                timing = Timing(self.steps_done / seconds, self.waiting / seconds)
                self.planned = self.pieces.send(timing)
                self.steps_done, self.seconds, self.waiting = 0, 0.0, 0.0

    def _to_make(self):
        return max(16, self.steps_done) if self.planned is None else self.planned - self.steps_done

    def _is_over(self):
        return self.seconds >= PIECE if self.planned is None else self.steps_done >= self.planned

    # -- decisions: generators of the steps of each piece, to which its Timing is sent -------------

    def _choose(self):
        """Set the number of workers, after a trial of another one whenever one is due."""
        workers, last_trial, wait, rises = self.sim.threads, self.clock(), 0.0, False
        timing = yield None
        while True:
            index = self.worker_numbers.index(workers)
            if _is_crowded(workers, timing):
                workers, last_trial, wait = self.worker_numbers[index - 1], self.clock(), EVERY
                self.sim.threads = workers
            elif self.clock() - last_trial >= wait:
                # up and down the numbers in turn
                rises = index == 0 or (index + 1 < len(self.worker_numbers) and not rises)
                candidate = self.worker_numbers[index + 1 if rises else index - 1]
                ratio, its_timing = yield from self._try(workers, candidate, timing)
                if ratio > GAIN:
                    workers, timing, wait = candidate, its_timing, EVERY
                else:
                    longest_wait = SELDOM if ratio < HOPELESS else OFTEN
                    wait = min(2.0 * wait, longest_wait) if wait else EVERY
                self.sim.threads, last_trial = workers, self.clock()
            previous_rate, timing = timing.rate, (yield from _segment(workers, timing.rate))
            if timing.rate < FALLEN * previous_rate:
                wait = 0.0  # the machine has other work now

    def _try(self, workers, candidate, timing):
        """Try a number of workers; timing: of the present one. Returns (ratio of rates, Timing).

        The ratio is HOPELESS where workers of the larger number wait for cores.
        """
        rate = timing.rate
        if candidate > workers and timing.waiting > TAKEN * workers:
            return HOPELESS, timing
        self.sim.threads = candidate
        first = yield _steps(FIRST_PIECE, rate)
        if first.rate < HOPELESS * rate:
            return first.rate / rate, first
        timings = []  # the other number first
        crowded = candidate > workers and _is_crowded(candidate, first)
        while not crowded:
            timings.append((yield _steps(PIECE, rate)))
            if self.sim.threads == candidate:
                crowded = candidate > workers and _is_crowded(candidate, timings[-1])
            rates = [trial.rate for trial in timings]
            ratios = [a / b for a, b in zip(rates[::2], rates[1::2], strict=False)]
            faster = sum(ratio > GAIN for ratio in ratios)
            if max(faster, len(ratios) - faster) > PAIRS // 2:
                waiting = median(trial.waiting for trial in timings[::2])
                return median(ratios), Timing(median(rates[::2]), waiting)
            self.sim.threads = workers if len(rates) % 2 else candidate
        return HOPELESS, first


def _is_crowded(workers, timing):
    """True where several workers waited for cores for so long that fewer are faster."""
    return workers > 1 and timing.waiting > CROWDED


def _segment(workers, rate):
    """Timing of SEGMENT of steps, made in CHECKS pieces; it ends where the workers are crowded."""
    timings = []
    for _ in range(CHECKS):
        timings.append((yield _steps(SEGMENT / CHECKS, rate)))
        if _is_crowded(workers, timings[-1]):
            return timings[-1]
    return Timing(
        harmonic_mean([piece.rate for piece in timings]), fmean(piece.waiting for piece in timings)
    )


def _steps(seconds, rate):
    """Steps that take that long."""
    return max(1, int(seconds * rate))


def list_worker_numbers(largest):
    """Numbers of workers to choose among: 1, 2, 4 ... and all."""
    numbers = [1]
    while 2 * numbers[-1] < largest:
        numbers.append(2 * numbers[-1])
    return numbers + [largest] if largest > 1 else numbers
