"""Two bodies of a simulation of grains that meet, or one and a wall, for studies of collisions."""

from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import are_in_same_fragment, label_components
from dusttaichi.samples import Sample
from dusttaichi.samples.materials import Materials
from dusttaichi.scene import Scene


class Encounter:
    """Two bodies that meet, whose `measure_relative_motion()` is that of TwoBodies.

    initial_velocity (3,) [m/s]: relative velocity at the start. normal (3,): direction from the
    second body, or the wall, to the first, at the smallest distance seen by `update_normal`.
    """

    initial_velocity: NDArray[np.float64]
    normal: NDArray[np.float64]
    _nearest: float

    def measure_relative_motion(self) -> NDArray[np.float64]:
        """Distance [m] and velocity [m/s] of the first body from the second or the wall, (2, 3)."""
        raise NotImplementedError

    def start(self) -> None:
        """Store the relative velocity, before the collision."""
        self.initial_velocity, self._nearest = self.measure_relative_motion()[1], inf

    def update_normal(self) -> None:
        """Store the normal where the bodies are closer than at all former calls."""
        line = self.measure_relative_motion()[0]
        distance = float(np.linalg.norm(line))
        if distance < self._nearest:
            self._nearest, self.normal = distance, line / distance

    def measure_restitution(self) -> float | None:
        """Speed of separation over that of approach, along the normal; None without an approach."""
        approach = -float(self.initial_velocity @ self.normal)
        if approach <= 0.0:
            return None
        return float(self.measure_relative_motion()[1] @ self.normal) / approach


class TwoBodies(Encounter):
    """Two bodies in motion, or one and the nearest wall; SI.

    scene, sample: its Sample, grains of the first body first. sim: its method.Engine; dt [s]:
    of its step. masses [kg], radii [m]: of the grains (N,). bodies: grains of each. Raises
    DustError for one body without a wall, and as a build does.
    """

    def __init__(self, scene: Scene, sample: Sample) -> None:
        self.scene, self.sample = scene, sample
        self.sim: Any = method.find_method(scene).build(scene, sample)
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

    def measure_relative_motion(self) -> NDArray[np.float64]:
        """Distance [m] and velocity [m/s] of the first body from the second or the wall, (2, 3).

        Of centres of mass; of a wall the distance of the grain that is next to it.
        """
        x, v, _ = self.sim.motion.measure()
        first, *second = (
            np.array([np.average(a[body], axis=0, weights=self.masses[body]) for a in (x, v)])
            for body in self.bodies
        )
        if second:
            motion = first - second[0]
        else:
            box = self.sim.domain.box
            distance = x @ box.normal.T - box.offsets(self.sim.environment.time)
            distance = np.where(box.present == 1, distance, inf).min(axis=0)
            wall = int(np.argmin(distance))
            normal = box.normal[wall]
            motion = np.array([distance[wall] * normal, first[1] - box.speed[wall] * normal])
        return np.asarray(motion * [[self.sim.units("m")], [self.sim.units("m/s")]])

    def label_fragments(self) -> NDArray[np.int64]:
        """Fragment of each grain (N,): sets of grains connected by contacts."""
        pairs = self.sim.contacts.measure_pairs()
        pairs = np.column_stack([pairs["grain_i"], pairs["grain_j"]])
        return np.asarray(label_components(pairs, len(self.masses))[1])

    def are_bound(self) -> bool:
        """True while one fragment has more than half of the mass of both, or touches the wall."""
        if len(self.bodies) == 1:
            return len(self.sim.contacts.measure_walls()["grain"]) > 0
        label = self.label_fragments()
        mean = np.bincount(label, self.masses) / np.bincount(label)
        return bool(are_in_same_fragment(label, mean[label], self.bodies))
