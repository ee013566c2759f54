"""Speed of a scene on this machine, for the run time that `dust check` states."""

import time as real_time
from collections.abc import Sequence
from typing import Any

from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.scene import Scene

SECONDS = 1.0  # of steps of a measurement
SPEED_FACTOR = 1.3  # factor of uncertainty of a measured speed
ESTIMATE_FACTOR = 3.0  # the same of an order of magnitude
LEAST_STEP_TIME = 1e-6  # s for a step of few particles on a CPU
FIRST_STEPS = 20  # steps, the first of a measurement


def estimate_step_terms(scene: Scene) -> tuple[float, float]:
    """Seconds of a step of few particles, and of a step per particle: an order of magnitude."""
    scene_method = method.find_method(scene)
    on_cpu = getattr(scene.numerics, "backend", "cpu") == "cpu"
    return (LEAST_STEP_TIME, scene_method.seconds) if on_cpu else scene_method.device_seconds


def estimate_step_time(scene: Scene, size: int) -> tuple[float, float, float]:
    """(least, likely, most) seconds of a step of `size` particles: an order of magnitude."""
    few_particles, per_particle = estimate_step_terms(scene)
    seconds = few_particles + per_particle * size
    return seconds / ESTIMATE_FACTOR, seconds, seconds * ESTIMATE_FACTOR


def measure_step_time(
    scene: Scene, plan: Sequence[tuple[str, float, str]]
) -> tuple[float, float, float]:
    """(least, likely, most) seconds of a step, from the first steps of a scene, for a second.

    plan: of its Preview. Compiles kernels that are not in the cache. Raises DustError where the
    scene ends after one step.
    """
    scene_method = method.find_method(scene)
    sim = scene_method.build(scene, scene_method.make_sample(scene))
    sim.advance(1)
    last_step: Any = plan[0][1]  # a whole number, or infinite
    steps, duration, computed_steps = FIRST_STEPS, 0.0, 0
    while duration < SECONDS and sim.step < last_step:
        steps = min(steps, last_step - sim.step)
        began, first = real_time.perf_counter(), sim.step
        sim.advance(steps)
        duration, computed_steps = real_time.perf_counter() - began, sim.step - first
        steps = int(steps * min(10.0, max(2.0, 1.2 * SECONDS / duration)))
    if not computed_steps:
        raise DustError(
            "--time: the scene ends after one step, too early for a measurement of its speed."
        )
    seconds = duration / computed_steps
    return seconds / SPEED_FACTOR, seconds, seconds * SPEED_FACTOR
