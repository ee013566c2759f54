"""Task of a worker process of a study of sticking: one collision and its outcome."""

from dataclasses import replace
from functools import lru_cache
from math import ceil, inf, nan
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.grains.grain_scene import GrainsScene
from dusttaichi.samples import Sample
from dusttaichi.samples.ballistic import first_touch
from dusttaichi.samples.collision import FLIGHT
from dusttaichi.scene import from_yaml
from dusttaichi.studies.colliding_bodies import TwoBodies
from dusttaichi.studies.worker_main import Parent

NORMAL_UPDATES = 200  # after the first contact
Velocities = NDArray[np.float64]  # (N, 3) [m/s]


def run(
    parent: Parent,
    *,
    scene: str,
    speed: float,
    time: float,
    normal_updates: int = NORMAL_UPDATES,
) -> dict[str, float]:
    """Outcome of the collision of a scene (text of its YAML) at a speed [m/s], as plain numbers.

    It ends at `time` [s] after the first contact. normal_updates: number of updates of the line
    between the bodies, fewer where no restitution is needed.

    bound: one fragment has more than half of the mass of both bodies; of a body at a wall: one of
    its grains touches it. restitution: speed of separation of the centres of mass at the end over
    that of approach, along the line between them where they were closest, or the normal of the
    wall; 0 where the bodies are bound, not a number where they pass each other, or through each
    other as they break up. fragments: sets of grains
    connected by contacts; largest: grains of the largest. contacts: between grains. kinetic [J]: of
    translation and rotation. time_step [s].
    Raises DustError where the bodies miss each other.
    """
    loaded_scene, (sample, inner_velocities, directions) = _load_collision(scene)
    bodies = TwoBodies(
        loaded_scene, replace(sample, velocities=inner_velocities + speed * directions)
    )
    sim, dt = bodies.sim, bodies.dt
    flight_time = _measure_flight(bodies, directions) / speed
    sim.advance(int(flight_time / dt))  # until then they only come closer
    bodies.update_normal()
    steps = ceil((flight_time + time) / dt - 1e-9) - sim.step
    updates = min(normal_updates, max(steps, 1))
    for segment in np.diff(np.linspace(0, steps, updates + 1).astype(int)):
        sim.advance(int(segment))
        bodies.update_normal()
    bound, grains = bodies.are_bound(), np.bincount(bodies.label_grains())
    restitution = 0.0 if bound else bodies.measure_restitution()
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


def make_moving_bodies(scene: GrainsScene) -> tuple[Sample, Velocities, Velocities]:
    """(sample, velocities of the grains within the bodies, and those per unit of speed)."""
    block: Any = scene.sample
    if block.kind in ("pair", "collision"):
        resting, moving = (
            samples.make(scene.with_value("sample.speed", speed)) for speed in ("0 m/s", "1 m/s")
        )
        return moving, resting.velocities, moving.velocities - resting.velocities
    if block.kind != "explicit" or not scene.boundary.walls:
        raise DustError(
            f"sample.kind = {block.kind}: a sticking speed needs two bodies; allowed: pair, "
            "collision, or explicit grains that move towards a wall."
        )
    sample = samples.make(scene)
    mean = sample.velocities.mean(axis=0)
    speed = float(np.linalg.norm(mean))
    if speed == 0.0:
        raise DustError(
            "sample.velocities: the grains are at rest; give them a velocity towards the wall."
        )
    directions = np.zeros_like(sample.velocities) + mean / speed
    return sample, sample.velocities - mean, directions


@lru_cache(1)  # the same for all speeds
def _load_collision(text: str) -> tuple[GrainsScene, tuple[Sample, Velocities, Velocities]]:
    scene = cast(GrainsScene, from_yaml(text))
    return scene, make_moving_bodies(scene)


def _measure_flight(bodies: TwoBodies, directions: Velocities) -> float:
    """Distance of the relative flight until the first contact [m].

    directions (N, 3): velocities per unit of speed.
    """
    x, radii, box = bodies.sample.positions, bodies.radii, bodies.sim.domain.box
    if box is None:
        radii_of_bodies = tuple(radii[body] for body in bodies.bodies)
        distance = sum(body_radii.max() for body_radii in radii_of_bodies)
        first, second = (x[None, body][..., FLIGHT] for body in bodies.bodies)
        flight = float(first_touch(first, second, distance, radii_of_bodies)[0])
    else:
        ahead = directions.mean(axis=0) @ box.normal.T
        above = (x @ box.normal.T - radii[:, None]).min(axis=0)
        above -= box.offset * bodies.sim.units("m")
        approached = (box.present == 1) & (ahead < 0.0)
        flight = float(np.min(above[approached] / -ahead[approached], initial=inf))
    if flight == inf:
        raise DustError("The bodies miss each other; try a smaller sample.impact_parameter.")
    return max(flight, 0.0)
