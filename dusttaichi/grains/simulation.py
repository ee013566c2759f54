"""A built scene in motion: advances by whole steps, searches when due, measures. Internal units.

The box (walls) and the cell (periodic faces) of its domain move as the drive of the moment says;
`drive` changes it between two steps, and the ledger continues.
"""

from contextlib import contextmanager

import numpy as np

from dusttaichi import units
from dusttaichi.compute.loops import DONE
from dusttaichi.domain.cell import Cell
from dusttaichi.domain.clock import NEVER
from dusttaichi.domain.domain import Domain
from dusttaichi.domain.servo import EVEN, WALL, Servo
from dusttaichi.domain.walls import TOP, Box
from dusttaichi.grains.contacts import distances
from dusttaichi.grains.forces import put_forces, sum_energies
from dusttaichi.grains.ledger_sums import LedgerSums
from dusttaichi.grains.load_sums import load_sums
from dusttaichi.grains.measure import (
    contact_loads,
    energies,
    face_power,
    set_back,
    wall_work,
)
from dusttaichi.grains.members import Members
from dusttaichi.grains.pushes import push_anew
from dusttaichi.grains.search import Search
from dusttaichi.grains.sphere import MovingSphere
from dusttaichi.grains.state import GrainState
from dusttaichi.grains.step import step_numbers, walls_argument
from dusttaichi.results.plain import from_plain, plain
from dusttaichi.units import GRAINS

STORED = {"ledger_sums": LedgerSums, "box": Box, "cell": Cell, "servo": Servo}  # in a checkpoint


