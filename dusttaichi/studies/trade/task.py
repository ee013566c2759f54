"""Task of a worker process for a point of a trade: the run, and the core-seconds of its steps."""

import time

LEAST = 1.0  # core-seconds: what takes less is done again until it has taken so much
EVERY = 0.02  # core-seconds, and share of the cost so far, between two entries of the costs


class Meter:
    """Core-seconds of the steps of a simulation: of all threads of this process, while it advances.

    Start, compilation, measuring and writing do not count. On a GPU it is real time. A context
    manager that the run enters around every stretch of steps.
    cost: so far. steps, costs: lists that grow on the way, what had been made for what cost.
    """

    def __init__(self, backend):
        self.clock = time.process_time if backend == "cpu" else time.perf_counter
        self.cost, self.steps, self.costs = 0.0, [0], [0.0]
        self.sim = None

    def begin(self, sim):
        """From here on the steps of this simulation count."""
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
        """Take the mean over several goes, for a run that was too short to tell."""
        steps, cost, times = self.made, 0.0, 0
        try:
            while cost < LEAST:
                self.sim.restore(self.start)
                began = self.clock()
                self.sim.advance(steps)
                cost, times = cost + self.clock() - began, times + 1
        except KeyboardInterrupt:  # what was done tells enough
            pass
        if times:
            self.cost, self.steps, self.costs = cost / times, [0], [0.0]

    def found(self):
        """Costs to report, however the run ended."""
        costs = [*self.steps, self.made], [*self.costs, self.cost]
        return {"cost": self.cost, "costs": costs}


def run(parent, *, scene, directory, measure):
    """Run a scene (text of its YAML) into a directory; returns what was measured.

    Everything compiled, it waits until the parent lets it go: so two runs begin at the same moment.
    `share` and `cost` are reported on the way, and `cost` and `costs` at the end, however it ends.
    measure: open the result and take its numbers, too. Raises what `execute` raises.
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
        # stages that other points have kept would cost nothing
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
