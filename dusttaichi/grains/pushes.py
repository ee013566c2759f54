"""External pushes on some grains, in internal units and order: forces, carried grains, kicks.

A force acts from the start of the run, or of its stage, up to the middle of its last step; its work
is force times displacement. A carried grain moves at a prescribed velocity and does not rotate,
whatever forces act on it; its carrier does the work that the contacts absorb.
"""

import copy
from dataclasses import dataclass, replace

import numpy as np

from dusttaichi import samples, units
from dusttaichi.domain.clock import NEVER
from dusttaichi.grains.measure import contact_loads, grain_state, set_back, velocities
from dusttaichi.grains.order import rank_of
from dusttaichi.physics.geometry import rigid_rotation
from dusttaichi.results.plain import from_plain, plain


@dataclass(frozen=True)
class Force:
    """Equal force [nN] (3,) on each of some grains until the step `end`.

    start: positions of its grains at the beginning of its stage [um], (n, 3), or None.
    """

    grains: np.ndarray
    each: np.ndarray
    end: int
    start: np.ndarray | None = None


class Push:
    """All pushes of a scene of `grains` grains; none where the scene has none.

    forces: list of Force. speeds: dict grain -> velocity (3,) [um/us] of a carried one. kinds: of
    the pushes of stages.
    """

    def __init__(self, grains, forces=(), speeds=None, kinds=()):
        self.grains, self.forces, self.kinds = grains, tuple(forces), frozenset(kinds)
        self.own_speeds = speeds or {}
        self._carry(self.own_speeds)

    def _carry(self, speeds):
        self.carried_grains = np.array(sorted(speeds), dtype=int)
        self.velocity = np.array([speeds[g] for g in self.carried_grains]).reshape(-1, 3)

    @property
    def forced(self):
        """True where forces act in this run."""
        return bool(self.forces) or "force" in self.kinds

    @property
    def carried(self):
        """True where grains are carried in this run."""
        return len(self.carried_grains) > 0 or "speed" in self.kinds

    @property
    def of_stage(self):
        """True where some of it ends with the stage."""
        differs = set(self.carried_grains.tolist()) != set(self.own_speeds)
        return differs or any(force.start is not None for force in self.forces)

    @property
    def works(self):
        return self.forced or self.carried or bool(self.kinds)

    # -- stages ----------------------------------------------------------------------------------

    def next_stage(self, forces, speeds):
        """The Push of the next stage: all that does not end with the present one, and these."""
        out = copy.copy(self)
        out.forces = (*(f for f in self.forces if f.start is None), *forces)
        out._carry(self.own_speeds | speeds)
        return out

    def work_of_stage(self, x, impulse, force, step, dt):
        """Work since the start of the stage [fJ] of its forces and of the carriers of grains.

        Arguments as of `work`.
        """
        out = copy.copy(self)
        out.forces = tuple(f for f in self.forces if f.start is not None)
        return out.work(x, impulse, force, step, dt)

    def numbers(self):
        """State for a checkpoint, as JSON."""
        speeds = list(zip(self.carried_grains, self.velocity, strict=True))
        return plain({"forces": self.forces, "speeds": speeds, "first": self.first})

    def restored(self, numbers):
        """The Push of these numbers."""
        out = copy.copy(self)
        out.forces = tuple(from_plain(Force, force) for force in numbers["forces"])
        out._carry({g: np.array(speed) for g, speed in numbers["speeds"]})
        out.first = np.array(numbers["first"]).reshape(-1, 3)
        return out

    # -- forces and work -------------------------------------------------------------------------

    def force(self, step):
        """Forces on all grains after a step [nN], (N, 3)."""
        out = np.zeros((self.grains, 3))
        for force in self.forces:
            if step < force.end:
                out[force.grains] += force.each
        return out

    def place(self, fields, step=0):
        """Fill the fields of a push at the start of the run or of a stage."""
        if self.forced:
            fields["push_force"].from_numpy(self.force(step))
        if self.carried:
            free = np.ones(self.grains)
            free[self.carried_grains] = 0.0
            fields["free"].from_numpy(free)
            fields["carried_impulse"].fill(0.0)

    def begin(self, x, force):
        """Store positions and contact forces of step 0, the reference of the work."""
        self.start, self.first = x[: self.grains].copy(), force[self.carried_grains]

    def on(self, loads, step):
        """Contact loads (force, torque), (2, N, 3), with the pushes; 0 on carried grains."""
        if self.forced:
            loads[0] += self.force(step)
        loads[:, self.carried_grains] = 0.0
        return loads

    def next_end(self, step, end):
        """The next step after `step` at which a force ends, `end` if none does before."""
        return min([f.end for f in self.forces if step < f.end < end], default=end)

    def _work(self, force, x):
        start = self.start[force.grains] if force.start is None else force.start
        return float(np.sum((x[force.grains] - start) @ force.each))

    def work(self, x, impulse, force, step, dt):
        """Work since the start [fJ] of the forces that still act, and of the carriers of grains.

        x: positions. impulse: time integral of the contact forces over whole steps. force: current
        contact forces (N, 3).
        """
        work = sum(self._work(f, x) for f in self.forces if step < f.end)
        if self.carried:
            # the force of a step acts half before and half after it
            grains = self.carried_grains
            absorbed = impulse[grains] + 0.5 * dt * (force[grains] - self.first)
            work -= float(np.sum(absorbed * self.velocity))
        return work

    def ends_at(self, step):
        """True if a force ends at this step."""
        return any(f.end == step for f in self.forces)

    def ending(self, x, step):
        """(work [fJ], sum of the forces (N, 3)) of the forces that end at this step."""
        over = [f for f in self.forces if f.end == step]
        kick = np.zeros((self.grains, 3))
        for force in over:
            kick[force.grains] += force.each
        return sum(self._work(f, x) for f in over), kick


