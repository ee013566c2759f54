"""What all benchmarks share: the worker that is timed, its time a step, the machine."""

from pathlib import Path

from dusttaichi.errors import DustError
from dusttaichi.results.outputs import check
from dusttaichi.studies.workers import LOST, Worker

TASK = "dusttaichi.studies.bench.task:answer"


class Timed:
    """A worker process that holds one simulation and times it.

    kernels: the folder where compiled kernels are kept, Taichi's own by default. task: what
    answers it, "module:function".
    A context manager: the process ends with it, by itself, so that it writes its kernels to the
    cache, or killed where something failed.
    """

    def __init__(self, kernels: Path | None = None, task: str = TASK):
        self._worker = Worker(task, kernels=kernels)

    def ask(self, do: str, **arguments) -> dict:
        """The answer of a method of `task.Benchmark`. Raises DustError with what went wrong."""
        answer = self._worker.ask(do=do, **arguments)
        if answer.code == LOST:
            raise DustError(answer.text.replace("the process", "A process of the benchmark"))
        if answer.code != 0:
            raise DustError(answer.text)
        return answer.found

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if kind is not None:
            self._worker.kill()
        self._worker.close()


def seconds_a_step(timing: dict) -> float:
    """Seconds of a step, all in: what `task.Benchmark.time` answers, summed."""
    return timing["step"] + timing["search"] + timing["ledger"]


def check_file(out) -> None:
    """Refuse a file that cannot be written before ten minutes of measuring end at it."""
    if out is None:
        return
    try:
        check(out, "; dusttaichi ").open("a").close()
    except OSError as error:
        raise DustError(f"{out} cannot be written: {error.strerror}") from error


def machine(*further: str) -> str:
    """One line that tells the machine and the versions. further: what else belongs in it."""
    from dusttaichi.compute import processor
    from dusttaichi.results.provenance import provenance

    here = provenance("", "")
    bits = processor.compiled_bits()
    texts = [
        f"{here['cpu']}, {here['cpu_cores']} cores",
        "vectors of unknown width" if bits is None else f"vectors of {bits} bits",
        f"Python {here['python_version']}",
        f"Taichi {here['taichi_version']}",
        f"dusttaichi {here['dusttaichi_version']}",
    ]
    return "; ".join([*texts, *further])
