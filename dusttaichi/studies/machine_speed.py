"""Speed of this machine: `dust bench`, in a minute or two.

Two of the bundled scenes, one of each method, stay in processes with one thread and with all cores.
These are timed in turn, round after round, so that other load of the machine affects all of them;
the numbers are medians of the rounds.
"""

import os
import re
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from statistics import median
from typing import Any

from dusttaichi.compute import compiler
from dusttaichi.compute.processor import usable_cores
from dusttaichi.errors import DustError
from dusttaichi.studies.workers import PROCESS_LOST, Worker

SCENES = ("omni_box", "guettler2009/bead")
ROUNDS, SECONDS = 5, 0.6  # number and duration of the measurements of each
WARM_UP = 0.3  # s of steps before the first round
# LLVM stays at 256 bits on processors with AVX-512, most of which slow their clock down for wider
USUAL_BITS = 256
LEDGER = 0.01  # largest residual, as in a run (numerics.ledger_tolerance)
BUSY = 15.0  # smallest spread of the rounds [%] with a remark


class Timed(AbstractContextManager["Timed"]):
    """A worker process that holds one simulation and times it.

    A context manager: at its end the process ends by itself and writes its kernels to the cache;
    after an error it is killed.

    task: "module:function". kernels: folder of the compiled kernels, by default the common one.
    """

    def __init__(self, task: str, kernels: Path | None = None) -> None:
        self._worker = Worker(task, kernels=kernels)

    def call(self, do: str, **arguments: Any) -> dict[str, Any]:
        """Answer of the task to `do`. Raises DustError."""
        answer = self._worker.call({"do": do, **arguments})
        if answer.code == PROCESS_LOST:
            raise DustError(answer.text.replace("the process", "A process of the benchmark"))
        if answer.code != 0:
            raise DustError(answer.text)
        return answer.values

    def __exit__(self, error_type: object, *_: object) -> None:
        if error_type is not None:
            self._worker.kill()
        self._worker.close()


@lru_cache(maxsize=1)
def vector_bits() -> int:
    """Bits of the vectors of doubles in compiled kernels, as compiled in a process of its own."""
    with Timed(f"{__name__}:answer") as process:
        return int(process.call("vectors")["bits"])


def _narrow() -> str | None:
    """Remark where compiled kernels have narrower vectors than they could have here.

    LLVM chooses the width by the name of the processor, and takes an AMD processor newer than
    itself (Zen 5 for LLVM 15 of Taichi 1.7) for the oldest one: two doubles at a time.
    """
    from dusttaichi.compute import processor

    bits, supported_bits = vector_bits(), processor.own_bits()
    if supported_bits is None or bits >= min(supported_bits, USUAL_BITS):
        return None
    return (
        f"Kernels use vectors of {bits} bits where this processor has {supported_bits}: the "
        f"compiler (LLVM of {compiler.label()}) does not know it, and steps of grains take about "
        f"1.3 times as long; {compiler.VARIABLE}=quadrants chooses a newer one."
    )


def machine(*remarks: str) -> str:
    """One line on the machine and the versions. remarks: more texts for it."""
    from dusttaichi.results.provenance import provenance

    facts = provenance("", "")
    texts = [
        f"{facts['cpu']}, {facts['cpu_cores']} cores",
        f"vectors of {vector_bits()} bits",
        f"Python {facts['python_version']}",
        compiler.label(),
        f"dusttaichi {facts['dusttaichi_version']}",
    ]
    return "; ".join([*texts, *remarks])


@dataclass(frozen=True)
class Timing:
    """Speed of a scene with a number of threads: medians of the rounds.

    size: particles. contacts: between grains, None for a method without. seconds: of a step.
    speed_up: over one thread. spread: largest minus smallest round over the median [%].
    residual: of the energy ledger after all rounds, over its turnover (`run.ledger.turnover`).
    """

    scene: str
    size: int
    contacts: int | None
    threads: int
    seconds: float
    speed_up: float
    spread: float
    residual: float

    def text(self) -> str:
        """Line of the table."""
        words = "1 thread " if self.threads == 1 else f"{self.threads} threads"
        unit, number = ("contact", self.contacts) if self.contacts else ("particle", self.size)
        line = f"  {words:<11}{1.0 / self.seconds:>9,.0f} steps/s"
        line += f"{1e9 * self.seconds / number:>9.1f} ns per {unit} and step"
        return line if self.threads == 1 else f"{line}   {self.speed_up:.2f} times one thread"


def main(
    scenes: Sequence[str | Path] = SCENES,
    *,
    rounds: int = ROUNDS,
    seconds: float = SECONDS,
    log: Callable[[str], None] = lambda line: None,
) -> list[Timing]:
    """Time the scenes with one thread and with all cores; returns the Timings.

    scenes: names or files. seconds: of one measurement. Raises DustError where a process fails.
    """
    threads = sorted({1, usable_cores()})
    return [
        timing for scene in scenes for timing in _time_scene(scene, threads, rounds, seconds, log)
    ]


