"""Instructions of a step and the bytes it moves (`python -m benchmarks counts`).

Unlike times, neither depends on the load of the machine. Linux counts instructions (perf_event)
where that is allowed; else the process computes a step in single steps (single_step).
"""

import ctypes
import json
import os
import platform
import struct
import subprocess
import sys
from dataclasses import asdict, dataclass

from benchmarks import sample as bench_sample
from benchmarks import single_step
from benchmarks.traffic import Traffic, traffic
from dusttaichi.errors import DustError
from dusttaichi.processes import python_command

GRAINS, FILLING_FACTOR, STEPS = 1000, 0.35, 100
PRECISIONS = ("f64", "mixed")
_SYSCALLS = {"x86_64": 298, "aarch64": 241}  # of perf_event_open
_INSTRUCTIONS, _DISABLED_KERNEL_INHERIT = 1, 1 << 5 | 1 << 6 | 1 << 1


@dataclass(frozen=True)
class Counts:
    """Instructions of one step, with the numbers of grains and listed pairs; by: a counter.

    traffic: bytes that it moves.
    """

    precision: str
    grains: int
    pairs: int
    step: float
    by: str
    traffic: Traffic

    def text(self) -> str:
        a_pair, a_grain = self.step / self.pairs, self.step / self.grains
        return (
            f"{self.precision}: {a_pair:.0f} instructions per listed pair and step, {a_grain:.0f} "
            f"per grain ({self.grains} grains, {self.pairs} pairs, by {self.by})\n"
            f"{self.traffic.text()}"
        )


def main(log) -> list[Counts]:
    """The Counts of every precision. Raises DustError where counting is impossible."""
    recipe = bench_sample.Recipe(GRAINS, FILLING_FACTOR)
    if bench_sample.load(recipe.path) is None:
        log(f"making {GRAINS} grains at a filling factor of {FILLING_FACTOR}")
        _child("make", PRECISIONS[0], 0)
    return [_counted(precision, log) for precision in PRECISIONS]


def _counted(precision, log):
    log(f"{precision}: counting a step")
    found = _child("count", precision, STEPS)
    by, steps = "perf_event", STEPS
    if found["instructions"] is None:
        if not single_step.possible():
            raise DustError(
                "instructions cannot be counted here: the system has neither a counter for "
                "programs (perf_event) nor single steps of processes. Use Linux"
            )
        by, steps = "single steps", 1
        log(f"{precision}: in single steps, half a minute")
        found["instructions"] = _stepped(precision)
    moved = Traffic(**found["traffic"])
    a_step = found["instructions"] / steps
    return Counts(precision, found["grains"], found["pairs"], a_step, by, moved)


def _command(what, precision, steps):
    return python_command(__name__, what, precision, steps)


def _child(what, precision, steps):
    """Result of a process of its own."""
    command = _command(what, precision, steps)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise DustError(f"counting instructions failed: {done.stderr.strip().splitlines()[-1]}")
    return json.loads(done.stdout or "{}")


def _stepped(precision):
    """Instructions of one step: a call with two steps minus a call with one."""
    with subprocess.Popen(
        _command("step", precision, STEPS), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        try:
            if not child.stdout.readline():
                raise DustError("counting instructions failed: its process has ended")
            with single_step.Stepper(child.pid) as stepper:
                child.stdin.write("go\n")
                child.stdin.flush()
                once, twice = stepper.instructions(), stepper.instructions()
        finally:
            child.kill()
    return twice - once


# -- in the child ----------------------------------------------------------------------------------


def _counter():
    """File descriptor of a counter of this process and its later threads; -1 without one."""
    number = _SYSCALLS.get(platform.machine())
    if number is None or sys.platform != "linux":
        return -1
    attributes = struct.pack("IIQQQQQ", 0, 112, _INSTRUCTIONS, 0, 0, 0, _DISABLED_KERNEL_INHERIT)
    block = ctypes.create_string_buffer(attributes, 112)
    return ctypes.CDLL(None, use_errno=True).syscall(number, block, 0, -1, -1, 0)


def _read(counter):
    return struct.unpack("Q", os.read(counter, 8))[0]


def _run(what, precision, steps):
    from dusttaichi.grains.build import build

    recipe = bench_sample.Recipe(GRAINS, FILLING_FACTOR)
    sample = bench_sample.make(recipe)
    if what == "make":
        return
    counter = _counter()  # before the threads that it counts
    sim = build(bench_sample.bench_scene(GRAINS, threads=1, precision=precision), sample)
    sim.advance(STEPS)
    if what == "step":
        _show_steps(sim)
        return
    before = None if counter < 0 else _read(counter)
    sim.advance(steps)
    found = None if counter < 0 else _read(counter) - before
    counted = {"instructions": found, "grains": sim.grains, "pairs": sim.state.pair_count}
    print(json.dumps({**counted, "traffic": asdict(traffic(sim))}))


def _show_steps(sim):
    """Mark a call with one step, and one with two, for the Stepper."""
    print("ready", flush=True)
    sys.stdin.readline()
    for steps in (1, 2):
        single_step.mark()
        sim.advance(steps)
        single_step.mark()


if __name__ == "__main__":
    _run(sys.argv[1], sys.argv[2], int(sys.argv[3]))
