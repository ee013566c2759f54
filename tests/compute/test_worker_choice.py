"""The choice of how many workers the steps get, on a machine whose clock the test turns."""

import numpy as np
import pytest

from dusttaichi.compute.worker_choice import WorkerChoice, list_worker_numbers


class Machine:
    """A simulation whose steps take as long as `cost` says of the number of workers, in s.

    waiting: share of the time in which the workers wait for cores, by their number.
    """

    def __init__(self, threads, cost, waiting=lambda n: 0.0):
        self.threads, self.cost, self.waiting = threads, cost, waiting
        self.now, self.steps, self.waits, self.spent = 0.0, 0, 0.0, {}

    def advance(self, steps):
        took = steps * self.cost(self.threads)
        self.now += took
        self.waits += took * self.waiting(self.threads)
        self.spent[self.threads] = self.spent.get(self.threads, 0.0) + took
        self.steps += steps

    def measure_waiting(self):
        return self.waits

    def clock(self):
        return self.now


def run(machine, steps, call=1000, fixed=False):
    choice = WorkerChoice(machine, fixed, machine.clock, machine.measure_waiting)
    first_steps = machine.steps
    while machine.steps - first_steps < steps:
        choice.advance(call)
    return choice


def test_ladder():
    assert [list_worker_numbers(n) for n in (1, 2, 3, 8)] == [[1], [1, 2], [1, 2, 3], [1, 2, 4, 8]]


@pytest.mark.parametrize("call", [1, 37, 10_000])
def test_the_fastest_is_found_whatever_the_calls(call):
    """Four of eight workers are best here, and every step asked for is made."""
    machine = Machine(8, lambda n: 1e-3 * {1: 4.0, 2: 2.2, 4: 1.4, 8: 2.0}[n])
    run(machine, 20_000, call)
    assert machine.threads == 4
    assert machine.steps == -(-20_000 // call) * call


@pytest.mark.parametrize(
    "cost, threads, largest",
    [
        # two workers that share a core are ten times slower: within a minute the trials of it have
        # cost less than a twentieth, and no call is longer than it must be
        (lambda n, steps: 1e-3 * {1: 1.0, 2: 10.0}[n], 1, 1.05),
        # the first steps find cold caches: taken as the rate, one worker would seem the faster
        (lambda n, steps: {1: 1.6, 2: 1.0}[n] * (1e-3 if steps > 100 else 4e-3), 2, 1.03),
    ],
)
def test_trials_and_a_slow_beginning_cost_little(cost, threads, largest):
    machine = Machine(2, lambda n: cost(n, machine.steps))
    run(machine, 60_000)
    assert machine.threads == threads
    assert machine.now < 60.0 * largest


def test_a_machine_that_becomes_busy_is_noticed_at_once():
    busy = [False]
    machine = Machine(2, lambda n: 1e-3 * (10.0 if busy[0] and n == 2 else 2.0 / n))
    choice = run(machine, 30_000)
    assert machine.threads == 2
    busy[0], begin_time, steps = True, machine.now, machine.steps
    while machine.steps - steps < 10_000:
        choice.advance(1000)
    assert machine.threads == 1
    # alone it takes 20 s; noticing takes one stretch at the slow rate, 0.2 s tenfold
    assert machine.now - begin_time < 25.0
    busy[0] = False
    while machine.steps - steps < 100_000:
        choice.advance(1000)
    assert machine.threads == 2


@pytest.mark.parametrize("waiting", [{1: 0.0, 2: 0.5}, {1: 0.4, 2: 1.0}])
def test_workers_that_wait_for_cores_are_left_at_once(waiting):
    """Beside one and two programs on two cores. Rates change by half from piece to piece there; by
    such rates two workers would often seem the faster."""
    rng = np.random.default_rng(3)
    machine = Machine(2, lambda n: 1e-3 * n * rng.uniform(0.5, 1.5), waiting.get)
    choice = run(machine, 60_000)
    assert machine.threads == 1 and machine.spent[2] < 0.01 * machine.now
    machine.waiting = lambda n: 0.0  # the programs end
    machine.cost = lambda n: 1e-3 / n
    for _ in range(90):
        choice.advance(1000)
    assert machine.threads == 2


def test_of_many_workers_half_remain_where_some_wait():
    machine = Machine(16, lambda n: 1e-3 / n, lambda n: 0.5 if n == 16 else 0.0)
    run(machine, 200_000)
    assert machine.threads == 8


def test_rates_decide_where_workers_wait_a_little():
    machine = Machine(2, lambda n: 1e-3 / n**0.8, lambda n: 0.1 * n)
    run(machine, 60_000)
    assert machine.threads == 2


def test_fixed_numbers_and_single_ones_are_left_alone():
    for threads, fixed in ((2, True), (1, False)):
        machine = Machine(threads, lambda n: 10.0 if n == 2 else 1.0)
        run(machine, 100, fixed=fixed)
        assert machine.threads == threads


@pytest.mark.parametrize("second", [0.63, 0.8, 0.95, 0.98, 1.02, 1.05, 1.3, 10.0])
def test_on_a_busy_machine_it_is_never_far_behind(second):
    """Other work takes a third of the time now and then, for a piece or for some, and searches
    come between; over two minutes the choice is within 3 % of the better number."""
    rng = np.random.default_rng(7)
    change_times = rng.exponential(0.3, 4000).cumsum()  # s at which other work comes or goes

    def cost(n):
        busy = np.searchsorted(change_times, machine.now) % 4 == 3
        return 1e-4 * (1.0, second)[n - 1] * (1.5 if busy else 1.0)

    machine = Machine(2, cost)
    run(machine, 1_200_000, call=100)
    chosen_time, steps = machine.now, machine.steps
    alone = []
    for n in (1, 2):
        machine = Machine(n, cost)
        run(machine, steps, call=100, fixed=True)
        alone.append(machine.now)
    assert chosen_time < 1.03 * min(alone)
