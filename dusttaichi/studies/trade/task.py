"""Task of a worker process for a point of a trade: a run, with the core-seconds of its steps."""

import time

LEAST = 1.0  # core-seconds: shorter runs are repeated up to this total
EVERY = 0.02  # core-seconds, or share of the cost so far, between two entries of the costs


class Meter:
    """Core-seconds of the steps of a simulation, of all threads of this process.

    Start, compilation, measurements and writing do not count. On a GPU it is wall time. A context
    manager around every segment of steps. cost: so far. steps, costs: steps with their cumulative
    cost, lists that grow during the run.
    """

    def __init__(self, backend):
        self.clock = time.process_time if backend == "cpu" else time.perf_counter
        self.cost, self.steps, self.costs = 0.0, [0], [0.0]
        self.sim = None

    def begin(self, sim):
        """Begin to count, at the current step of a simulation."""
        self.sim, self.first, self.start = sim, sim.step, sim.state()

    def __enter__(self):
        self.began = self.clock()

    def __exit__(self, *_):
        self.cost += self.clock() - self.began
        if self.cost - self.costs[-1] > EVERY * max(1.0, self.cost):
            self.steps.append(self.made)
            self.costs.append(self.cost)

    @property
    def made(self):
        """Steps since the start."""
        return self.sim.step - self.first

    def repeat(self):
        """Replace the cost of a run shorter than LEAST by the mean of several repetitions."""
        steps, cost, times = self.made, 0.0, 0
        try:
            while cost < LEAST:
                self.sim.restore(self.start)
                began = self.clock()
                self.sim.advance(steps)
                cost, times = cost + self.clock() - began, times + 1
        except KeyboardInterrupt:  # the repetitions so far are enough
            pass
        if times:
            self.cost, self.steps, self.costs = cost / times, [0], [0.0]

    def found(self):
        """Costs to report at the end of the run, also of a failed one."""
        costs = [*self.steps, self.made], [*self.costs, self.cost]
        return {"cost": self.cost, "costs": costs}


def run(parent, *, scene, directory, measure):
    """Run a scene (text of its YAML) into a directory; returns a dict of the measurements.

    After the compilation it waits for the parent, so that two runs begin at the same time. Reports
    `share` and `cost` during the run, `cost` and `costs` at its end, also of a failed one. measure:
    with numbers of the result. Raises the errors of `execute`.
    """
    from dusttaichi import units
    from dusttaichi.run import execute
    from dusttaichi.scene import from_yaml

    scene = from_yaml(scene)
    meter = Meter(scene.numerics.backend)

    def ready(sim):
        meter.begin(sim)
        parent.wait_for_go()

    def report(progress):
        if progress.end:
            parent.progress(share=progress.step / progress.end, cost=meter.cost)

    try:
        # stored stages of other points would cost nothing
        hooks = {"report": report, "ready": ready, "advancing": meter}
        execute(scene, directory, force=True, fresh=True, **hooks)
        found = {"steps": meter.sim.step, "time_step": meter.sim.dt * units.TIME}
        if measure:
            found |= _measured(directory)
        if meter.cost < LEAST and not scene.stages:
            meter.repeat()
        return found
    finally:
        if meter.sim is not None:
            parent.report(**meter.found())


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
