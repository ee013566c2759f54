"""Steps of the grains: calls of the kernel, searches, changes of drive and pushes between them."""

from functools import lru_cache

import numpy as np

from dusttaichi.compute.loops import DONE
from dusttaichi.domain.clock import NEVER
from dusttaichi.domain.servo import EVEN, SURFACE, WALL
from dusttaichi.domain.walls import TOP
from dusttaichi.grains.pushes import begin_pushes
from dusttaichi.grains.step import StepNumbers


class Stepper:
    """Advances a Motion by whole steps; the ledger includes the changes between them.

    kernels: those of a Compiled, by name. motion: Motion. search: Search. kernel_sums: KernelSums.
    ledger: Ledger. sphere: MovingSphere, or None. threads: workers of the steps.
    """

    def __init__(self, kernels, motion, search, kernel_sums, ledger, *, sphere, threads):
        self._kernels, self._motion, self._search = kernels, motion, search
        self._state, self._bodies = motion.state, motion.bodies
        self._environment, self._push = motion.environment, motion.push
        self._kernel_sums, self._ledger, self._sphere = kernel_sums, ledger, sphere
        self.threads = threads

    # -- steps -----------------------------------------------------------------------------------

    def advance(self, steps):
        """Compute `steps` steps, with a search for neighbours whenever it is due."""
        environment, end = self._environment, self._environment.step + steps
        pending = 0
        while environment.step < end:
            change = environment.domain.next_change
            until = min(self._push.next_end(environment.step, end), change)
            steps_done, is_due = self._call(until - environment.step, pending, environment.dt)
            environment.step += steps_done
            pending = 0
            if environment.step == until and until < NEVER:
                self._end_pushes()
                if until == change:
                    self._steer()
            if is_due:
                with self._search.stopwatch:
                    self._search.update(environment.step + 1)
                pending = 1

    def _call(self, steps, pending, dt):
        """(steps done, whether a search is due); pending: 1 if the contacts of a step are due."""
        state, search, bodies = self._state, self._search, self._bodies
        state.fields["sync"].access.check()  # before anything moves
        masses = bodies.unit_mass, bodies.unit_inertia
        numbers = step_numbers(dt, masses, search.wall_due, search.reach2)
        steps_done = self._kernels.advance(
            steps,
            self._environment.step,
            pending,
            self.threads,
            numbers,
            self._environment.walls_argument,
        )
        # workers write it to `sync`
        steps_done = int(state["sync"][DONE]) if steps_done is None else steps_done[0]
        return steps_done, steps_done < steps

    def load_contacts(self):
        """Form history and loads of the contacts of a start.

        A pass over them without a step, whose losses (those of forming) are not counted.
        """
        self._environment.step -= 1
        self._call(1, 1, 0.0)
        self._environment.step += 1

    def _end_pushes(self):
        """Forces that last until this step, half of which they act on, end."""
        state, step = self._state, self._environment.step
        if not self._push.ends_at(step):
            return  # positions stay where they are, on a device
        work, kick = self._push.ending(state["x"], step)
        self._ledger.sums.push_work += work
        half = 0.5 * self._environment.dt
        state["v"] = state.of_grains("v") + half / self._bodies.mass * kick
        state["push_force"] = self._push.force(step)

    # -- drive -----------------------------------------------------------------------------------

    def drive(self, drive):
        """Move walls and faces by `drive` (scene.Drive) from this step on."""
        if self._sphere is not None:
            self._ledger.close_sphere()
        with self._ledger.change_speeds(self._kernel_sums.read_loads()):
            self.move(drive)
            if drive.push or self._push.of_stage:
                self._ledger.sums.push_work += begin_pushes(drive.push, self._motion)
        self._search.ask()

    def move(self, drive):
        """Give walls, faces and sphere the speeds of a Drive."""
        environment = self._environment
        driven = environment.domain.driven(drive, environment.step, self._load_integral)
        environment.place(driven)
        if self._sphere is not None:
            self._sphere.drive(drive)

    def _steer(self):
        """Load control changes the speeds, within those that the search allows for."""
        loads, environment = self._kernel_sums.read_loads(), self._environment
        with self._ledger.change_speeds(loads):
            domain, step = environment.domain, environment.step

            def integral(servo):
                return self._load_integral(servo, loads)

            if domain.servo is not None and domain.servo.next_change == step:
                domain = domain.steer(integral(domain.servo))
            if domain.surfaces is not None and domain.surfaces.servos:
                domain = domain.steer_surfaces(step, integral)
            environment.place(domain)

    def _load_integral(self, servo, loads=None):
        """Time integral of the load of a Servo up to now. loads: LoadSums."""
        loads = loads or self._kernel_sums.read_loads()
        if servo.mode == WALL:
            normal = self._environment.box.normal[TOP]
            return (loads.impulses()[TOP : TOP + 1] * normal).sum(axis=1)
        if servo.mode == SURFACE:
            number = list(servo.axes)
            directions = self._environment.domain.surfaces.directions[number]
            return (loads.surface_impulses()[number, :3] * directions).sum(axis=1)
        flux = np.diag(loads.momentum_flux())
        return np.array([flux.mean()]) if servo.mode == EVEN else flux[list(servo.axes)]

    # -- forces ----------------------------------------------------------------------------------

    def evaluate(self):
        """Force [nN] and torque [nN um] of the present contacts on every grain, (N, 3) each.

        Grains are in the sample's order. The state does not change; forces that act during one step
        only (first touches) are not included.
        """
        state = self._state
        used = state.used_blocks()
        loads_in_memory = [state.rows("load", blocks) for blocks in used]
        self._kernels.evaluate(*self._environment.moment)
        loads = self._motion.sum_contact_loads()
        for load, blocks in zip(loads_in_memory, used, strict=True):
            state.put_rows("load", load, blocks)
        out = np.empty((2, self._bodies.count, 3))
        out[:, state.order] = loads
        return out[0], out[1]


@lru_cache(maxsize=1)
def step_numbers(dt, masses, wall_due, reach2):
    """The numbers of a step as kernels take them; masses: units of mass and moment of inertia."""
    mass, inertia = masses
    return StepNumbers(dt=dt, kick=dt / mass, turn=dt / inertia, reach2=reach2, wall_due=wall_due)
