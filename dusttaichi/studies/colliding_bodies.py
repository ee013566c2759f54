"""Two bodies of a simulation of grains that meet, or one and a wall, for studies of collisions."""

from __future__ import annotations

from math import inf, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi import method
from dusttaichi.analysis.fragments import compute_filling_factor
from dusttaichi.errors import DustError
from dusttaichi.grains import validity
from dusttaichi.physics.geometry import (
    are_in_same_fragment,
    label_components,
    largest_first,
    number_by_first,
)
from dusttaichi.samples import Sample
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.touching import deep_overlaps
from dusttaichi.scene import Scene

if TYPE_CHECKING:
    from dusttaichi.grains.grain_engine import GrainEngine
    from dusttaichi.grains.members import Look


class Encounter:
    """Two bodies that meet, whose `measure_relative_motion()` is that of TwoBodies.

    masses [kg], radii [m]: of the grains of the Sample of a scene, (N,). bodies: grains of both, of
    which the first has as many as `split`; of a single one, where that is None.
    initial_velocity (3,) [m/s]: relative velocity at the start. normal (3,): direction from the
    second body, or the wall, to the first, at the smallest distance seen by `update_normal`.
    """

    initial_velocity: NDArray[np.float64]
    normal: NDArray[np.float64]
    _nearest: float

    def __init__(self, scene: Scene, sample: Sample, split: int | None) -> None:
        self.scene, self.sample = scene, sample
        materials, count = Materials(scene), len(sample)
        self.masses = np.broadcast_to(materials.masses(sample), count)
        self.radii = np.broadcast_to(materials.radii_of(sample), count)
        self.bodies = np.split(np.arange(count), [] if split is None else [split])

    def measure_relative_motion(self) -> NDArray[np.float64]:
        """Distance [m] and velocity [m/s] of the first body from the second or the wall, (2, 3)."""
        raise NotImplementedError

    def label_grains(self) -> NDArray[np.intp]:
        """Fragment of each grain (N,): sets of grains connected by contacts."""
        raise NotImplementedError

    def are_bound(self) -> bool:
        """True while one fragment has more than half of the mass of both bodies."""
        return bool(are_in_same_fragment(self.label_grains(), self.masses, self.bodies))

    def start(self) -> None:
        """Store the relative velocity, before the collision."""
        self.initial_velocity, self._nearest = self.measure_relative_motion()[1], inf

    def update_normal(self) -> None:
        """Store the normal where the bodies are closer than at all former calls."""
        line = self.measure_relative_motion()[0]
        distance = sqrt(line @ line)  # as np.linalg.norm, in a tenth of its time
        if distance < self._nearest:
            self._nearest, self.normal = distance, line / distance

    def compute_filling_factors(self) -> NDArray[np.float64]:
        """Filling factors of the bodies of the Sample, within their characteristic radii."""
        volume = [np.sum(4.0 / 3.0 * np.pi * self.radii[grains] ** 3) for grains in self.bodies]
        gyration = []
        for grains in self.bodies:
            mass, x = self.masses[grains], self.sample.positions[grains]
            apart = x - mass @ x / mass.sum()
            gyration.append(np.sqrt(mass @ (apart**2).sum(axis=1) / mass.sum()))
        return compute_filling_factor(np.array(volume), np.array(gyration))

    def measure_restitution(self) -> float | None:
        """Speed of separation over that of approach, along the normal; None without an approach."""
        approach = -float(self.initial_velocity @ self.normal)
        if approach <= 0.0:
            return None
        return float(self.measure_relative_motion()[1] @ self.normal) / approach


class TwoBodies(Encounter):
    """Two bodies in motion, or one and the nearest wall; SI.

    scene, sample: its Sample, grains of the first body first. sim: its method.Engine; dt [s]:
    of its step. Raises DustError for one body without a wall, and as a build does.
    """

    def __init__(self, scene: Scene, sample: Sample) -> None:
        split = 1 if sample.info.get("kind") == "pair" else sample.info.get("target_grains")
        super().__init__(scene, sample, split)
        self.sim: Any = method.find_method(scene).build(scene, sample)
        self.dt = self.sim.dt * self.sim.units("s")
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

    def label_grains(self) -> NDArray[np.intp]:
        """Fragment of each grain (N,), in the order of their first grains."""
        pairs = self.sim.contacts.measure_pairs()
        pairs = np.column_stack([pairs["grain_i"], pairs["grain_j"]])
        return np.asarray(label_components(pairs, len(self.masses))[1])

    def are_bound(self) -> bool:
        """True while one fragment has more than half of the mass of both, or touches the wall."""
        if len(self.bodies) == 1:
            return len(self.sim.contacts.measure_walls()["grain"]) > 0
        return super().are_bound()


class MemberBodies(Encounter):
    """Two bodies that are a member of a simulation of several (grains.members); SI.

    passed: steps before it entered the simulation, the GrainEngine `run`. dt [s]: of its step.
    measurement: that of the last Look which had one. step, time, suspect, validate: as the guards
    need them.
    """

    step_key = "numerics.time_step"
    measurement: method.Measurement
    passed: int
    _motion: NDArray[np.float64]

    def enter(self, run: GrainEngine, member: int) -> None:
        """Continue as a member of a GrainEngine, after `passed` steps."""
        self.run: Any = run  # which has members
        self.member, self.units = member, run.units
        self._steps_before = self.passed - run.step
        self.dt, self.channels = run.dt * run.units("s"), run.channels

    def leave(self) -> None:
        """End as a member of its GrainEngine."""
        self.passed = self.step

    @property
    def step(self) -> int:
        """Steps since its start."""
        return int(self.run.step + self._steps_before)

    @property
    def time(self) -> float:
        """Time since its start [us]."""
        return float(self.step * self.run.dt)

    @property
    def suspect(self) -> str:
        """Sentence on contacts of the sample that push its grains apart, or ""."""
        return deep_overlaps(self.sample, Materials(self.scene))

    @property
    def _members(self) -> Any:
        return self.run.members

    def see(self, look: Look) -> None:
        """Take what was measured now."""
        self._motion = look.motion
        if look.measurement is not None:
            self.measurement, self._fragment = look.measurement, look.fragment

    def validate(self, measurement: method.Measurement) -> None:
        """Raise GuardStop if its Measurement cannot be trusted."""
        run = self.run
        grains = self._members.grains(self.member)
        validity.validate(measurement, self, run.motion, run.contacts, run.sphere, grains=grains)

    def name_invalid(self) -> str:
        """Its first grain whose position or velocity is not a number, for the guard, or ""."""
        grains = self._members.grains(self.member)
        return str(validity.name_invalid(self.run.motion, grains))

    def measure_relative_motion(self) -> NDArray[np.float64]:
        """Distance [m] and velocity [m/s] of the first body from the second, (2, 3)."""
        return self._motion

    def label_grains(self) -> NDArray[np.intp]:
        """Fragment of each grain (N,) at the last look with energies, 0 the heaviest."""
        return largest_first(number_by_first(self._fragment), self.masses)

    def count_fragments(self) -> list[int]:
        """Grains of the fragments at that look, smallest first."""
        grains = np.bincount(self._fragment - self._fragment.min())
        return sorted(grains[grains > 0].tolist())

    def measure_positions(self) -> NDArray[np.float64]:
        """Positions of the grains now [m], (N, 3)."""
        return np.asarray(self._members.positions(self.member) * self.units("m"))
