"""Two bodies of a simulation of grains that meet, or one and a wall, for studies of collisions."""

from math import inf

import numpy as np

from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import are_in_same_fragment, label_components
from dusttaichi.samples.materials import Materials


class Encounter:
    """Two bodies that meet, whose `relative()` is that of TwoBodies.

    before (3,) [m/s]: relative velocity at the start. normal (3,): line from the second body, or
    the wall, to the first, where `look` found them closest.
    """

    def start(self):
        """Begin to look."""
        self.before, self._nearest = self.relative()[1], inf

    def look(self):
        """Keep the normal at the moment when the bodies have been closest."""
        line = self.relative()[0]
        distance = np.linalg.norm(line)
        if distance < self._nearest:
            self._nearest, self.normal = distance, line / distance

    def restitution(self):
        """Speed of separation over that of approach, along the normal; None without an approach."""
        approach = -float(self.before @ self.normal)
        return float(self.relative()[1] @ self.normal) / approach if approach > 0.0 else None


class TwoBodies(Encounter):
    """Two bodies in motion, or one and the nearest wall; SI.

    scene, sample: its Sample, grains of the first body first. sim: its method.Engine; dt [s]:
    of its step. masses [kg], radii [m]: of the grains (N,). bodies: grains of each. Raises
    DustError for one body without a wall, and as a build does.
    """

    def __init__(self, scene, sample):
        self.scene, self.sample = scene, sample
        self.sim = method.find_method(scene).build(scene, sample)
        self.dt = self.sim.dt * self.sim.units("s")
        materials, count = Materials(scene), len(sample)
        self.masses = np.broadcast_to(materials.masses(sample), count)
        self.radii = np.broadcast_to(materials.radii_of(sample), count)
        split = 1 if sample.info.get("kind") == "pair" else sample.info.get("target_grains")
        self.bodies = np.split(np.arange(count), [] if split is None else [split])
        if split is None and self.sim.domain.box is None:
            raise DustError(
                "A collision needs two bodies; allowed: sample.kind pair or collision, or a "
                "boundary with a wall."
            )
        self.start()

    def relative(self):
        """Distance [m] and velocity [m/s] of the first body from the second or the wall, (2, 3).

        Of centres of mass; of a wall the distance of the grain that is next to it.
        """
        x, v, _ = self.sim.motion.measure()
        first, *second = (
            np.array([np.average(a[body], axis=0, weights=self.masses[body]) for a in (x, v)])
            for body in self.bodies
        )
        if second:
            found = first - second[0]
        else:
            box = self.sim.domain.box
            distance = x @ box.normal.T - box.offsets(self.sim.environment.time)
            distance = np.where(box.present == 1, distance, inf).min(axis=0)
            wall = int(np.argmin(distance))
            normal = box.normal[wall]
            found = np.array([distance[wall] * normal, first[1] - box.speed[wall] * normal])
        return found * [[self.sim.units("m")], [self.sim.units("m/s")]]

    def fragment_of(self):
        """Fragment of each grain (N,): sets of grains connected by contacts."""
        pairs = self.sim.contacts.measure_pairs()
        pairs = np.column_stack([pairs["grain_i"], pairs["grain_j"]])
        return label_components(pairs, len(self.masses))[1]

    def is_one(self):
        """True while one fragment has more than half of the mass of both, or touches the wall."""
        if len(self.bodies) == 1:
            return len(self.sim.contacts.measure_walls()["grain"]) > 0
        label = self.fragment_of()
        mean = np.bincount(label, self.masses) / np.bincount(label)
        return are_in_same_fragment(label, mean[label], self.bodies)
