"""Trial of a cell: build it, compute its steps under the guards of a run, check all numbers."""

import time as real_time
import warnings
from collections.abc import Callable
from dataclasses import asdict
from math import inf, nan, pi
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from dusttaichi import method, samples
from dusttaichi.errors import GuardStop
from dusttaichi.grains.build import build
from dusttaichi.grains.contact_network import stable_step
from dusttaichi.grains.grain_engine import GrainEngine
from dusttaichi.grains.grain_scene import GrainsScene
from dusttaichi.grains.time_step import TimeStep
from dusttaichi.running import ledger
from dusttaichi.scene import Scene
from dusttaichi.studies import extremes_samples
from dusttaichi.studies.extremes_cells import Cell, CellResult
from dusttaichi.studies.verdicts import judge, name_infinite
from dusttaichi.studies.worker_main import Parent

RECORDS = 25  # records of a run, besides the checks of its guards
ReadState = Callable[[], dict[str, NDArray[np.float64]]]
MAY_BE_OPEN = ("pressure", "height", "filling_factor")  # without all six walls


def attempt_cell(parent: Parent, *, cell: dict[str, Any]) -> dict[str, Any]:
    """Task of a worker process: the CellResult of a Cell, both as dicts."""
    warnings.simplefilter("ignore")
    return asdict(attempt(Cell(**cell)))


def attempt(cell: Cell) -> CellResult:
    """The CellResult of a Cell. Raises nothing."""
    began, numbers = real_time.perf_counter(), dict[str, Any]()
    verdict = judge(lambda: _compute(cell, numbers))
    seconds = real_time.perf_counter() - began
    return CellResult(verdict.name, verdict.reason, seconds=seconds, **numbers)


def _compute(cell: Cell, numbers: dict[str, Any]) -> str:
    """Compute a cell; returns what is wrong, see `judge`. numbers: those of its CellResult."""
    scene = Scene.from_dict(cell.scene)
    sim: Any
    if isinstance(scene, GrainsScene):
        sim, read_state = _build_grains(cell, scene, numbers)
    else:
        sim = method.find_method(scene).build(scene, method.make_sample(scene))
        read_state = sim.snapshot
    numbers["dt"] = sim.dt * sim.units("s")
    return _advance(sim, scene, cell.steps, read_state, numbers)


def _build_grains(
    cell: Cell, scene: GrainsScene, numbers: dict[str, Any]
) -> tuple[GrainEngine, ReadState]:
    """(GrainEngine of a cell, function that reads the state of its grains by name)."""
    if cell.limit:  # its perturbation is below the resolution of single precision
        scene = cast(GrainsScene, scene.with_value("numerics.precision", "f64"))
    if cell.sample is None:
        sample = samples.make(scene)
    else:
        sample = extremes_samples.make(scene, cell.sample)
    step = None
    if cell.fraction is not None:
        # a first build, with any step, for its contacts
        first = build(scene, sample, step=TimeStep(1e-15, inf, inf))
        period, stable = stable_step(first.contacts, first.contact_table, first.motion)
        step = TimeStep(cell.fraction * pi * stable, period, stable)
    sim = build(scene, sample, step=step)
    if cell.limit:
        _, numbers["estimated"] = stable_step(sim.contacts, sim.contact_table, sim.motion)
        numbers["measured"] = measure_stable_step(sim, numbers["estimated"])
    names = ("position", "velocity", "spin")
    return sim, lambda: dict(zip(names, sim.motion.measure(), strict=True))


def _advance(
    sim: Any, scene: Scene, steps: int, read_state: ReadState, numbers: dict[str, Any]
) -> str:
    """Advance a method.Engine with the guards and records of a run; returns what is wrong.

    read_state(): name -> current array, whose numbers must be finite. Raises GuardStop.
    """
    start = method.Start.from_measurement(sim.measure())
    records = np.linspace(0, steps, RECORDS + 1).astype(int)
    numbers |= {"residual": 0.0, "steps": 0}
    while True:
        m = sim.measure()
        ledger.check(sim, m, start, scene.numerics.ledger_tolerance)
        residual, through = ledger.turnover(m, start)
        if through > 0.0:
            numbers["residual"] = max(numbers["residual"], abs(residual) / through)
        start = start.include_record(m)
        series = {k: v for k, v in sim.series(m, None).items() if k not in MAY_BE_OPEN}
        problem = name_infinite(series | read_state())
        if problem or sim.step >= steps:
            return problem
        ahead = [*records[records > sim.step][:1], ledger.next_check(sim.step, 0, sim.size)]
        try:
            sim.advance(int(min(ahead)) - sim.step)
        finally:
            numbers["steps"] = sim.step


STEPS, POINTS = 400, 8
GROWTH = 100.0  # of the kinetic energy of the difference; below the limit it stays of order one
NUDGE = 1e-7  # perturbation over the equilibrium overlap
TRIES = 8  # bisections: to half a per cent of the estimate


def measure_stable_step(sim: GrainEngine, estimate: float) -> float:
    """Largest step [s] at which a perturbation of all grains does not grow, by bisection.

    At a step of 1 + e times the limit the energy of the fastest mode grows in each step by
    exp(4 sqrt(2 e)) without damping and by about exp(2 e) with dominant damping, so that 400 steps
    resolve 1 %. estimate [s]: the search is from 0.3 to 1.7 of it; nan without a limit in between.
    """
    state, dt = sim.state(), sim.dt
    low, high = 0.3 * estimate / sim.units("s"), 1.7 * estimate / sim.units("s")

    def is_unstable(step: float) -> bool:
        sim.restore(state)
        sim.environment.dt = step
        return _measure_growth(sim, state) > GROWTH

    try:
        if is_unstable(low) or not is_unstable(high):
            return nan
        for _ in range(TRIES):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if is_unstable(middle) else (middle, high)
    finally:
        sim.environment.dt = dt
        sim.restore(state)
    return float(0.5 * (low + high) * sim.units("s"))


def _measure_growth(sim: GrainEngine, state: Any) -> float:
    """Largest kinetic energy of the difference of two trajectories over that of the perturbation.

    Within STEPS steps, not at their end: after contacts break, the grains may come to rest.
    Infinite where a guard of the search ends the trajectory. Both begin at the given state.
    """
    rng, mass, inertia = np.random.default_rng(5), sim.bodies.mass, sim.bodies.inertia
    shape = (sim.size, 3)
    # the same energy in every grain, so that none dominates
    speed = NUDGE * sim.numbers.pair.delta0 / sim.dt * np.sqrt(np.min(mass))
    nudge = {
        "v": speed / np.sqrt(mass) * rng.normal(size=shape),
        "w": speed / np.sqrt(inertia) * rng.normal(size=shape),
    }
    trajectories = []
    for factor in (0.0, 1.0):
        sim.restore(state)
        for name, change in nudge.items():
            values = state.arrays[name].copy()
            values[: sim.size] += factor * change
            sim.fields[name].from_numpy(values)
        trajectory = []
        for _ in range(POINTS):
            try:
                sim.advance(STEPS // POINTS)
            except GuardStop:
                return inf
            motion = (sim.fields[name].to_numpy()[: sim.size].astype(float) for name in nudge)
            trajectory.append(np.array(list(motion)))
        trajectories.append(trajectory)

    def compute_energy(v: NDArray[np.float64], w: NDArray[np.float64]) -> float:
        return float(np.sum(mass * v**2) + np.sum(inertia * w**2))

    largest = max(
        compute_energy(*(nudged - free)) for free, nudged in zip(*trajectories, strict=True)
    )
    return largest / compute_energy(*nudge.values()) if np.isfinite(largest) else inf
