"""Task of a worker process of the benchmark of sizes: one phase of one scene."""

import io
import resource
import time
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.spatial  # noqa: F401, before the time of a sample is taken

from benchmarks.task import peak_memory
from dusttaichi import method
from dusttaichi.scene import from_yaml


class Processor:
    """Processor time [s] since the last call of `lap`, or the start. A context around steps.

    seconds: of each phase.
    """

    def __init__(self):
        self.seconds, self._last = {}, time.process_time()

    def lap(self, phase):
        """Add the time since the last lap to a phase."""
        current_time = time.process_time()
        self.seconds[phase] = self.seconds.get(phase, 0.0) + current_time - self._last
        self._last = current_time


class Segments:
    """Context around each segment of steps.

    The first, a single step, which compiles kernels, belongs to the build of grains. The build of a
    continuum computes forces already, and its first step is many time steps.
    """

    def __init__(self, processor, method):
        self._processor = processor
        self._phase = "steps" if method == "continuum" else "build"

    def __enter__(self):
        self._processor.lap("output")

    def __exit__(self, *_):
        self._processor.lap(self._phase)
        self._phase = "steps"


def command(phase, arguments):
    """Run a command of `dust` in this process."""
    processor = Processor()
    from dusttaichi.commands.app import app

    with redirect_stdout(io.StringIO()):
        app(arguments, standalone_mode=False)
    processor.lap(phase)
    return processor.seconds


def sample(scene, file=None):
    """Make the sample of a scene (YAML); file: where its centres are written, and read from."""
    scene = from_yaml(scene)
    if file is not None:
        x = method.make_sample(scene).positions
        np.savetxt(file, 1e6 * x, fmt="%.9f", header="x y z", comments="")
        scene = scene.with_value("sample", {"kind": "explicit", "file": file, "units": "um"})
    processor = Processor()
    particles = len(method.make_sample(scene))
    processor.lap("sample")
    return processor.seconds | {"particles": particles}


def run(scene, directory):
    """Run a scene (YAML) into a directory: build, steps, and output, which is everything else.

    Also files: what the processes take that write them meanwhile.
    """
    from dusttaichi.results.run_lock import RunLock
    from dusttaichi.running.interrupts import Interrupts
    from dusttaichi.running.opening import Opening

    scene, processor = from_yaml(scene), Processor()

    def build(*arguments):
        processor.lap("output")
        simulation = built(*arguments)
        processor.lap("build")
        return simulation

    others = {"report": lambda report: None, "log": lambda text: None}
    directory = Path(directory)
    with Interrupts() as interrupts, RunLock(directory) as lock:
        others |= {"interrupts": interrupts, "advancing": Segments(processor, scene.method)}
        sampled = lambda sample: processor.lap("made")  # noqa: E731
        opening = Opening(scene, directory, lock, sampled=sampled, **others)
        built = opening.method.build
        opening.method = replace(opening.method, build=build)
        run = opening.open()
        with run.files:
            run.go()
    processor.lap("output")
    processor.seconds.pop("made")  # measured alone
    writers = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor.seconds["files"] = writers.ru_utime + writers.ru_stime
    return processor.seconds


def answer(parent, *, do, **arguments):
    """Answer of the worker: processor seconds by phase, and the largest memory [B]."""
    return {"command": command, "sample": sample, "run": run}[do](**arguments) | {
        "peak": peak_memory()
    }