def forces_and_speeds(entries, groups, dt, first=0):
    """([Force], {grain: velocity}) of blocks `push`.

    groups: internal numbers of the grains of each. dt [us]. first: step at which they begin.
    """
    forces, speeds = [], {}
    for entry, grains in zip(entries, groups, strict=True):
        if entry.force is not None:
            force = np.array(entry.force) / units.FORCE / len(grains)
            duration = entry.duration
            steps = NEVER if duration is None else max(1, round(duration / units.TIME / dt))
            forces.append(Force(grains, force, NEVER if steps == NEVER else first + steps))
        elif entry.speed is not None:
            speeds |= {int(g): np.array(entry.speed) / units.SPEED for g in grains}
    return forces, speeds


def make_push(entries, info, order, dt, kinds=()):
    """Push for the `push` block of a scene, a sample's info (samples.apply_pushes), order, dt [us].

    kinds: of the pushes of stages.
    """
    rank, stored = rank_of(order), info.get("push", ()) if entries else ()
    groups = [rank[np.array(group["grains"])] for group in stored]
    return Push(len(order), *forces_and_speeds(entries, groups, dt), kinds=kinds)


def push_anew(sim, entries):
    """The pushes of a Simulation's last stage end, and `entries` (scene.Push) begin.

    Velocities and spins are half a step back: they are brought to the current step by the loads
    that have acted, changed there, and set back by those that act from now on. The work of the
    pushes up to now, and the kinetic energy that the change itself gives or takes, go into the
    ledger sums.
    """
    state, (v, w) = sim.state, velocities(sim)
    energy_before = _kinetic(sim, v, w)
    contact, x = contact_loads(sim)[0], state["x"]
    impulse = state["carried_impulse"] if "carried_impulse" in state else None
    work = sim.push.work_of_stage(x, impulse, contact, sim.step, sim.dt)

    mass = np.broadcast_to(sim.mass, (sim.grains, 1))
    groups = _groups(sim, entries)
    forces, speeds = forces_and_speeds(entries, groups, sim.dt, sim.step)
    forces = [replace(force, start=x[force.grains]) for force in forces]
    sim.push = sim.push.next_stage(forces, speeds)
    sim.push.first = contact[sim.push.carried_grains]
    sim.push.place(sim.fields, sim.step)
    for entry, grains in zip(entries, groups, strict=True):
        if entry.velocity is not None:
            v[grains] += np.array(entry.velocity) / units.SPEED
        if entry.spin is not None:
            spin, masses = np.array(entry.spin) / units.SPIN, mass[grains]
            v[grains] += rigid_rotation(spin, x[grains], masses)
            w[grains] += spin
    v[sim.push.carried_grains], w[sim.push.carried_grains] = sim.push.velocity, 0.0

    set_back(sim, v, w)
    sim.ledger_sums.push_work += work + _kinetic(sim, v, w) - energy_before


def _groups(sim, entries):
    """Internal numbers of the grains of each push; faces are the current ones."""
    x, rank = grain_state(sim)[0] * units.LENGTH, sim.state.rank
    radius = sim.radius * units.LENGTH
    return [
        rank[samples.find_pushed_grains(f"drive.push[{n}]", entry, x, radius)]
        for n, entry in enumerate(entries)
    ]


def _kinetic(sim, v, w):
    """Kinetic energy of all grains [fJ]."""
    return 0.5 * float(np.sum(sim.mass * v**2) + np.sum(sim.inertia * w**2))
