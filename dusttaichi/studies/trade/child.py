"""One run of a trade in a process of its own, with the core-seconds of its steps.

The request comes as a line of JSON on the standard input. {"ready": true} goes to the standard
output once everything is compiled, and the steps begin with a second line: so two runs begin at the
same moment. Then {"share": 0.4, "cost": 1.2, "step": 100}, and at last the outcome, {"code": 0,
"text": "", ...}. When the input ends, the run stops as after Ctrl-C.
"""

import json
import os
import signal
import sys
import threading
import time

from dusttaichi.errors import DustError
from dusttaichi.studies.ensemble.child import TELL_EVERY, stop_with_the_input

LEAST = 1.0  # core-seconds: what takes less is done again until it has taken so much
EVERY = 0.02  # core-seconds, and share of the cost so far, between two entries of the costs


class Meter:
    """Core-seconds of the steps of a simulation: of all threads of this process, while it advances.

    Start, compilation, measuring and writing do not count. On a GPU it is real time.
    """

    def __init__(self, sim, backend):
        self.sim, self.clock = sim, time.process_time if backend == "cpu" else time.perf_counter
        self.cost, self.steps, self.costs = 0.0, [0], [0.0]
        self.first = sim.step
        self.start = sim.arrays(), sim.numbers()
        self.plain, sim.advance = sim.advance, self.advance

    def advance(self, steps):
        began = self.clock()
        self.plain(steps)
        self.cost += self.clock() - began
        if self.cost - self.costs[-1] > EVERY * max(1.0, self.cost):
            self.steps.append(self.sim.step - self.first)
            self.costs.append(self.cost)

    def repeated(self, steps):
        """Core-seconds of the steps of a run that was too short to tell: mean over several."""
        cost, times = 0.0, 0
        try:
            while cost < LEAST:
                self.sim.restore(*self.start)
                began = self.clock()
                self.plain(steps)
                cost, times = cost + self.clock() - began, times + 1
        except KeyboardInterrupt:  # what was done tells enough
            pass
        return cost / times if times else self.cost


def main():
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be inherited as ignored
    request = json.loads(sys.stdin.readline())

    def tell(**what):
        print(json.dumps(what), file=answers, flush=True)

    run = _Run(request, tell)
    try:
        run.do()
        end = {"code": 0, "text": ""}
    except DustError as error:
        end = {"code": error.exit_code, "text": str(error)}
    except KeyboardInterrupt:
        end = {"code": 130, "text": "interrupted"}
    tell(**end, **run.found())


class _Run:
    def __init__(self, request, tell):
        self.request, self.tell, self.meter, self.told, self.outcome = request, tell, None, 0.0, {}

    def do(self):
        from dusttaichi.run.loop import execute
        from dusttaichi.scene import from_yaml

        scene, directory = from_yaml(self.request["scene"]), self.request["directory"]

        def ready(sim):
            self.meter = Meter(sim, scene.numerics.backend)
            self.tell(ready=True)
            if not sys.stdin.readline():
                raise KeyboardInterrupt
            threading.Thread(target=stop_with_the_input, daemon=True).start()

        # stages that other points have kept would cost nothing
        execute(scene, directory, force=True, fresh=True, watch=self.watch, ready=ready)
        meter, sim = self.meter, self.meter.sim
        self.outcome = {"steps": sim.step, "time_step": sim.dt * 1e-6}
        if self.request["measure"]:
            self.measure(directory)
        if meter.cost < LEAST and not scene.stages:
            meter.cost = meter.repeated(sim.step - meter.first)
            meter.steps, meter.costs = [0], [0.0]

    def measure(self, directory):
        from dusttaichi import analysis
        from dusttaichi.analysis.observables import measured

        with analysis.open_run(directory) as run:
            self.outcome |= {
                "status": run.status,
                "ledger": analysis.ledger(run).worst,
                "measured": measured(run).to_json(),
            }

    def watch(self, progress):
        if time.monotonic() - self.told > TELL_EVERY and progress.end:
            self.told = time.monotonic()
            self.tell(share=progress.step / progress.end, cost=self.meter.cost)

    def found(self):
        """What is known of the run, however it ended."""
        if self.meter is None:
            return self.outcome
        meter = self.meter
        costs = [*meter.steps, meter.sim.step - meter.first], [*meter.costs, meter.cost]
        return self.outcome | {"cost": meter.cost, "costs": costs}


if __name__ == "__main__":
    main()