class Simulation:
    """State and kernels of one scene. `step` counts steps; `time` = step dt.

    state: GrainState; search: Search; domain: what surrounds the grains, a Domain; push: Push;
    pair, wall: numbers of a contact (kernels.numbers), where grains differ those of the contact
    that reaches farthest.
    radii [um]: of all grains, one number, or (N,) in the sample's order; radius, smallest: the
    largest and the smallest of them. mass [pg], inertia [pg um^2]: one number, or (N, 1) in
    internal order; unit_mass, unit_inertia: arguments of kernels, units where grains have their
    own. volume [um^3]: of all grains. sample_info: that of the Sample, with images in its cell.
    """

    units = GRAINS

    def __init__(self, compiled, tables, preparation, numbers):
        """compiled: Compiled; tables: its fields, scratch and sums as this scene uses them.

        parts: Prepared. numbers: of a contact (kernels.numbers) of two grains, with a wall and with
        the sphere, None without one.
        """
        self.kernels, self.layout = compiled.kernels, compiled.layout
        self.fields, self.scratch, self.sums = tables
        self.order, self.grains = preparation.order, len(preparation.order)
        self.sample_info = preparation.sample.info
        self.state = GrainState(self.fields, self.layout, self.order)
        self.pair, self.wall, on_sphere = numbers
        self.stiffness = preparation.scene.numerics.stiffness_scaling
        self.polydisperse, self.contact_table = preparation.polydisperse, preparation.contact_table
        self._set_masses(preparation.properties)
        domain = preparation.domain
        self.dt, self.step, self.volume, self.t_c = domain.dt, 0, domain.volume, domain.t_c
        self.box, self.cell, self.servo = domain.box, domain.cell, None
        self.outside, self.push, self.sphere = preparation.forces, preparation.push, None
        if preparation.sphere is not None:
            self.sphere = MovingSphere(self, preparation.sphere, on_sphere)
        self.chosen, self.threads = preparation.step, preparation.threads
        self.search, self.ledger_sums = Search(self, preparation.skin), LedgerSums()
        self.members = None
        if self.layout.members:
            self.members = Members(self, self.sample_info["members"])
        self._move(preparation.scene.stage_plans[0].drive)
        self._start(preparation.sample)

    def _set_masses(self, masses):
        """Sizes and masses of the grains, of GrainProperties."""
        self.mass, self.inertia = masses.mass / units.MASS, masses.inertia / units.INERTIA
        self.unit_mass, self.unit_inertia = self.mass, self.inertia
        self.radii = self.radius = self.smallest = masses.radius / units.LENGTH
        if self.polydisperse is not None:
            self.mass, self.inertia = (a[self.order][:, None] for a in (self.mass, self.inertia))
            self.unit_mass = self.unit_inertia = 1.0
            self.radius, self.smallest = float(self.radii.max()), float(self.radii.min())

    @property
    def time(self):
        return self.step * self.dt

    @property
    def grain_radii(self):
        """Radii of the grains by the sample's numbers [um], (N,)."""
        return np.broadcast_to(self.radii, self.grains)

    @property
    def domain(self):
        """Environment of the grains and its motion, a Domain."""
        shared = self.box, self.cell, self.t_c, self.servo, self.units
        return Domain(self.dt, self.volume, self.radius, *shared)

    def lengths(self):
        """Current edges of the space for the grains [um], (3,); not a number where it is open."""
        return self.domain.lengths(self.step)

    # -- start -----------------------------------------------------------------------------------

    def _start(self, sample):
        """Grains into their fields, contacts found, loads of time 0, v and w half a step back."""
        order, state = self.order, self.state
        state.put_grains("x", sample.positions[order] / units.LENGTH, far=True)
        state.put_grains("v", sample.velocities[order] / units.SPEED)
        state.put_grains("w", sample.spins[order] / units.SPIN)
        if self.layout.orientation:
            state["orientation"] = np.tile([1.0, 0.0, 0.0, 0.0], (self.grains, 1))
        self.push.place(self.fields)
        if self.polydisperse is not None:
            state["material"] = self.polydisperse.material[order]
            state["radius"] = self.radii[order]
            state["mass"], state["inertia"] = self.mass[:, 0], self.inertia[:, 0]
        if self.sphere is not None:
            self.sphere.place()
        if self.members is not None:
            self.members.place(sample.positions[order] / units.LENGTH)
        if self.outside is not None:
            put_forces(self)
        state.put_numbers(
            self.pair, self.wall, None if self.sphere is None else self.sphere.contact
        )
        self.search.now(0)
        self._restore_contacts(sample)
        self._load_contacts()
        state.clear_sums()
        if self.push.works:
            self.push.begin(state["x"], contact_loads(self)[0])
        set_back(self, state.of_grains("v"), state.of_grains("w"))
        if self.sphere is not None:
            self.sphere.set_back()
        self._begin_ledger()

    def _restore_contacts(self, sample):
        """Histories of the contacts that a Sample has; the search has found their pairs."""
        state, radii = self.state, self.grain_radii
        if sample.contacts is not None:
            i, j = state.pairs()
            state.take_contacts(sample.contacts, distances(self, np.arange(len(i)), i, j), radii)
        if sample.wall_contacts is not None:
            state.take_wall_contacts(sample.wall_contacts, radii, self.box.normal)
        state.stiffen(sample.info.get("stiffness_scaling", 1.0) / self.stiffness)

    def _begin_ledger(self):
        """Forces, potentials and pending losses at the start; velocities are half a step back."""
        self.forces_at_start = None if self.outside is None else sum_energies(self)
        self.ledger_sums.wall_force = load_sums(self).wall_force()
        if self.sphere is not None:
            self.ledger_sums.sphere_force = self.sphere.load()[0]
        self.ledger_sums.pending = [[0.0] * len(self.layout.channels)] * 3
        begin = energies(self)
        names = ("loss", "loss_wall", "loss_sphere")
        self.ledger_sums.pending = [begin[name].tolist() for name in names]
        self.ledger_sums.face_power = face_power(self)
        if self.members is not None:
            self.members.begin()

    # -- drive -----------------------------------------------------------------------------------

    def drive(self, drive):
        """Move walls and faces as `drive` (scene.Drive) says from this step on."""
        if self.sphere is not None:
            force, impulse = self.sphere.load()[0], self.sphere.impulses()[:3]
            self.ledger_sums.sphere_work = self.sphere.work(force, impulse)
            self.ledger_sums.sphere_force, self.ledger_sums.sphere_impulse = force, impulse
        with self._booked(load_sums(self)):
            self._move(drive)
            if drive.push or self.push.of_stage:
                push_anew(self, drive.push)
        self.search.ask()

    @contextmanager
    def _booked(self, loads):
        """Context in which walls and faces get other speeds; the ledger continues.

        loads: LoadSums now.
        """
        cell_before, force, impulse = self.cell, loads.wall_force(), loads.impulses()
        across = None if cell_before is None else loads.across_faces()
        sums, work = self.ledger_sums, wall_work(self, force, impulse)
        sums.wall_work, sums.wall_force, sums.impulse = work, force, impulse
        yield
        if cell_before is not None:
            power = self.cell.power(across, self.time) - cell_before.power(across, self.time)
            sums.face_jumps += 0.5 * self.dt * power

    def _move(self, drive):
        self._surround(self.domain.driven(drive, self.step, self._load_integral))
        if self.sphere is not None:
            self.sphere.drive(drive)

    def _steer(self):
        """Load control changes the speeds, within those that the search allows for."""
        loads = load_sums(self)
        with self._booked(loads):
            self._surround(self.domain.steer(self._load_integral(self.servo, loads)))

    def _load_integral(self, servo, loads=None):
        """Time integral of the load of a Servo up to now. loads: LoadSums."""
        loads = loads or load_sums(self)
        if servo.mode == WALL:
            return (loads.impulses()[TOP : TOP + 1] * self.box.normal[TOP]).sum(axis=1)
        flux = np.diag(loads.momentum_flux())
        return np.array([flux.mean()]) if servo.mode == EVEN else flux[list(servo.axes)]

    def _surround(self, domain):
        self.box, self.cell, self.servo = domain.box, domain.cell, domain.servo
        if self.cell is not None:
            self.state["cell"] = self.cell.rows

    def set_upright(self, time):
        """Continue a cell tilted by more than half its edge as the same lattice, tilted less.

        A search must follow.
        """
        cell = self.cell.upright(time)
        if cell is not self.cell:
            self.cell = cell
            self.state["cell"] = cell.rows

    @property
    def walls_argument(self):
        """The walls as kernels take them."""
        return walls_argument(self.box)

    # -- steps -----------------------------------------------------------------------------------

    def advance(self, steps):
        """Make `steps` steps, searching for neighbours whenever it is due."""
        end = self.step + steps
        pending = 0
        while self.step < end:
            until = self.push.next_end(self.step, end)
            if self.servo is not None:
                until = min(until, self.servo.next_change)
            steps_done, is_due = self._call(until - self.step, pending, self.dt)
            self.step += steps_done
            pending = 0
            if self.step == until and until < NEVER:
                self._end_pushes()
                if self.servo is not None and until == self.servo.next_change:
                    self._steer()
            if is_due:
                with self.search.around:
                    self.search.now(self.step + 1)
                pending = 1

    def _call(self, steps, pending, dt):
        self.fields["sync"].access.check()  # before anything moves
        masses = self.unit_mass, self.unit_inertia
        numbers = step_numbers(dt, masses, self.search.wall_due, self.search.reach2)
        outcome = self.kernels.advance(
            steps,
            self.step,
            pending,
            self.threads,
            numbers,
            self.walls_argument,
        )
        # workers write it to `sync`
        outcome = int(self.state["sync"][DONE]) if outcome is None else outcome[0]
        return outcome, outcome < steps

    def _load_contacts(self):
        """Form history and loads of the contacts of a start.

        A pass over them in which no time goes by, whose losses (those of forming) are not counted.
        """
        self.step -= 1
        self._call(1, 1, 0.0)
        self.step += 1

    def forces(self):
        """Force [nN] and torque [nN um] of the present contacts on every grain, (N, 3) each.

        Grains are in the sample's order. Nothing is changed; forces that act during one step only
        (first touches) are not included.
        """
        used = self.state.used_blocks()
        loads = [self.state.rows("load", blocks) for blocks in used]
        self.kernels.evaluate(self.step, self.dt, self.walls_argument)
        contact_load = contact_loads(self)
        for load, blocks in zip(loads, used, strict=True):
            self.state.put_rows("load", load, blocks)
        out = np.empty((2, self.grains, 3))
        out[:, self.order] = contact_load
        return out[0], out[1]

    def _end_pushes(self):
        """Forces that last until this step, half of which they act on, end."""
        if not self.push.ends_at(self.step):
            return  # positions stay where they are, on a device
        work, kick = self.push.ending(self.state["x"], self.step)
        self.ledger_sums.push_work += work
        self.state["v"] = self.state.of_grains("v") + 0.5 * self.dt / self.mass * kick
        self.state["push_force"] = self.push.force(self.step)

    # -- checkpoint ------------------------------------------------------------------------------

    def arrays(self):
        """All state, for a checkpoint: the used part of what `kernels.declare` lists."""
        return self.state.arrays()

    def numbers(self):
        """The plain numbers that belong to `arrays`."""
        return {
            "step": self.step,
            "search": self.search.numbers(),
            "sphere": None if self.sphere is None else plain(self.sphere.speed),
            "push": self.push.numbers() if self.push.kinds else None,
            **{name: plain(getattr(self, name)) for name in STORED},
        }

    def restore(self, arrays, numbers):
        """Go back to a checkpoint of the same scene and sample."""
        self.state.restore(arrays)
        self.step = numbers["step"]
        self.search.restore(numbers["search"])
        for name, value_type in STORED.items():
            setattr(self, name, from_plain(value_type, numbers[name]))
        if self.sphere is not None:
            self.sphere.speed = from_plain(np.ndarray, numbers["sphere"])
        if numbers["push"] is not None:
            self.push = self.push.restored(numbers["push"])
