"""Task of a worker process of a study of sticking: one collision and its outcome."""

from dataclasses import replace
from functools import lru_cache
from math import ceil, inf, nan

import numpy as np

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.samples.ballistic import first_touch
from dusttaichi.samples.collision import FLIGHT
from dusttaichi.scene import from_yaml
from dusttaichi.studies.bodies import TwoBodies

LOOKS = 200  # after the first contact


def run(parent, *, scene, speed, time, looks=LOOKS):
    """Outcome of the collision of a scene (text of its YAML) at a speed [m/s], as plain numbers.

    It ends at `time` [s] after the first contact. looks: moments at which the line between the
    bodies is examined, fewer where no restitution is wanted.

    bound: one fragment has more than half of the mass of both bodies; of a body at a wall: one of
    its grains touches it. restitution: speed of separation of the centres of mass at the end over
    that of approach, along the line between them where they were closest, or the normal of the
    wall; 0 where the bodies are bound, not a number where they pass each other, or through each
    other as they break up. fragments: sets of grains
    connected by contacts; largest: grains of the largest. contacts: between grains. kinetic [J]: of
    translation and rotation. time_step [s].
    Raises DustError where the bodies miss each other.
    """
    scene, (sample, rest, way) = _start(scene)
    both = TwoBodies(scene, replace(sample, velocities=rest + speed * way))
    sim, dt = both.sim, both.dt
    flight = _flight(both, way) / speed
    sim.advance(int(flight / dt))  # until then they only come closer
    both.look()
    steps = ceil((flight + time) / dt - 1e-9) - sim.step
    for part in np.diff(np.linspace(0, steps, min(looks, max(steps, 1)) + 1).astype(int)):
        sim.advance(int(part))
        both.look()
    bound, grains = both.is_one(), np.bincount(both.fragment_of())
    restitution = 0.0 if bound else both.restitution()
    if restitution is None or restitution < 0.0:
        restitution = nan
    return {
        "bound": bound,
        "restitution": restitution,
        "fragments": len(grains),
        "largest": int(grains.max()),
        "contacts": len(sim.contacts.measure_pairs()["grain_i"]),
        "kinetic": float(sim.measure().kinetic * sim.units("J")),
        "time_step": dt,
    }


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


@lru_cache(1)  # the same for all speeds
def _start(text):
    scene = from_yaml(text)
    return scene, moving_bodies(scene)


def _flight(both, way):
    """Distance of the relative flight until the first contact [m].

    way (N, 3): velocities per unit of speed.
    """
    x, radii, box = both.sample.positions, both.radii, both.sim.domain.box
    if box is None:
        one, other = both.bodies
        radii = radii[one], radii[other]
        distance = sum(own.max() for own in radii)
        bodies = (x[None, body][..., FLIGHT] for body in both.bodies)
        flight = float(first_touch(*bodies, distance, radii)[0])
    else:
        ahead = way.mean(axis=0) @ box.normal.T
        above = (x @ box.normal.T - radii[:, None]).min(axis=0) - box.offset * both.sim.units("m")
        there = (box.present == 1) & (ahead < 0.0)
        flight = float(np.min(above[there] / -ahead[there], initial=inf))
    if flight == inf:
        raise DustError("The bodies miss each other; try a smaller sample.impact_parameter.")
    return max(flight, 0.0)
