"""What a worker process does for a point of a trade: the run, and the core-seconds of its steps."""

import time

LEAST = 1.0  # core-seconds: what takes less is done again until it has taken so much
EVERY = 0.02  # core-seconds, and share of the cost so far, between two entries of the costs


class Meter:
    """Core-seconds of the steps of a simulation: of all threads of this process, while it advances.

    Start, compilation, measuring and writing do not count. On a GPU it is real time.
    cost: so far. steps, costs: lists that grow on the way, what had been made for what cost.
    """

    def __init__(self, sim, backend):
        self.sim, self.clock = sim, time.process_time if backend == "cpu" else time.perf_counter
        self.cost, self.steps, self.costs = 0.0, [0], [0.0]
        self.first = sim.step
        self.start = sim.state()
        self.plain, sim.advance = sim.advance, self.advance

    def advance(self, steps):
        """Advance the simulation and count."""
        began = self.clock()
        self.plain(steps)
        self.cost += self.clock() - began
        if self.cost - self.costs[-1] > EVERY * max(1.0, self.cost):
            self.steps.append(self.sim.step - self.first)
            self.costs.append(self.cost)

    def repeated(self, steps):
        """Core-seconds of the steps of a run that was too short to tell: the mean over several."""
        cost, times = 0.0, 0
        try:
            while cost < LEAST:
                self.sim.restore(self.start)
                began = self.clock()
                self.plain(steps)
                cost, times = cost + self.clock() - began, times + 1
        except KeyboardInterrupt:  # what was done tells enough
            pass
        return cost / times if times else self.cost

    def found(self):
        """What to report of the costs, however the run ended."""
        costs = [*self.steps, self.sim.step - self.first], [*self.costs, self.cost]
        return {"cost": self.cost, "costs": costs}


def run(parent, *, scene, directory, measure):
    """Run a scene (text of its YAML) into a directory; returns what was measured.

    Everything compiled, it waits until the parent lets it go: so two runs begin at the same moment.
    `share` and `cost` are reported on the way, and `cost` and `costs` at the end, however it ends.
    measure: open the result and take its numbers, too. Raises what `execute` raises.
    """
    from dusttaichi.run import execute
    from dusttaichi.scene import from_yaml

    scene, meter = from_yaml(scene), None

    def ready(sim):
        nonlocal meter
        meter = Meter(sim, scene.numerics.backend)
        parent.wait_for_go()

    def report(progress):
        if progress.end:
            parent.progress(share=progress.step / progress.end, cost=meter.cost)

    try:
        # stages that other points have kept would cost nothing
        execute(scene, directory, force=True, fresh=True, report=report, ready=ready)
        sim = meter.sim
        found = {"steps": sim.step, "time_step": sim.dt * 1e-6}
        if measure:
            found |= _measured(directory)
        if meter.cost < LEAST and not scene.stages:
            meter.cost = meter.repeated(sim.step - meter.first)
            meter.steps, meter.costs = [0], [0.0]
        return found
    finally:
        if meter is not None:
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
