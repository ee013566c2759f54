"""The choice of how many workers the steps get, on a machine whose clock the test turns."""

import pytest

from dusttaichi.compute.worker_choice import WorkerChoice, ladder


class Machine:
    """A simulation whose steps take as long as `cost` says of the number of workers, in s."""

    def __init__(self, threads, cost):
        self.threads, self.cost, self.now, self.steps = threads, cost, 0.0, 0

    def advance(self, steps):
        self.now += steps * self.cost(self.threads)
        self.steps += steps

    def clock(self):
        return self.now


def run(machine, steps, call=1000, fixed=False):
    choice = WorkerChoice(machine, fixed, machine.clock)
    begun = machine.steps
    while machine.steps - begun < steps:
        choice.advance(call)
    return choice


def test_ladder():
    assert [ladder(n) for n in (1, 2, 3, 8)] == [[1], [1, 2], [1, 2, 3], [1, 2, 4, 8]]


@pytest.mark.parametrize("call", [1, 37, 10_000])
def test_the_fastest_is_found_whatever_the_calls(call):
    """Four of eight workers are best here, and every step asked for is made."""
    machine = Machine(8, lambda n: 1e-3 * {1: 4.0, 2: 2.2, 4: 1.4, 8: 2.0}[n])
    run(machine, 20_000, call)
    assert machine.threads == 4
    assert machine.steps == -(-20_000 // call) * call


def test_one_core_for_two_workers_costs_little():
    """Two workers that share a core are ten times slower: within a minute the trials of it have
    cost less than a twentieth, and no call is longer than it must be."""
    machine = Machine(2, lambda n: 1e-3 * {1: 1.0, 2: 10.0}[n])
    run(machine, 60_000)
    assert machine.threads == 1
    assert machine.now < 60.0 * 1.05


def test_a_machine_that_becomes_busy_is_noticed_at_once():
    busy = [False]
    machine = Machine(2, lambda n: 1e-3 * (10.0 if busy[0] and n == 2 else 2.0 / n))
    choice = run(machine, 30_000)
    assert machine.threads == 2
    busy[0], begun, steps = True, machine.now, machine.steps
    while machine.steps - steps < 10_000:
        choice.advance(1000)
    assert machine.threads == 1
    # alone it takes 20 s; noticing takes one stretch at the slow rate, 0.2 s tenfold
    assert machine.now - begun < 25.0
    busy[0] = False
    while machine.steps - steps < 100_000:
        choice.advance(1000)
    assert machine.threads == 2


def test_fixed_numbers_and_single_ones_are_left_alone():
    for threads, fixed in ((2, True), (1, False)):
        machine = Machine(threads, lambda n: 10.0 if n == 2 else 1.0)
        run(machine, 100, fixed=fixed)
        assert machine.threads == threads
