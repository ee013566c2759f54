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
from dusttaichi.physics.geometry import rigid_rotation
from dusttaichi.results.plain import from_plain, plain


@dataclass(frozen=True)
class Force:
    """Equal force [nN] (3,) on each of some grains until the step `end`.

    start: positions of its grains at the beginning of its stage [um], (n, 3), or None.
    """

    grains: np.ndarray
    force_per_grain: np.ndarray
    end: int
    start: np.ndarray | None = None


class Push:
    """All pushes of a scene of `grains` grains; none where the scene has none.

    forces: list of Force. speeds: dict grain -> velocity (3,) [um/us] of a carried one. kinds: of
    the pushes of stages.
    """

    def __init__(self, grains, forces=(), speeds=None, stage_kinds=()):
        self.grains, self.forces, self.stage_kinds = grains, tuple(forces), frozenset(stage_kinds)
        self.own_speeds = speeds or {}
        self._carry(self.own_speeds)

    def _carry(self, speeds):
        self.carried_grains = np.array(sorted(speeds), dtype=int)
        self.velocity = np.array([speeds[g] for g in self.carried_grains]).reshape(-1, 3)

    @property
    def forced(self):
        """True where forces act in this run."""
        return bool(self.forces) or "force" in self.stage_kinds

    @property
    def carried(self):
        """True where grains are carried in this run."""
        return len(self.carried_grains) > 0 or "speed" in self.stage_kinds

    @property
    def of_stage(self):
        """True where some of it ends with the stage."""
        differs = set(self.carried_grains.tolist()) != set(self.own_speeds)
        return differs or any(force.start is not None for force in self.forces)

    @property
    def works(self):
        return self.forced or self.carried or bool(self.stage_kinds)

    # -- stages ----------------------------------------------------------------------------------

    def begin_stage(self, forces, speeds, contact_forces):
        """Begin these pushes beside those of the run.

        contact_forces (N, 3): now [nN], the reference of the work of carriers.
        """
        self.forces = (*(f for f in self.forces if f.start is None), *forces)
        self._carry(self.own_speeds | speeds)
        self.first = contact_forces[self.carried_grains]

    def work_of_stage(self, x, impulse, force, step, dt):
        """Work since the start of the stage [fJ] of its forces and of the carriers of grains.

        Arguments as of `work`.
        """
        ending = copy.copy(self)
        ending.forces = tuple(f for f in self.forces if f.start is not None)
        return ending.work(x, impulse, force, step, dt)

    def numbers(self):
        """State for a checkpoint, as JSON."""
        speeds = list(zip(self.carried_grains, self.velocity, strict=True))
        return plain({"forces": self.forces, "speeds": speeds, "first": self.first})

    def restore(self, numbers):
        """Restore these numbers."""
        self.forces = tuple(from_plain(Force, force) for force in numbers["forces"])
        self._carry({g: np.array(speed) for g, speed in numbers["speeds"]})
        self.first = np.array(numbers["first"]).reshape(-1, 3)

    # -- forces and work -------------------------------------------------------------------------

    def force(self, step):
        """Forces on all grains after a step [nN], (N, 3)."""
        out = np.zeros((self.grains, 3))
        for force in self.forces:
            if step < force.end:
                out[force.grains] += force.force_per_grain
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

    def add_to(self, loads, step):
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
        return float(np.sum((x[force.grains] - start) @ force.force_per_grain))

    def work(self, x, impulse, force, step, dt):
        """Work since the start [fJ] of the forces that still act, and of the carriers of grains.

        x: positions. impulse: time integral of the contact forces over whole steps. force: current
        contact forces (N, 3).
        """
        work = sum(self._work(f, x) for f in self.forces if step < f.end)
        if self.carried:
            # the force of a step acts half before and half after it
            carried = self.carried_grains
            absorbed = impulse[carried] + 0.5 * dt * (force[carried] - self.first)
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
            kick[force.grains] += force.force_per_grain
        return sum(self._work(f, x) for f in over), kick


def forces_and_speeds(entries, groups, dt, first=0):
    """([Force], {grain: velocity}) of blocks `push`.

    groups: internal numbers of the grains of each. dt [us]. first: step at which they begin.
    """
    forces, speeds = [], {}
    for entry, grains in zip(entries, groups, strict=True):
        if entry.force is not None:
            force_per_grain = np.array(entry.force) / units.FORCE / len(grains)
            duration = entry.duration
            steps = NEVER if duration is None else max(1, round(duration / units.TIME / dt))
            forces.append(
                Force(grains, force_per_grain, NEVER if steps == NEVER else first + steps)
            )
        elif entry.speed is not None:
            speeds |= {int(g): np.array(entry.speed) / units.SPEED for g in grains}
    return forces, speeds


def make_push(entries, info, rank, dt, stage_kinds=()):
    """Push for the `push` block of a scene, a sample's info (samples.apply_pushes), dt [us].

    rank: internal number of each grain. stage_kinds: of the pushes of stages.
    """
    sample_pushes = info.get("push", ()) if entries else ()
    groups = [rank[np.array(group["grains"])] for group in sample_pushes]
    return Push(len(rank), *forces_and_speeds(entries, groups, dt), stage_kinds=stage_kinds)


def begin_pushes(entries, motion):
    """The pushes of the last stage of a Motion end, and `entries` (scene.Push) begin.

    Velocities and spins are half a step back: they are brought to the current step by the loads
    that have acted, changed there, and set back by those that act from now on. Returns the energy
    [fJ] that has entered: the work of the pushes up to now, and the change of the kinetic energy by
    the change itself.
    """
    state, push, environment = motion.state, motion.push, motion.environment
    step, dt, _ = environment.moment
    v, w = motion.velocities()
    kinetic_before = motion.kinetic_energy(v, w)
    contact_forces, x = motion.sum_contact_loads()[0], state["x"]
    work = push.work_of_stage(x, state.carried_impulse(), contact_forces, step, dt)

    mass = np.broadcast_to(motion.bodies.mass, (motion.bodies.count, 1))
    groups = _find_groups(entries, motion)
    forces, speeds = forces_and_speeds(entries, groups, dt, step)
    forces = [replace(force, start=x[force.grains]) for force in forces]
    push.begin_stage(forces, speeds, contact_forces)
    push.place(state.fields, step)
    for entry, grains in zip(entries, groups, strict=True):
        if entry.velocity is not None:
            v[grains] += np.array(entry.velocity) / units.SPEED
        if entry.spin is not None:
            spin = np.array(entry.spin) / units.SPIN
            v[grains] += rigid_rotation(spin, x[grains], mass[grains])
            w[grains] += spin
    v[push.carried_grains], w[push.carried_grains] = push.velocity, 0.0

    motion.set_back(v, w)
    return work + motion.kinetic_energy(v, w) - kinetic_before


def _find_groups(entries, motion):
    """Internal numbers of the grains of each push; faces are the current ones."""
    x, radius = motion.measure()[0] * units.LENGTH, motion.bodies.radius * units.LENGTH
    return [
        motion.state.rank[samples.find_pushed_grains(f"drive.push[{n}]", entry, x, radius)]
        for n, entry in enumerate(entries)
    ]
