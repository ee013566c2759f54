"""The collision of a scene, at any speed: what is known before it."""

from math import inf, sqrt

import numpy as np

from dusttaichi import samples
from dusttaichi.domain.walls import glued
from dusttaichi.errors import DustError
from dusttaichi.grains.grain_contacts import grain_properties
from dusttaichi.grains.time_step import chosen_step
from dusttaichi.physics.contact import constants
from dusttaichi.samples.materials import Materials
from dusttaichi.scene import Scene, quantities
from dusttaichi.studies.requests import Request, key_of
from dusttaichi.studies.settings import data_of, portable
from dusttaichi.studies.store import core_of

JUMPS = 0.77224  # energy lost on forming and breaking, over F_c delta0: 0.69886 + 0.07338
# A contact is found up to v dt too late, which raises the sticking speed by up to
# 0.58 v dt/delta0, a quarter of the tolerance.
LATEST = 0.4
TASK = "dusttaichi.studies.sticking.task:run"
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

    The time step of single grains is shortened for the tolerance. file: of the rows of its
    requests, see Request. start: remark on the initial positions, or "".
    """

    def __init__(self, scene, tolerance, file=None):
        if not 0.0 < tolerance < 1.0:
            raise DustError(f"--tolerance {tolerance:g}; allowed: a number between 0 and 1.")
        self._file, (scene, self.start) = file, _apart(scene)
        self.sample, _, _ = moving_bodies(scene)
        self.closed = closed_form(scene, self.sample)
        own = chosen_step(scene, self.sample, grain_properties(scene, self.sample)).dt
        self.time = _stop_time(scene, own)
        if len(self.sample) <= 2:
            overlap = meeting(scene, self.sample).delta0
            own = min(own, LATEST * tolerance * overlap / self.closed)
            scene = scene.with_value("numerics.time_step", f"{own:.17g} s")
        data = data_of(scene)
        if data["numerics"]["threads"] == "auto":  # many small scenes: a thread each
            data["numerics"]["threads"] = 1
        self._inputs, self.scene = tuple(portable(data)), scene
        self._small = Scene.from_dict(data, title=f"the scene of {scene.name}")
        self._text = self._small.to_yaml()
        self._core = core_of(self._text) | {"name": ""}

    @property
    def is_closed(self):
        """True where the closed form is valid."""
        head_on = not self.sample.info.get("impact_parameter")
        undamped = self.scene.interaction.damping.model == "none"
        return len(self.sample) <= 2 and undamped and head_on and not self.sample.spins.any()

    def request(self, speed):
        """The Request of the outcome at a relative speed of the bodies [m/s]."""
        numerics = self._small.numerics
        return Request(
            label=key_of(self._core, float(speed), self.time),
            task=TASK,
            arguments={"scene": self._text, "speed": float(speed), "time": self.time},
            file=self._file,
            inputs=self._inputs,
            cores=numerics.threads if numerics.backend == "cpu" else None,
        )


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


def moving_bodies(scene):
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
