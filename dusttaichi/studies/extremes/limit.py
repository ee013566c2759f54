"""The largest stable step, measured: do two neighbouring trajectories part?"""

import numpy as np

from dusttaichi import units
from dusttaichi.errors import GuardStop

STEPS, POINTS = 400, 8
GROWTH = 100.0  # of the kinetic energy of the difference; below the limit it stays of order one
NUDGE = 1e-7  # of the overlap at rest
TRIES = 8  # bisections: to half a per cent of the estimate


def measured_limit(sim, estimate):
    """Largest step [s] at which a nudge of all grains does not grow, by bisection; estimate [s].

    Beyond the limit by the part e of it the energy of the fastest mode grows by exp(4 sqrt(2 e)) a
    step without damping and by some exp(2 e) where damping rules, so 400 steps tell 1 % from 0.
    The estimate only says where the search begins: from 0.3 to 1.7 of it; not a number where
    the limit is not between.
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
    """Largest kinetic energy of the difference of two trajectories, over that of the nudge.

    Within STEPS steps, not at their end: what has grown until contacts break may come to rest. It
    is without bound where a guard of the search stops what has grown.

    The steps begin at the start of the simulation, with the velocities of its own step there.
    """
    rng = np.random.default_rng(5)
    n = sim.grains
    # of the same energy in every grain, so that none drowns the others
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
