"""Speed of the continuum (`python -m benchmarks continuum`).

A bead falls into a bed, in two dimensions and in three. Processes with one thread and with two are
timed in turn, round after round; a ratio is that of two consecutive measurements. Times with one
thread are processor times, without other programs; the speed-up of two threads is of wall times.
"""

import time
from contextlib import ExitStack
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.table import Column, Table, check_file
from dusttaichi.scene import Scene, quantities
from dusttaichi.studies.machine_speed import Timed, machine

SIZES = {2: (5_000, 20_000, 65_000), 3: (20_000,)}  # particles of the bed, about, by dimension
QUICK = {2: (5_000, 20_000), 3: (5_000,)}
THREADS = (1, 2)
ROUNDS, QUICK_ROUNDS = 7, 5
PARTICLE_STEPS = 1_000_000  # of a measurement, about a second
LEAST_STEPS = 24
ROOM = {2: 8.0 * 5.0, 3: 4.0 * 4.0 * 2.5}  # mm^2, mm^3
SIZE = {2: ["8 mm", "5 mm"], 3: ["4 mm", "4 mm", "2.5 mm"]}


# medians over the rounds; one thread, and processor time, but for the speed-up
FRONT = (Column("dimension", "dimensions"), Column("particles", "particles"))
COLUMNS = (
    Column("neighbours", "neighbours", "", 1),  # of a particle, within reach of the kernel
    Column("microseconds", "us per particle-step", "us", 2),
    Column("nanoseconds", "ns per neighbour", "ns", 1),
    Column("search", "search, us per particle", "us", 2),
    Column("speed_up", "speed-up of two threads", "1", 2),  # of wall times
    Column("spread", "spread %", "%", 0),  # largest minus smallest round over the median
)


def scene_of(dimension: int, particles: int, threads: int) -> Scene:
    """A bead of 1.1 mm at 0.65 m/s above a bed of about `particles` particles."""
    spacing = 1e-3 * (ROOM[dimension] / particles) ** (1.0 / dimension)
    length = quantities.format(spacing, "length")
    layer = quantities.format(4.0 * spacing, "length")
    sides = ("bottom", "x_min", "x_max", *(("y_min", "y_max") if dimension == 3 else ()))
    return Scene.from_dict(
        {
            "name": f"bench_{dimension}d",
            "method": "continuum",
            "dimension": dimension,
            "material": "dust_g09",
            "sample": {
                "kind": "impact",
                "target": {"kind": "block", "size": SIZE[dimension]},
                "projectile": {"kind": "rigid", "diameter": "1.1 mm", "density": "2540 kg/m^3"},
                "speed": "0.65 m/s",
            },
            "gravity": "9.81 m/s^2",
            "boundary": {"kind": "faces"} | {face: {"layer": layer} for face in sides},
            "numerics": {"spacing": length, "threads": threads},
            "stop": {"steps": 1},
        }
    )


def main(*, out: str | Path | None = None, quick: bool = False, log=lambda line: None) -> Table:
    """Measure every size; about three minutes, `quick` one.

    out: CSV file to write. log: called with lines on the progress.
    """
    rounds = QUICK_ROUNDS if quick else ROUNDS
    check_file(out)
    rows = []
    for dimension, numbers in (QUICK if quick else SIZES).items():
        for particles in numbers:
            log(f"{dimension} dimensions, {particles} particles")
            rows.append(_measure(dimension, particles, rounds))
    notes = (
        f"A bead falls into a bed; medians of {rounds} rounds. One thread: processor time of both "
        "passes and the motion; neighbours: within reach of the kernel. Speed-up: ratios of wall "
        "times of one round, which other programs affect.",
    )
    table = Table(machine(), rows, [("Speed of the continuum", FRONT, COLUMNS)], notes)
    if out is not None:
        table.to_csv(out)
    return table


def _measure(dimension, particles, rounds) -> dict:
    with ExitStack() as stack:
        processes = [stack.enter_context(Timed(f"{__name__}:answer")) for _ in THREADS]
        for process, threads in zip(processes, THREADS, strict=True):
            built = process.call("build", scene=scene_of(dimension, particles, threads).to_yaml())
        steps = max(LEAST_STEPS, PARTICLE_STEPS // built["particles"])
        for process in processes:
            process.call("timed", steps=max(1, steps // 5))
        timings = [[p.call("timed", steps=steps) for p in processes] for _ in range(rounds)]
    used = [single_thread["used"] for single_thread, _ in timings]
    step = median(used) / built["particles"]
    return {
        "dimension": dimension,
        "particles": built["particles"],
        "neighbours": built["neighbours"],
        "microseconds": 1e6 * step,
        "nanoseconds": 1e9 * step / built["neighbours"],
        "search": 1e6 * built["search"] / built["particles"],
        "speed_up": median(
            single_thread["real"] / two_threads["real"] for single_thread, two_threads in timings
        ),
        "spread": 100.0 * (max(used) - min(used)) / median(used),
    }


# -- in the worker ---------------------------------------------------------------------------------

_state = {}


def _count_neighbours(engine):
    """Count the neighbours within reach of the kernel: their mean over the particles that move by
    themselves, with images."""
    x, lanes = engine.dust_state["x"], engine.layout.lanes
    yields, blocks = engine.dust_state.of_particles("group") < 0, -(-engine.size // lanes)
    first = engine.scratch["first"].to_numpy(blocks + 1)
    entry = engine.scratch["entry"].to_numpy()[: first[-1]]
    # a block has one list: each of its particles with all of that
    block, neighbour_count = np.repeat(np.arange(blocks), np.diff(first)), 0
    for lane in range(lanes):
        i = np.minimum(lanes * block + lane, engine.size - 1)
        apart = np.linalg.norm(x[i] - x[entry], axis=1)
        near = (apart < 2.0 * engine.numbers.values["h"]) & (i != entry) & yields[i]
        neighbour_count += np.count_nonzero(near & (lanes * block + lane < engine.size))
    return neighbour_count / max(1, np.count_nonzero(yields))


def _build(scene):
    """Build a scene (YAML), compute a few steps. Answers particles, neighbours, search [s]."""
    from dusttaichi import method
    from dusttaichi.scene import from_yaml

    scene = from_yaml(scene)
    engine = method.find_method(scene).build(scene, method.make_sample(scene))
    engine.advance(1)
    began = time.process_time()
    engine.search.update()
    search = time.process_time() - began
    _state["engine"] = engine
    measures = {"particles": engine.size, "neighbours": _count_neighbours(engine)}
    return measures | {"search": search}


def _time_steps(steps):
    """Measure wall and processor time [s] of a step of the method, over whole steps of the run."""
    engine = _state["engine"]
    began, wall_start, processor_start = (
        engine.dust_state.substeps,
        time.perf_counter(),
        time.process_time(),
    )
    while engine.dust_state.substeps - began < steps:
        engine.advance(1)
    steps_done = engine.dust_state.substeps - began
    return {
        "real": (time.perf_counter() - wall_start) / steps_done,
        "used": (time.process_time() - processor_start) / steps_done,
    }


def answer(parent, *, do, **arguments):
    """Answer of the worker. do: "build" a scene, or measure `timed` steps of it."""
    return {"build": _build, "timed": _time_steps}[do](**arguments)
