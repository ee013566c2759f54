"""Measurement of the largest stable step by the divergence of two neighbouring trajectories."""

import numpy as np

from dusttaichi import units
from dusttaichi.errors import GuardStop

STEPS, POINTS = 400, 8
GROWTH = 100.0  # of the kinetic energy of the difference; below the limit it stays of order one
NUDGE = 1e-7  # perturbation over the equilibrium overlap
TRIES = 8  # bisections: to half a per cent of the estimate


def measured_limit(sim, estimate):
    """Largest step [s] at which a perturbation of all grains does not grow, by bisection.

    At a step of 1 + e times the limit the energy of the fastest mode grows in each step by
    exp(4 sqrt(2 e)) without damping and by about exp(2 e) with dominant damping, so that 400 steps
    resolve 1 %. estimate [s]: the search is from 0.3 to 1.7 of it; nan without a limit in between.
    """
    arrays, numbers, dt = sim.arrays(), sim.numbers(), sim.dt
    low, high = 0.3 * estimate / units.TIME, 1.7 * estimate / units.TIME

    def grows(step):
        sim.restore(arrays, numbers)
        sim.dt = step
        return _growth(sim, arrays, numbers) > GROWTH

    try:
        if grows(low) or not grows(high):
            return float("nan")
        for _ in range(TRIES):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if grows(middle) else (middle, high)
    finally:
        sim.dt = dt
        sim.restore(arrays, numbers)
    return 0.5 * (low + high) * units.TIME


def _growth(sim, arrays, numbers):
    """Largest kinetic energy of the difference of two trajectories over that of the perturbation.

    Within STEPS steps, not at their end: after contacts break, the grains may come to rest.
    Infinite where a guard of the search ends the trajectory. Both begin at the given state.
    """
    rng = np.random.default_rng(5)
    n = sim.grains
    # the same energy in every grain, so that none dominates
    speed = NUDGE * sim.pair.delta0 / sim.dt * np.sqrt(np.min(sim.mass))
    nudge = {
        "v": speed / np.sqrt(sim.mass) * rng.normal(size=(n, 3)),
        "w": speed / np.sqrt(sim.inertia) * rng.normal(size=(n, 3)),
    }
    trajectories = []
    for way in (0.0, 1.0):
        sim.restore(arrays, numbers)
        for name, change in nudge.items():
            values = arrays[name].copy()
            values[:n] += way * change
            sim.fields[name].from_numpy(values)
        seen = []
        for _ in range(POINTS):
            try:
                sim.advance(STEPS // POINTS)
            except GuardStop:
                return np.inf
            seen.append([sim.fields[name].to_numpy()[:n].astype(float) for name in nudge])
        trajectories.append(seen)

    def energy(v, w):
        return float(np.sum(sim.mass * v**2) + np.sum(sim.inertia * w**2))

    found = max(
        energy(*(b - a for a, b in zip(one, two, strict=True)))
        for one, two in zip(*trajectories, strict=True)
    )
    return found / energy(*nudge.values()) if np.isfinite(found) else np.inf
