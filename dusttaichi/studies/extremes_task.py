"""Trial of a cell: build it, compute its steps under the guards of a run, check all numbers."""

import time as real_time
import traceback
import warnings
from dataclasses import asdict, replace
from math import inf, nan, pi

import numpy as np

from dusttaichi import method
from dusttaichi import samples as generators
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.grains import network
from dusttaichi.grains.build import build
from dusttaichi.grains.measure import grain_state
from dusttaichi.grains.moving_grains import MovingGrains
from dusttaichi.grains.scene import GrainsScene
from dusttaichi.grains.time_step import TimeStep
from dusttaichi.method import Start
from dusttaichi.running import ledger
from dusttaichi.scene import Scene
from dusttaichi.studies import extremes_samples
from dusttaichi.studies.extremes_cells import Cell, CellResult

RECORDS = 25  # records of a run, besides the checks of its guards


def attempt_cell(parent, *, cell):
    """Task of a worker process: the CellResult of a Cell, both as dicts."""
    warnings.simplefilter("ignore")
    return asdict(attempt(Cell(**cell)))


def attempt(cell):
    """The CellResult of a Cell. Raises nothing."""
    began = real_time.perf_counter()
    try:
        result = _attempt(cell)
    except GuardStop as stop:
        result = CellResult("stopped", str(stop))
    except DustError as error:
        result = CellResult("refused", str(error))
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} ({place.filename.split('/')[-1]}:{place.lineno})"
        result = CellResult("WRONG", text)
    return replace(result, seconds=real_time.perf_counter() - began)


def _attempt(cell):
    scene = Scene.from_dict(cell.scene)
    if not isinstance(scene, GrainsScene):
        sim = method.find_method(scene).build(scene, method.make_sample(scene))
        result = watched(sim, scene, cell.steps, lambda: sim.snapshot().values())
        return replace(result, dt=sim.dt * sim.units("s"))
    if cell.limit:  # its perturbation is below the resolution of single precision
        scene = scene.with_value("numerics.precision", "f64")
    sample = (
        generators.make(scene) if cell.sample is None else extremes_samples.make(scene, cell.sample)
    )
    step = None
    if cell.fraction is not None:
        # a first build, with any step, for its contacts
        sim = build(scene, sample, step=TimeStep(1e-15, inf, inf))
        period, stable = network.stable_step(sim)
        step = TimeStep(cell.fraction * pi * stable, period, stable)
    sim = build(scene, sample, step=step)
    estimated = measured = nan
    if cell.limit:
        estimated = network.stable_step(sim)[1]
        measured = measured_limit(sim, estimated)
    moving = MovingGrains(scene, sample, sim)
    result = watched(moving, scene, cell.steps, lambda: grain_state(sim))
    return replace(result, dt=sim.dt * sim.units("s"), estimated=estimated, measured=measured)


def watched(sim, scene, steps, state):
    """CellResult of `steps` steps of a method.Simulation with the guards and records of a run.

    state(): current arrays, whose numbers must be finite.
    """
    tolerance, start, worst = (
        scene.numerics.ledger_tolerance,
        Start.from_measurement(sim.measure()),
        0.0,
    )
    records = set(np.linspace(0, steps, RECORDS + 1).astype(int).tolist())
    while True:
        m = sim.measure()
        try:
            ledger.check(sim, m, start, tolerance)
        except GuardStop as stop:
            return CellResult("stopped", str(stop), worst, sim.step)
        residual, through = ledger.turnover(m, start)
        worst, start = (
            max(worst, abs(residual) / through if through > 0.0 else 0.0),
            start.include_record(m),
        )
        entry = sim.series(m, None)
        bad = [
            key
            for key, value in entry.items()
            if key not in MAY_BE_OPEN and not np.all(np.isfinite(value))
        ]
        if not all(np.isfinite(values).all() for values in state()):
            bad.append("state")
        if bad:
            return CellResult("WRONG", f"not a number in {', '.join(bad)}", worst, sim.step)
        if sim.step >= steps:
            return CellResult("stable", "", worst, sim.step)
        ahead = [s for s in records if s > sim.step]
        check = ledger.next_check(sim.step, 0, sim.size)
        try:
            sim.advance(min(min(ahead), check) - sim.step)
        except GuardStop as stop:
            return CellResult("stopped", str(stop), worst, sim.step)


MAY_BE_OPEN = ("pressure", "height", "filling_factor")  # without all six walls


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
    low, high = 0.3 * estimate / sim.units("s"), 1.7 * estimate / sim.units("s")

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
    return 0.5 * (low + high) * sim.units("s")


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
