"""Task of a worker process for a point of a trade: a run, with the core-seconds of its steps."""

import time

LEAST = 1.0  # core-seconds: shorter runs are repeated up to this total


class Meter:
    """Core-seconds of the steps of a simulation, of all threads of this process.

    Start, compilation, measurements and writing do not count. On a GPU it is wall time. A context
    manager around every segment of steps. cost: so far.
    """

    def __init__(self, backend):
        self.clock = time.process_time if backend == "cpu" else time.perf_counter
        self.cost, self.sim = 0.0, None

    def begin(self, sim):
        """Begin to count, at the current step of a simulation."""
        self.sim, self.first, self.start = sim, sim.step, sim.state()

    def __enter__(self):
        self.began = self.clock()

    def __exit__(self, *_):
        self.cost += self.clock() - self.began

    def repeat(self):
        """Replace the cost of a run shorter than LEAST by the mean of several repetitions."""
        steps, cost, times = self.sim.step - self.first, 0.0, 0
        try:
            while cost < LEAST:
                self.sim.restore(self.start)
                began = self.clock()
                self.sim.advance(steps)
                cost, times = cost + self.clock() - began, times + 1
        except KeyboardInterrupt:  # the repetitions so far are enough
            pass
        if times:
            self.cost = cost / times


def run(parent, *, scene, directory):
    """Run a scene (text of its YAML) into a directory; returns a dict of the measurements.

    Reports `share` during the run. Raises the errors of `execute`.
    """
    from dusttaichi import units
    from dusttaichi.run import execute
    from dusttaichi.scene import from_yaml

    scene = from_yaml(scene)
    meter = Meter(scene.numerics.backend)

    def report(progress):
        if progress.end:
            parent.progress(share=progress.step / progress.end)

    # stored stages of other points would cost nothing
    hooks = {"report": report, "ready": meter.begin, "advancing": meter}
    execute(scene, directory, force=True, fresh=True, **hooks)
    found = {"steps": meter.sim.step, "time_step": meter.sim.dt * units.TIME}
    found |= _measured(directory)
    if meter.cost < LEAST and not scene.stages:
        meter.repeat()
    return found | {"cost": meter.cost}


def _measured(directory):
    """Status, ledger and observables of the result of a run."""
    from dusttaichi import analysis
    from dusttaichi.analysis.observables import measured

    with analysis.open_run(directory) as result:
        return {
            "status": result.status,
            "ledger": analysis.ledger(result).worst,
            "measured": measured(result).to_json(),
        }
