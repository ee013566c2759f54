"""Steps of a continuum: calls of the kernel, searches between them, speeds of the faces."""

import numpy as np

from dusttaichi.compute.loops import DONE, STUCK
from dusttaichi.continuum.kernels.motion import MOST_STEPS
from dusttaichi.continuum.kernels.store import COLUMN, DT, FACES
from dusttaichi.domain.walls import TOP
from dusttaichi.errors import GuardStop
from dusttaichi.method import moment


class DustStepper:
    """Advances a DustState by output steps, the steps of the run.

    kernels: those of a Compiled. scratch: memory.Table of its lists, by name. environment:
    Environment. search: DustSearch. numbers: KernelNumbers. threads: workers of the steps.
    """

    def __init__(self, kernels, scratch, environment, search, *, numbers, threads):
        self._kernels, self._scratch = kernels, scratch
        self._state, self._environment, self._search = search.state, environment, search
        self._numbers, self.threads = numbers, threads

    # -- steps -----------------------------------------------------------------------------------

    def advance(self, steps):
        """Make `steps` output steps, searching for neighbours whenever it is due."""
        environment, end = self._environment, self._environment.step + steps
        pending = 0
        while environment.step < end:
            environment.step += self._call(end - environment.step, pending)
            pending = 0
            if environment.step < end:
                self._search.update()
                pending = 1

    def _call(self, steps, pending):
        """Output steps done; pending: 1 if the forces of a time step are due."""
        numbers, environment = self._numbers, self._environment
        outcome = self._kernels.advance(
            *(steps, environment.step, pending, self.threads),
            *(numbers.of_step, numbers.of_material),
        )
        if outcome is None:  # workers write it to `sync`
            outcome = self._scratch["sync"].to_numpy()[[DONE, STUCK]]
        steps_done, stuck = outcome
        if stuck:
            raise GuardStop(
                f"{moment(environment)} an output step would take more than {MOST_STEPS:.0e} time "
                "steps of the method: particles move or are strained too fast. Try a lower speed, "
                "or a shorter numerics.time_step if it is a long one."
            )
        return int(steps_done)

    def load_particles(self):
        """Compute stresses and forces at the present positions, without moving anything."""
        state, clock = self._state, self._state.clock
        state.fields["clock"].from_numpy([0.0], DT)
        self._call(1, 1)
        state["clock"] = clock

    # -- drive -----------------------------------------------------------------------------------

    def drive(self, drive):
        """Move the faces as `drive` (scene.Drive) says from this step on."""
        environment, speeds = self._environment, np.zeros((FACES, 3))
        environment.place(environment.domain.driven(drive, environment.step))
        speeds[TOP, 2] = -environment.domain.wall_speed
        self.move_faces(speeds)

    def move_faces(self, speeds):
        """Velocities of the six faces from now on [m/s], (6, 3)."""
        rigid = self._state.fields["rigid"]
        rows = rigid.to_numpy(FACES)
        rows[:, COLUMN["speed"]] = speeds
        rigid.from_numpy(rows)
