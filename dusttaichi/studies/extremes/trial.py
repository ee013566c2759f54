"""Trial of a cell: build it, compute its steps under the guards of a run, check all numbers."""

import time as real_time
import traceback
import warnings
from dataclasses import asdict, replace
from math import inf, nan, pi

import numpy as np

from dusttaichi import method, units
from dusttaichi import samples as generators
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.grains import network
from dusttaichi.grains.build import build
from dusttaichi.grains.moving_grains import MovingGrains
from dusttaichi.grains.time_step import TimeStep
from dusttaichi.method import Start
from dusttaichi.run import ledger
from dusttaichi.scene import Scene
from dusttaichi.scene.grains import GrainsScene
from dusttaichi.studies.extremes import arrangements
from dusttaichi.studies.extremes.cell import Cell, CellResult
from dusttaichi.studies.extremes.limit import measured_limit

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
        sim = method.of(scene).build(scene, method.make_sample(scene))
        result = watched(sim, scene, cell.steps, lambda: sim.snapshot().values())
        return replace(result, dt=sim.dt * units.TIME)
    if cell.limit:  # its perturbation is below the resolution of single precision
        scene = scene.with_value("numerics.precision", "f64")
    sample = (
        generators.make(scene) if cell.sample is None else arrangements.make(scene, cell.sample)
    )
    step = None
    if cell.fraction is not None:
        # a first build, with any step, for its contacts
        sim = build(scene, sample, step=TimeStep(1e-15, inf, inf))
        period, stable = network.stable_step(sim, scene)
        step = TimeStep(cell.fraction * pi * stable, period, stable)
    sim = build(scene, sample, step=step)
    estimated = measured = nan
    if cell.limit:
        estimated = network.stable_step(sim, scene)[1]
        measured = measured_limit(sim, estimated)
    moving = MovingGrains(scene, sample, sim)
    result = watched(moving, scene, cell.steps, sim.grain_state)
    return replace(result, dt=sim.dt * units.TIME, estimated=estimated, measured=measured)


def watched(sim, scene, steps, state):
    """CellResult of `steps` steps of a method.Simulation with the guards and records of a run.

    state(): current arrays, whose numbers must be finite.
    """
    tolerance, start, worst = scene.numerics.ledger_tolerance, Start.of(sim.measure()), 0.0
    records = set(np.linspace(0, steps, RECORDS + 1).astype(int).tolist())
    while True:
        m = sim.measure()
        try:
            ledger.check(sim, m, start, tolerance)
        except GuardStop as stop:
            return CellResult("stopped", str(stop), worst, sim.step)
        residual, through = ledger.turnover(m, start)
        worst, start = max(worst, abs(residual) / through if through > 0.0 else 0.0), start.after(m)
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
