"""The collision of a scene at many speeds in one batch."""

from dataclasses import replace
from math import inf, sqrt

import numpy as np

from dusttaichi import samples, units
from dusttaichi.domain.walls import glued
from dusttaichi.errors import DustError
from dusttaichi.grains.batch import build_batch
from dusttaichi.grains.grain_contacts import grain_properties
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.physics.contact import constants
from dusttaichi.samples.ballistic import first_touch
from dusttaichi.samples.collision import FLIGHT
from dusttaichi.samples.materials import Materials
from dusttaichi.scene import quantities

JUMPS = 0.77224  # energy lost on forming and breaking, over F_c delta0: 0.69886 + 0.07338
# A contact is found up to v dt too late, which raises the sticking speed by up to
# 0.58 v dt/delta0, a quarter of the tolerance.
LATEST = 0.4
GAP = 2e-3  # initial distance over the radius, where the scene sets none


def closed_form(scene, sample=None):
    """Sticking speed of two single grains, or of one and a wall, head-on without damping [m/s].

    sqrt(2 x 0.77224 F_c delta0/m) with the reduced mass: the loss of the potential of S12 when a
    contact forms and breaks. For samples of more grains, of the first and the last.
    """
    contact = meeting(scene, samples.make(scene) if sample is None else sample)
    return sqrt(2.0 * JUMPS * contact.F_c * contact.delta0 / contact.mass)


def meeting(scene, sample):
    """ContactConstants of the first grain and the last, or of the first and a wall."""
    kinds, interaction = scene.all_materials, scene.interaction
    number = np.zeros(len(sample), int) if sample.materials is None else sample.materials
    ends = [
        (kinds[number[n]], kinds[number[n]].radius if sample.radii is None else sample.radii[n])
        for n in (0, -1)
    ]
    (a, r1), (b, r2) = ends
    if scene.boundary.walls:
        return glued(constants.wall_constants(a, interaction, r1, kinds[0]), scene.boundary)
    return constants.mixed_constants(a, r1, b, r2, interaction)


class Collision:
    """The collision of a scene at any speed.

    The time step of single grains is shortened for the tolerance. start: remark on the initial
    positions, or "".
    """

    def __init__(self, scene, tolerance):
        if not 0.0 < tolerance < 1.0:
            raise DustError(f"--tolerance {tolerance:g}; allowed: a number between 0 and 1.")
        scene, self.start = _apart(scene)
        self.sample, self._rest, self._way = _motion(scene)
        self.closed = closed_form(scene, self.sample)
        own = chosen_step(scene, self.sample, grain_properties(scene, self.sample)).dt
        self.time = _stop_time(scene, own)
        if len(self.sample) <= 2:
            overlap = meeting(scene, self.sample).delta0
            own = min(own, LATEST * tolerance * overlap / self.closed)
            scene = scene.with_value("numerics.time_step", f"{own:.17g} s")
        self.scene, self.time_step = scene, own

    @property
    def is_closed(self):
        """True where the closed form is valid."""
        head_on = not self.sample.info.get("impact_parameter")
        undamped = self.scene.interaction.damping.model == "none"
        return len(self.sample) <= 2 and undamped and head_on and not self.sample.spins.any()

    def at(self, speed):
        """The sample with a relative speed of its bodies [m/s]."""
        return replace(self.sample, velocities=self._rest + speed * self._way)

    def outcomes(self, speeds, others=None):
        """The batch.Outcome at each of the speeds [m/s], `time` after the contact of the slowest.

        others: collisions that all run at these speeds, in this scene and with its time step; by
        default this one.
        """
        members = others or [self]
        batch = build_batch(self.scene, [c.at(speed) for c in members for speed in speeds])
        self.time_step = batch.sim.dt * units.TIME  # that of the fastest
        flight = max(c.flight(batch, k * len(speeds)) for k, c in enumerate(members))
        batch.run_until(max(c.time for c in members) + flight / min(speeds))
        return batch.outcomes()

    def flight(self, batch, number=0):
        """Distance of the relative flight until the first contact [m]; number: of its scene."""
        x, radius = self.sample.positions, self.scene.material.radius
        if self.sample.radii is not None:
            radius = float(self.sample.radii.min())  # on the safe side for larger ones
        box = batch.sim.box
        if box is None:
            split = batch.target_grains[number]
            one, other = x[None, :split, FLIGHT], x[None, split:, FLIGHT]
            flight = float(first_touch(one, other, 2.0 * radius)[0])
        else:
            way = self._way.mean(axis=0) @ box.normal.T
            above = (x @ box.normal.T).min(axis=0) - radius - box.offset * units.LENGTH
            ahead = (box.present == 1) & (way < 0.0)
            flight = float(np.min(above[ahead] / -way[ahead], initial=inf))
        if flight == inf:
            raise DustError("The bodies miss each other; try a smaller sample.impact_parameter.")
        return max(flight, 0.0)


def _apart(scene):
    """(scene, with an initial distance of a pair that has none; remark on it)."""
    pair = scene.sample
    if pair.kind != "pair":
        return scene, ""
    if pair.gap is pair.distance is None:
        gap = quantities.format(GAP * scene.material.radius, "length", digits=3)
        text = f"{gap} apart (set sample.gap or distance for another start)"
        return scene.with_value("sample.gap", gap), text
    sample = samples.make(scene)
    radii = Materials(scene).radii_of(sample) * np.ones(2)
    if np.linalg.norm(np.subtract(*sample.positions)) < radii.sum():
        return scene, "in contact: the speed is that of an escape, not of a collision"
    return scene, ""


def _motion(scene):
    """(sample, velocities of the grains within the bodies, and those per unit of speed)."""
    if scene.sample.kind in ("pair", "collision"):
        resting, moving = (
            samples.make(scene.with_value("sample.speed", speed)) for speed in ("0 m/s", "1 m/s")
        )
        return moving, resting.velocities, moving.velocities - resting.velocities
    if scene.sample.kind != "explicit" or not scene.boundary.walls:
        raise DustError(
            f"sample.kind = {scene.sample.kind}: a sticking speed needs two bodies; allowed: pair, "
            "collision, or explicit grains that move towards a wall."
        )
    sample = samples.make(scene)
    mean = sample.velocities.mean(axis=0)
    speed = float(np.linalg.norm(mean))
    if speed == 0.0:
        raise DustError(
            "sample.velocities: the grains are at rest; give them a velocity towards the wall."
        )
    way = np.zeros_like(sample.velocities) + mean / speed
    return sample, sample.velocities - mean, way


def _stop_time(scene, dt):
    """Simulated time after the first contact [s]."""
    stop = scene.stop
    if stop is None or (stop.time is None and stop.steps is None):
        raise DustError("stop: must have a time or a number of steps, such as {time: 1 us}")
    return min(stop.time or inf, (stop.steps or inf) * dt)
