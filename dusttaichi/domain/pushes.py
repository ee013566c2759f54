"""Pushes from outside on some grains, in internal units and order: forces, carried grains.

A force acts from the start of the run until its last step, on half of which it acts; its work is
force times way. A carried grain keeps its velocity and does not turn, whatever pulls at it; what
carries it does the work that the contacts take from it.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi import units
from dusttaichi.names import NEVER


@dataclass(frozen=True)
class Force:
    """The same force [nN] (3,) on each of some grains until the step `end`."""

    grains: np.ndarray
    each: np.ndarray
    end: int


class Push:
    """All pushes of a scene of `grains` grains; none where the scene has none.

    forces: list of Force. speeds: dict grain -> velocity (3,) [um/us] that it is carried at.
    """

    def __init__(self, grains, forces=(), speeds=None):
        speeds = speeds or {}
        self.grains, self.forces = grains, tuple(forces)
        self.held = np.array(sorted(speeds), dtype=int)
        self.velocity = np.array([speeds[g] for g in self.held]).reshape(-1, 3)

    @property
    def forced(self):
        return bool(self.forces)

    @property
    def carried(self):
        return len(self.held) > 0

    @property
    def works(self):
        return self.forced or self.carried

    def force(self, step):
        """Forces on all grains after a step [nN], (N, 3)."""
        out = np.zeros((self.grains, 3))
        for force in self.forces:
            if step < force.end:
                out[force.grains] += force.each
        return out

    def place(self, fields):
        """Fill the fields of a push, as they are at the start."""
        if self.forced:
            fields["push_force"].from_numpy(self.force(0))
        if self.carried:
            free = np.ones(self.grains)
            free[self.held] = 0.0
            fields["free"].from_numpy(free)
            fields["held"].fill(0.0)

    def begin(self, x, force):
        """Remember positions and contact forces of step 0, which the work counts from."""
        self.start, self.first = x[: self.grains].copy(), force[self.held]

    def on(self, loads, step):
        """Contact loads (force, torque), (2, N, 3), with the pushes; 0 on carried grains."""
        if self.forced:
            loads[0] += self.force(step)
        loads[:, self.held] = 0.0
        return loads

    def next_end(self, step, end):
        """The next step after `step` at which a force ends, `end` if none does before."""
        return min([f.end for f in self.forces if step < f.end < end], default=end)

    def _work(self, force, x):
        way = x[force.grains] - self.start[force.grains]
        return float(np.sum(way @ force.each))

    def work(self, x, held, force, step, dt):
        """Work since the start [fJ] of the forces that act still, and of what carries grains.

        x: positions. held: time integral of the contact forces over whole steps up to now. force:
        those of now (N, 3).
        """
        work = sum(self._work(f, x) for f in self.forces if step < f.end)
        if self.carried:
            # the force of a step acts half before and half after it
            taken = held[self.held] + 0.5 * dt * (force[self.held] - self.first)
            work -= float(np.sum(taken * self.velocity))
        return work

    def ending(self, x, step):
        """(work [fJ], sum of the forces (N, 3) or None) of the forces that end at this step."""
        over = [f for f in self.forces if f.end == step]
        if not over:
            return 0.0, None
        kick = np.zeros((self.grains, 3))
        for force in over:
            kick[force.grains] += force.each
        return sum(self._work(f, x) for f in over), kick


def make_push(entries, info, order, dt):
    """Push for the `push` block of a scene and a sample's info (samples.pushed), order, dt [us]."""
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order))
    forces, speeds = [], {}
    for entry, group in zip(entries, info.get("push", ()), strict=bool(entries)):
        grains = rank[np.array(group["grains"])]
        if entry.force is not None:
            each = np.array(entry.force) / units.FORCE / len(grains)
            duration = entry.duration
            end = NEVER if duration is None else max(1, round(duration / units.TIME / dt))
            forces.append(Force(grains, each, end))
        elif entry.speed is not None:
            speeds |= {int(g): np.array(entry.speed) / units.SPEED for g in grains}
    return Push(len(order), forces, speeds)