def _time_scene(
    name: str | Path,
    threads: Sequence[int],
    rounds: int,
    seconds: float,
    log: Callable[[str], None],
) -> Iterator[Timing]:
    with ExitStack() as stack:
        processes: list[Timed] = []
        built: list[dict[str, Any]] = []
        for n in threads:
            log(f"{name}: compiling for {_name_threads(n)}")
            processes.append(stack.enter_context(Timed(f"{__name__}:answer")))
            built.append(processes[-1].call("build", scene=str(name), threads=n))
        log(f"{name}: measuring")
        step_times = [
            [p.call("time", span=seconds)["step"] for p in processes] for _ in range(rounds)
        ]
        residuals = [p.call("ledger")["residual"] for p in processes]
    for index, n in enumerate(threads):
        seconds_of_step = [round_times[index] for round_times in step_times]
        yield Timing(
            str(name),
            **built[index],
            threads=n,
            seconds=median(seconds_of_step),
            speed_up=median(round_times[0] / round_times[index] for round_times in step_times),
            spread=100.0 * (max(seconds_of_step) - min(seconds_of_step)) / median(seconds_of_step),
            residual=residuals[index],
        )


def text(timings: list[Timing]) -> str:
    """The table for the screen, below the line on the machine."""
    lines, headed_scene = [machine()], None
    for timing in timings:
        if timing.scene != headed_scene:
            contacts = "" if timing.contacts is None else f", {timing.contacts:,} contacts"
            lines += ["", f"{timing.scene}: {timing.size:,} particles{contacts}"]
            headed_scene = timing.scene
            worst = max(abs(t.residual) for t in timings if t.scene == headed_scene)
            error = f"{100.0 * worst:.2g} %{_describe_residual(worst)}"
            lines.append(f"  largest relative error of the energy balance: {error}")
        lines.append(timing.text())
    worst = max(timing.spread for timing in timings)
    remarks = [_narrow()]
    if worst > BUSY:
        remarks.append(
            f"The rounds differ by up to {worst:.0f} %: other programs use the machine, or its "
            "clock changes. Repeat this when it is idle."
        )
    return "\n".join([*lines, *(f"\n{remark}" for remark in remarks if remark)])


def _describe_residual(residual: float) -> str:
    """Remark on a residual that a run would be stopped for."""
    return "" if residual <= LEDGER else ": RESULTS OF THIS MACHINE ARE WRONG, do not use it"


def _name_threads(number: int) -> str:
    return "one thread" if number == 1 else f"{number} threads"


# -- in the worker ---------------------------------------------------------------------------------

_state: dict[str, Any] = {}


def _build(scene: str, threads: int) -> dict[str, Any]:
    from dusttaichi import method
    from dusttaichi.scene import load

    loaded = load(scene).with_value("numerics.threads", threads)
    sim = method.find_method(loaded).build(loaded, method.make_sample(loaded))
    _state["sim"] = sim
    _state["start"] = method.Start.from_measurement(sim.measure())
    sim.advance(1)
    sizes = {"size": sim.size, "contacts": sim.measure().parts.get("contacts")}
    _state["steps"] = 1
    _time(WARM_UP)
    return sizes


def _time(span: float) -> dict[str, float]:
    """Seconds of a step, over steps that take about `span` seconds."""
    sim, total, steps = _state["sim"], 0.0, 0
    while total < span:
        began, first = time.perf_counter(), sim.step
        sim.advance(_state["steps"])
        duration = time.perf_counter() - began
        total, steps = total + duration, steps + sim.step - first
        # each call a tenth of the time, so that the cost of a call is negligible
        _state["steps"] = max(1, round(_state["steps"] * min(10.0, 0.1 * span / duration)))
    return {"step": total / steps}


def _measure_ledger() -> dict[str, float]:
    """Residual of the ledger over its turnover."""
    from dusttaichi.running.ledger import turnover

    residual, through = turnover(_state["sim"].measure(), _state["start"])
    return {"residual": float(residual / through)}


def _measure_vectors() -> dict[str, int]:
    from dusttaichi.compute.engine import settings, ti

    ti.init(arch=ti.cpu, offline_cache=False, default_fp=ti.f64, log_level=ti.ERROR)
    settings().print_kernel_llvm_ir_optimized = True
    with tempfile.TemporaryDirectory() as folder:
        return {"bits": compiled_bits(folder)}


TASKS: dict[str, Callable[..., dict[str, Any]]] = {
    "build": _build,
    "time": _time,
    "ledger": _measure_ledger,
    "vectors": _measure_vectors,
}


def answer(parent: Any, *, do: str, **arguments: Any) -> dict[str, Any]:
    """Answer of the worker. do: "build" a scene, "time" it, state its "ledger"; or "vectors"."""
    return TASKS[do](**arguments)


def compiled_bits(folder: str | Path) -> int:
    """Bits of the vectors that LLVM makes of a sum of products of doubles.

    Taichi runs, and prints its code, into the current folder; folder: an empty one for it.
    """
    from dusttaichi.compute.engine import ti

    x, previous_folder = ti.field(ti.f64, shape=64), os.getcwd()

    @ti.kernel  # type: ignore[untyped-decorator]
    def products(n: ti.i32):  # type: ignore[name-defined, no-untyped-def]
        ti.loop_config(serialize=True)
        for i in range(n):
            total = 0.0
            for k in range(n):
                total += x[k] * x[k]
            x[i] = total

    os.chdir(folder)
    try:
        products(0)
    finally:
        os.chdir(previous_folder)
    code = "".join(file.read_text() for file in Path(folder).glob("*optimized*.ll"))
    lanes = [int(n) for n in re.findall(r"fmul [a-z ]*<(\d+) x double>", code)]
    return 64 * max(lanes, default=1)
