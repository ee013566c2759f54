"""Speed of a scene on this machine, for the run time that `dust check` states."""

import time as real_time

from dusttaichi import method
from dusttaichi.errors import DustError

SECONDS = 1.0  # of steps of a measurement
OFF = 1.3  # factor of uncertainty of a measured speed
ORDER = 3.0  # the same of an order of magnitude
LEAST = 1e-6  # s for a step of few particles on a CPU
WARM = 20  # steps, the first of a measurement


def estimate_step_time(scene, size):
    """(least, likely, most) seconds of a step of `size` particles: an order of magnitude."""
    how = method.find_method(scene)
    on_cpu = getattr(scene.numerics, "backend", "cpu") == "cpu"
    least, per_particle = (LEAST, how.seconds) if on_cpu else how.device_seconds
    seconds = least + per_particle * size
    return seconds / ORDER, seconds, seconds * ORDER


def measure_step_time(scene, plan):
    """(least, likely, most) seconds of a step, from the first steps of a scene, for a second.

    plan: of its Preview. Compiles kernels that are not in the cache. Raises DustError where the
    scene ends after one step.
    """
    how = method.find_method(scene)
    sim = how.build(scene, how.make_sample(scene))
    sim.advance(1)
    steps, took, made = WARM, 0.0, 0
    while took < SECONDS and sim.step < plan[0][1]:
        steps = min(steps, plan[0][1] - sim.step)
        began, first = real_time.perf_counter(), sim.step
        sim.advance(steps)
        took, made = real_time.perf_counter() - began, sim.step - first
        steps = int(steps * min(10.0, max(2.0, 1.2 * SECONDS / took)))
    if not made:
        raise DustError(
            "--time: the scene ends after one step, too early for a measurement of its speed."
        )
    return took / made / OFF, took / made, took / made * OFF
