"""Task of a worker process of a study of sticking: one collision and its outcome."""

from dataclasses import replace
from functools import lru_cache
from math import ceil, inf, nan

import numpy as np

from dusttaichi import units
from dusttaichi.errors import DustError
from dusttaichi.geometry import connected
from dusttaichi.grains.build import build
from dusttaichi.samples.ballistic import first_touch
from dusttaichi.samples.collision import FLIGHT
from dusttaichi.scene import from_yaml
from dusttaichi.studies.sticking.collision import moving_bodies

LOOKS = 200  # moments of a run at which the line between the bodies is examined


def run(parent, *, scene, speed, time):
    """Outcome of the collision of a scene (text of its YAML) at a speed [m/s], as plain numbers.

    It ends at `time` [s] after the first contact. bound: one fragment has more than half of the
    grains of both bodies; of a body at a wall: one of its grains touches it. restitution: speed of
    separation of the centres of mass at the end over that of approach, along the line between them
    where they were closest, or the normal of the wall; 0 where the bodies are bound, not a number
    where they pass each other. fragments: sets of grains connected by contacts; largest: grains of
    the largest. contacts: between grains. kinetic [J]: of translation and rotation. time_step [s].
    Raises DustError where the bodies miss each other.
    """
    scene, (sample, rest, way) = _start(scene)
    sample = replace(sample, velocities=rest + speed * way)
    sim = build(scene, sample)
    motion = _Motion(sim, sample)
    end = (time + _flight(scene, sim, sample, way) / speed) / units.TIME
    steps = max(0, ceil(end / sim.dt - 1e-9))
    for part in np.diff(np.linspace(0, steps, min(LOOKS, max(steps, 1)) + 1).astype(int)):
        sim.advance(int(part))
        motion.look()
    return motion.outcome() | {"time_step": sim.dt * units.TIME}


@lru_cache(1)  # the same for all speeds
def _start(text):
    scene = from_yaml(text)
    return scene, moving_bodies(scene)


def _flight(scene, sim, sample, way):
    """Distance of the relative flight until the first contact [m].

    way (N, 3): velocities per unit of speed.
    """
    x, radius = sample.positions, scene.material.radius
    if sample.radii is not None:
        radius = sample.radii[:, None]
    if sim.box is None:
        split, parts, distance = _first_body(sample), None, 2.0 * radius
        if sample.radii is not None:
            parts = sample.radii[:split], sample.radii[split:]
            distance = sum(part.max() for part in parts)
        one, other = x[None, :split, FLIGHT], x[None, split:, FLIGHT]
        flight = float(first_touch(one, other, distance, parts)[0])
    else:
        box = sim.box
        ahead = way.mean(axis=0) @ box.normal.T
        above = (x @ box.normal.T - radius).min(axis=0) - box.offset * units.LENGTH
        there = (box.present == 1) & (ahead < 0.0)
        flight = float(np.min(above[there] / -ahead[there], initial=inf))
    if flight == inf:
        raise DustError("The bodies miss each other; try a smaller sample.impact_parameter.")
    return max(flight, 0.0)


def _first_body(sample):
    """Grains of the first body, which come first; None of a sample that is one body."""
    return 1 if sample.info.get("kind") == "pair" else sample.info.get("target_grains")


class _Motion:
    """A collision under way: what is seen of it."""

    def __init__(self, sim, sample):
        self.sim, self.split = sim, _first_body(sample)
        if self.split is None and sim.box is None:
            raise DustError(
                "A collision needs two bodies; allowed: sample.kind pair or collision, or a "
                "boundary with a wall."
            )
        own, one = sim.polydisperse, np.ones(sim.grains)
        # [pg], [pg um^2], in the sample's order
        self.mass = sim.mass * one if own is None else own.mass
        self.inertia = sim.inertia * one if own is None else own.inertia
        self.nearest = inf
        self.look()
        self.start = self.relative_velocity()

    def look(self):
        """Keep the normal at the moment when the bodies have been closest."""
        line = self.line(self.sim.grain_state()[0])
        distance = np.linalg.norm(line)
        if distance < self.nearest:
            self.nearest, self.normal = distance, line / distance

    def line(self, x):
        """From the second body, or the nearest wall, to the first (3,) [um]."""
        if self.split is not None:
            return self.between(x)
        box = self.sim.box
        distance = x @ box.normal.T - box.offsets(self.sim.time)
        distance = np.where(box.present == 1, distance, np.inf).min(axis=0)
        return distance.min() * box.normal[int(np.argmin(distance))]

    def relative_velocity(self):
        """Velocity of the first body against the second or the wall (3,) [um/us]."""
        v = self.sim.grain_state()[1]
        if self.split is not None:
            return self.between(v)
        box = self.sim.box
        wall = int(np.argmax(box.normal @ self.normal))
        return np.average(v, axis=0, weights=self.mass) - box.speed[wall] * box.normal[wall]

    def between(self, values):
        """Mean of values (N, 3) over the first body less that over the second, by mass."""
        one, other = (
            np.average(values[body], axis=0, weights=self.mass[body])
            for body in (slice(self.split), slice(self.split, None))
        )
        return one - other

    def outcome(self):
        """The present outcome, see `run`."""
        _, v, w = self.sim.grain_state()
        pairs = self.sim.contact_state()
        pairs = np.column_stack([pairs["grain_i"], pairs["grain_j"]])
        count, label, _ = connected(pairs, self.sim.grains)
        bound = self.bound(label)
        before, after = -self.start @ self.normal, self.relative_velocity() @ self.normal
        kinetic = np.sum(self.mass * np.sum(v**2, axis=1))
        kinetic += np.sum(self.inertia * np.sum(w**2, axis=1))
        return {
            "bound": bound,
            "restitution": 0.0 if bound else float(after / before) if before > 0.0 else nan,
            "fragments": count,
            "largest": int(np.bincount(label).max()),
            "contacts": len(pairs),
            "kinetic": 0.5 * float(kinetic) * units.ENERGY,
        }

    def bound(self, label):
        if self.split is None:
            return len(self.sim.wall_contact_state()["grain"]) > 0
        size, grains = self.split, len(label)
        one, other = (np.bincount(part, minlength=grains) for part in (label[:size], label[size:]))
        return bool(np.any((2 * one > size) & (2 * other > grains - size)))
